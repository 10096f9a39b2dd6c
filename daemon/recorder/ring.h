/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The flight recorder's ring: the last seconds' packets, cycles and events, in
 * a file of the runtime folder that the realtime thread has mapped. Fixed
 * slots, one writer; whoever may read the file may read it at any time, also
 * after the writer has died.
 *
 * Slot number n (from 0, since the start) stands at n % slots. Numbers below
 * head.written and above head.written - slots are whole; the oldest one may be
 * about to be overwritten (read.h).
 */
#ifndef RECORDER_RING_H
#define RECORDER_RING_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "daemon/device/event.h"

#define RECORDER_MAGIC "PKREC\r\n\x1a"

enum {
	RECORDER_VERSION = 2,
	RECORDER_DEVICES = 64,
	RECORDER_DATA = 80,   /* bytes kept of a datagram; legal ones have 64 */
	RECORDER_HEAD = 4096, /* bytes of the file before the first slot */
	RECORDER_SLOTS_MIN = 256,
	RECORDER_SLOTS_MAX = 1 << 20, /* 128 MiB */
};

enum recorder_kind {
	RECORDER_SENT = 1,
	RECORDER_RECEIVED,
	RECORDER_EVENT, /* data holds a struct event */
	RECORDER_CYCLE, /* data holds a struct recorder_cycle */
};

/* Times are CLOCK_MONOTONIC ns. */
struct recorder_slot {
	uint64_t number;
	uint64_t t_ns;        /* handed to the transport; taken in by the kernel;
			       * happened */
	uint64_t taken_ns;    /* received: when the daemon looked at it */
	uint32_t peer, local; /* IPv4, host byte order; 0 = not known */
	uint16_t peer_port, local_port;
	uint16_t length; /* of the datagram; at most RECORDER_DATA are in data */
	uint8_t kind;    /* enum recorder_kind */
	uint8_t device;  /* index, 255 = none */
	uint8_t verdict; /* received: enum pokeys_verdict */
	uint8_t tries;   /* sent: the n-th transmission of this request */
	bool stamped;    /* received: t_ns is the kernel's, else taken_ns */
	bool once;       /* sent: a newer one will replace it */
	uint32_t cycle;  /* the cycle it fell into, low 32 bits */
	uint8_t data[RECORDER_DATA];
};

/* One cycle, written at its end. Without reply or wait a time is the one before it. */
struct recorder_cycle {
	uint64_t cycle;
	uint64_t tick_ns;      /* when it should have begun */
	uint64_t woke_ns;      /* when it did */
	uint64_t asked_ns;     /* requests are planned and queued; of a thread that polls
				* the urgent ones, which go out before the others */
	uint64_t published_ns; /* the last state image is out */
	uint64_t end_ns;
	uint32_t skipped; /* ticks that were missed before it */
	uint32_t reserved;
};

struct recorder_head {
	char magic[8];
	uint32_t version, slot_size;
	uint32_t slots; /* a power of two */
	uint32_t devices;
	uint64_t period_ns;
	int32_t process;
	_Atomic int32_t thread; /* the realtime one, 0 = has not begun */
	_Atomic uint32_t ended; /* 1: the daemon has ended, and not died */
	uint32_t spins;         /* 1: the thread polls instead of sleeping */
	char name[RECORDER_DEVICES][32];
	_Atomic uint64_t written __attribute__((aligned(64))); /* slots, since the start */
};

/* The writer's side; all zero = off. */
struct recorder {
	struct recorder_head *head;
	struct recorder_slot *slot;
	uint64_t mask;
};

_Static_assert(sizeof(struct recorder_slot) == 128, "two cache lines");
_Static_assert(sizeof(struct recorder_head) <= RECORDER_HEAD, "slots follow it");
_Static_assert(sizeof(struct event) <= RECORDER_DATA, "an event fits");
_Static_assert(sizeof(struct recorder_cycle) <= RECORDER_DATA, "a cycle fits");

/*
 * Record one. number is filled in; what of `slot` its kind does not use is 0.
 * `size` bytes of `data` are kept, at most RECORDER_DATA. Does nothing if the
 * recorder is off. Realtime, the one writer.
 */
void recorder_write(struct recorder *recorder, const struct recorder_slot *slot, const void *data,
		    size_t size);

/* As struct event_ring.tap: an event, with its own time. Realtime. */
void recorder_tap(void *recorder, const struct event *event);

#endif
