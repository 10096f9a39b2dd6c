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
	BINDING_IO = 256,	/* I/O pins among them, at most */
	BINDING_SHARED = 768,	/* IN pins among them whose member has another IN pin */
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
	struct binding_range in[TABLE_WHENS][TABLE_TYPES], shared[TABLE_WHENS][TABLE_TYPES];
	struct binding_range io[TABLE_TYPES];
	struct binding_range out[TABLE_WHENS][VALUES_BLOCKS][TABLE_TYPES];
	uint32_t all[TABLE_WHENS];	/* blocks that have OUT pins */
	uint64_t io_seen[BINDING_IO];	/* I/O pins at the last look or writing */
	uint64_t shared_seen[BINDING_SHARED];	/* shared IN pins at the last look */
	unsigned int turn;		/* the block that is written although nothing changed */
};

/*
 * Lay out the slots for the names of `schemes`: pin k of the walk over them
 * uses pointers[k], table_pin_count(schemes) of them. 0, or -ENOSPC if the
 * table has outgrown the arrays. Cold.
 */
int binding_init(struct binding *binding, struct values *values, void *volatile *pointers,
		 unsigned int schemes);

/* IN and I/O pins of this funct into the values. Realtime. */
void binding_gather(struct binding *binding, enum table_when when);

/*
 * Values to the OUT pins of this funct, of the blocks that were marked as
 * changed and one more in turn, and to those I/O pins whose value was changed
 * since it was gathered. Realtime.
 */
void binding_scatter(struct binding *binding, enum table_when when);

/* The same for all blocks. Realtime. */
void binding_scatter_all(struct binding *binding, enum table_when when);

#endif
