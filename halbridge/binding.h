/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Copies between pins and struct values, by the table.
 */
#ifndef HALBRIDGE_BINDING_H
#define HALBRIDGE_BINDING_H

#include <stddef.h>
#include <stdint.h>
#include "halbridge/table.h"
#include "halbridge/values.h"

enum {
	BINDING_PINS = 4096,	/* of one device, at most */
	BINDING_IO = 64,	/* I/O pins among them, at most */
};

/* Which member of struct values a pin carries, and which pointer is the pin's. */
struct binding_slot {
	uint16_t offset, pointer;
};

struct binding_range {
	uint16_t first, count;
};

struct binding {
	struct values *values;
	void *volatile *pointers;	/* one per pin, in HAL's memory: HAL moves them */
	struct binding_slot slot[BINDING_PINS];
	struct binding_range in[TABLE_WHENS][TABLE_TYPES], out[TABLE_WHENS][TABLE_TYPES];
	struct binding_range io[TABLE_TYPES];
	uint64_t seen[BINDING_IO];	/* I/O pins as gathered */
};

/*
 * Lay out the slots: pin k of the table (rows in order, instances in order)
 * uses pointers[k], table_pin_count() of them. 0, or -ENOSPC if the table has
 * outgrown the arrays. Cold.
 */
int binding_init(struct binding *binding, struct values *values, void *volatile *pointers);

/* IN and I/O pins of this funct into the values. Realtime. */
void binding_gather(struct binding *binding, enum table_when when);

/*
 * Values to the OUT pins of this funct, and to those I/O pins whose value was
 * changed since it was gathered. Realtime.
 */
void binding_scatter(struct binding *binding, enum table_when when);

#endif
