/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How many requests of a kind may be under way at once. Part of struct device. Realtime
 * thread only.
 */
#ifndef DEVICE_PIPELINE_H
#define DEVICE_PIPELINE_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/engine/mailbox.h"

/* Replies to the status, or to 0xCC if there is no pulse engine, one after the other. */
struct pipeline_span {
	uint32_t round_trips, intervals;     /* so many */
	uint32_t behind;                     /* 0xCC that had others before them */
	uint64_t round_trip_ns, interval_ns; /* sums: from the reply before */
};

struct pipeline {
	uint32_t depth;
	bool trying;            /* two 0xCC, while everything else has depth 1 */
	bool doubted;           /* the last comparison showed a queue */
	uint64_t since_ns;      /* since then it is 1, or more */
	uint64_t hold_ns;       /* 1 for so long at least */
	uint64_t reply_ns;      /* the last one came */
	uint64_t one_by_one_ns; /* the delay with depth 1; 0 = not known */
	uint64_t least_ns;      /* ... of all depths since then */
	bool skipped;           /* a cycle did without the status */
	struct pipeline_span span;
};

struct device;

void pipeline_begin(struct device *device);
/* How many with this parser are under way; of them, those whose replies are not late. */
unsigned int pipeline_open(const struct device *device, pokeys_parser_t parser);
unsigned int pipeline_awaited(const struct device *device, pokeys_parser_t parser);
/* Whether one more may be sent. first: it is tried first with this kind. */
bool pipeline_may(const struct device *device, pokeys_parser_t parser, bool first);
/* The open request with this serial number, or NULL. */
const mailbox_entry_t *pipeline_find(const struct device *device, uint64_t serial);
bool pipeline_send(struct device *device, enum wire_op op, const void *value,
		   pokeys_parser_t parser, pokeys_refresh_t refresh);
/* A request was answered: is it newer than that of *taken? Then it is *taken now. */
bool pipeline_take(struct device *device, const mailbox_entry_t *entry, uint64_t *taken);
/* In this cycle another request takes the place of the status. */
void pipeline_skip(struct device *device);
/* How long 0xCC or the status took: is the device fast enough? */
void pipeline_learn(struct device *device, const mailbox_entry_t *entry, bool status);

#endif
