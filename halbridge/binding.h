/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Copies between pins and struct values, by the table.
 */
#ifndef HALBRIDGE_BINDING_H
#define HALBRIDGE_BINDING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "halbridge/table.h"
#include "halbridge/values.h"

enum {
	BINDING_PINS = 4096, /* of one device, at most; an I/O pin counts twice */
	BINDING_NO_TWIN = UINT16_MAX,
	BINDING_TURNS = 32,           /* periods in which all IN pins get their turn */
	BINDING_OUT_TURNS = 128,      /* and all OUT pins */
	BINDING_ACTIVE = 1280,        /* IN pins of a funct, at most */
	BINDING_WORD = 8,             /* bytes of struct values whose pins lie together */
	BINDING_CHUNK = VALUES_CHUNK, /* and that are compared at once */
	BINDING_CHUNKS = (sizeof(struct values) + BINDING_CHUNK - 1) / BINDING_CHUNK,
};

/* Which member of struct values a pin carries, and which pointer is the pin's. */
struct binding_slot {
	uint16_t offset, pointer;
	uint8_t type, block; /* enum table_type, enum values_block */
	bool follows;        /* it counts when it has changed, not when it is what it is */
	bool always;         /* read in each period, linked or not */
	uint16_t twin;       /* of an I/O pin's OUT slot: its IN slot; else NO_TWIN */
};

struct binding_range {
	uint16_t first, count;
};

/* Chunks one behind the other, by their place in struct values. */
struct binding_run {
	uint16_t begin, end;
};

/* Where a value goes from and to, and no more. */
struct binding_way {
	uint16_t offset, pointer;
};

/* Pins that are read when they are linked, and else in turn. */
struct binding_turns {
	struct binding_range range;
	struct binding_way active[TABLE_TYPES][BINDING_ACTIVE]; /* read in each period */
	uint16_t active_count[TABLE_TYPES];
	uint16_t following[TABLE_TYPES][BINDING_ACTIVE]; /* and these, slots that follow */
	uint16_t following_count[TABLE_TYPES];
	uint16_t next;
	bool begun; /* all have been read once */
};

struct binding {
	struct values *values;
	void *volatile *pointers; /* one per pin, in HAL's memory: HAL moves them */
	uint16_t pins;
	struct binding_slot slot[BINDING_PINS]; /* one per pin, an I/O pin has two */
	struct binding_turns in[TABLE_WHENS], io;
	struct binding_range out[TABLE_WHENS]; /* of TABLE_AT_READ by offset, with I/O pins */
	/* the first at or behind */
	uint16_t word[BINDING_CHUNKS * BINDING_CHUNK / BINDING_WORD + 1];
	bool touched;                           /* an I/O pin has changed, since the last scatter */
	uint16_t in_turns;                      /* BINDING_TURNS; 1 = read all in each period */
	struct binding_run run[BINDING_CHUNKS]; /* those that have any, block by block */
	uint16_t run_first[VALUES_BLOCKS + 1];
	uint16_t next_out, out_slice; /* OUT slots that are written in turn, per period */
	uint64_t seen[BINDING_PINS];  /* of an IN slot: what was read, or written, last */
	bool linked[BINDING_PINS];    /* of a slot */
	void *own[BINDING_PINS];      /* of a pin: where it points while it is not linked */
	unsigned char shown[BINDING_CHUNKS * BINDING_CHUNK]; /* values as written last */
};

/*
 * Lay out the slots for the names of `schemes`: pin k of the walk over them
 * uses pointers[k], table_pin_count(schemes) of them. 0, or -ENOSPC if the
 * table has outgrown the arrays. Cold.
 */
int binding_init(struct binding *binding, struct values *values, void *volatile *pointers,
		 unsigned int schemes);

/* The pins are exported, and nobody has linked one yet. Cold. */
void binding_exported(struct binding *binding);

/*
 * IN pins of this funct into the values, at read I/O pins as well: those that
 * are linked or control something, and of the others some in turn. Realtime.
 */
void binding_gather(struct binding *binding, enum table_when when);

/*
 * Values that have changed to the OUT pins of this funct: at read those of
 * blocks that were marked, some pins in turn, changed or not, and I/O pins whose
 * value was changed since it was gathered. Realtime.
 */
void binding_scatter(struct binding *binding, enum table_when when);

/* All OUT pins, changed or not. Realtime, but slower. */
void binding_scatter_all(struct binding *binding);

#endif
