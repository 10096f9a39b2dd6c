/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Sorting pins into ranges: one walk to count, one to place.
 *
 * Each pin belongs to one range, by direction, funct, block and type; the
 * ranges lie one behind the other in the slots. Which IN pins share their
 * member with another one must be known first: those are compared one by one
 * each period, all others are just copied.
 */
#include "halbridge/layout.h"
#include <errno.h>
#include <string.h>

struct sharing {
	uint8_t pins[sizeof(struct values)];	/* IN pins of the member at this offset */
};

static void count_sharing(struct sharing *sharing, unsigned int schemes)
{
	memset(sharing, 0, sizeof(*sharing));
	for (struct table_cursor name = table_walk(schemes); table_next(&name);) {
		if (name.row->kind == TABLE_PIN && name.row->direction == TABLE_IN)
			sharing->pins[name.offset]++;
	}
}

static struct binding_range *range_of(struct binding *binding, const struct sharing *sharing,
				      const struct table_cursor *name)
{
	const struct table_row *row = name->row;

	if (row->direction == TABLE_IO)
		return &binding->io[row->type];
	if (row->direction == TABLE_OUT)
		return &binding->out[row->when][values_block_of(name->offset)][row->type];
	if (sharing->pins[name->offset] > 1)
		return &binding->shared[row->when][row->type];
	return &binding->in[row->when][row->type];
}

/* Give `count` ranges their place behind `at`; the counts begin anew. Returns what is used. */
static size_t place(struct binding_range *ranges, size_t count, size_t *at)
{
	size_t used = 0;

	for (size_t i = 0; i < count; i++) {
		ranges[i].first = (uint16_t)*at;
		*at += ranges[i].count;
		used += ranges[i].count;
		ranges[i].count = 0;
	}
	return used;
}

#define PLACE(array_)	place((struct binding_range *)(array_), \
			      sizeof(array_) / sizeof(struct binding_range), &at)

static int place_all(struct binding *binding)
{
	size_t at = 0;

	PLACE(binding->in);
	if (PLACE(binding->shared) > BINDING_SHARED || PLACE(binding->io) > BINDING_IO)
		return -ENOSPC;
	PLACE(binding->out);
	return 0;
}

static void count_pins(struct binding *binding, const struct sharing *sharing,
		       unsigned int schemes)
{
	for (struct table_cursor name = table_walk(schemes); table_next(&name);) {
		if (name.row->kind == TABLE_PIN)
			range_of(binding, sharing, &name)->count++;
	}
}

static void place_pins(struct binding *binding, const struct sharing *sharing,
		       unsigned int schemes)
{
	uint16_t pin = 0;

	for (struct table_cursor name = table_walk(schemes); table_next(&name);) {
		struct binding_range *range;

		if (name.row->kind != TABLE_PIN)
			continue;
		range = range_of(binding, sharing, &name);
		binding->slot[range->first + range->count++] = (struct binding_slot){
			.offset = (uint16_t)name.offset, .pointer = pin++,
		};
		if (name.row->direction == TABLE_OUT)
			binding->all[name.row->when] |= UINT32_C(1) << values_block_of(name.offset);
	}
}

int layout_slots(struct binding *binding, unsigned int schemes)
{
	static struct sharing sharing;
	int r;

	if (table_pin_count(schemes) > BINDING_PINS)
		return -ENOSPC;
	count_sharing(&sharing, schemes);
	count_pins(binding, &sharing, schemes);
	r = place_all(binding);
	if (!r)
		place_pins(binding, &sharing, schemes);
	return r;
}
