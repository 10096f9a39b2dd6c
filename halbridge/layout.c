/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Sorting pins into ranges: one walk to count, one to place.
 *
 * Each pin belongs to one range, by direction and funct. OUT pins of read stand
 * in the order of their members, so that a piece of struct values that has not
 * changed spares all its pins at once. Which IN pins share their member with
 * another one must be known first: those count when they change.
 */
#include "halbridge/layout.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>

struct sharing {
	uint8_t pins[sizeof(struct values)]; /* IN pins of the member at this offset */
};

static void count_sharing(struct sharing *sharing, unsigned int schemes)
{
	memset(sharing, 0, sizeof(*sharing));
	for (struct table_cursor name = table_walk(schemes); table_next(&name);) {
		if (name.row->kind == TABLE_PIN && name.row->direction == TABLE_IN)
			sharing->pins[name.offset]++;
	}
}

static struct binding_range *range_of(struct binding *binding, const struct table_row *row)
{
	if (row->direction == TABLE_IO)
		return &binding->io.range;
	return row->direction == TABLE_OUT ? &binding->out[row->when] :
					     &binding->in[row->when].range;
}

/* Returns how many slots there will be. */
static size_t count_pins(struct binding *binding, unsigned int schemes)
{
	size_t slots = 0;

	for (struct table_cursor name = table_walk(schemes); table_next(&name);) {
		bool io = name.row->direction == TABLE_IO;

		if (name.row->kind != TABLE_PIN)
			continue;
		range_of(binding, name.row)->count++;
		binding->out[TABLE_AT_READ].count += io;
		slots += 1u + io;
	}
	return slots;
}

/* Give the range its place behind `at`; its count begins anew. Returns its end. */
static size_t place(struct binding_range *range, size_t at)
{
	size_t end = at + range->count;

	*range = (struct binding_range){ .first = (uint16_t)at };
	return end;
}

static void place_ranges(struct binding *binding)
{
	size_t at = 0;

	for (unsigned int when = 0; when < TABLE_WHENS; when++) {
		at = place(&binding->in[when].range, at);
		at = place(&binding->out[when], at);
	}
	place(&binding->io.range, at);
}

/* Of these blocks all IN pins are read in each period. */
#define CONTROL	(1u << BLOCK_MACHINE | 1u << BLOCK_ENGINE | 1u << BLOCK_RTC | \
		 1u << BLOCK_COUNTER | 1u << BLOCK_PWM | 1u << BLOCK_ENCODER | \
		 1u << BLOCK_JOINT | 1u << BLOCK_HEATER | 1u << BLOCK_SERVO | \
		 1u << BLOCK_DIAGNOSTICS)

static void place_pins(struct binding *binding, const struct sharing *sharing, unsigned int schemes)
{
	for (struct table_cursor name = table_walk(schemes); table_next(&name);) {
		const struct table_row *row = name.row;
		struct binding_slot slot = {
			.offset = (uint16_t)name.offset,
			.pointer = binding->pins,
			.type = row->type,
			.block = (uint8_t)values_block_of(name.offset),
			.twin = BINDING_NO_TWIN,
			.always = CONTROL >> values_block_of(name.offset) & 1,
			.follows = row->direction == TABLE_IO || sharing->pins[name.offset] > 1,
		};
		struct binding_range *range;

		if (row->kind != TABLE_PIN)
			continue;
		binding->pins++;
		range = range_of(binding, row);
		binding->slot[range->first + range->count] = slot;
		slot.twin = (uint16_t)(range->first + range->count++);
		range = &binding->out[TABLE_AT_READ];
		if (row->direction == TABLE_IO)
			binding->slot[range->first + range->count++] = slot;
	}
}

static int compare(const void *a, const void *b)
{
	const struct binding_slot *left = a, *right = b;

	return left->offset != right->offset ? (int)left->offset - (int)right->offset :
					       (int)left->pointer - (int)right->pointer;
}

/* Which slots stand in which word of struct values. */
static void index_words(struct binding *binding)
{
	const struct binding_range range = binding->out[TABLE_AT_READ];
	uint16_t i = range.first;

	qsort(&binding->slot[range.first], range.count, sizeof(binding->slot[0]), compare);
	for (size_t word = 0; word < sizeof(binding->word) / sizeof(binding->word[0]); word++) {
		while (i < range.first + range.count &&
		       binding->slot[i].offset < word * BINDING_WORD)
			i++;
		binding->word[word] = i;
	}
}

/* Which chunks of a block have to be looked at. */
static void list_runs(struct binding *binding)
{
	const size_t words = BINDING_CHUNK / BINDING_WORD;
	uint16_t used = 0;

	for (unsigned int block = 0; block < VALUES_BLOCKS; block++) {
		size_t end = values_block_end((enum values_block)block);
		size_t at = values_block_begin((enum values_block)block) / BINDING_CHUNK *
			    BINDING_CHUNK;

		binding->run_first[block] = used;
		for (; at < end; at += BINDING_CHUNK) {
			const uint16_t *first = &binding->word[at / BINDING_WORD];

			if (first[0] == first[words])
				continue;
			if (used == binding->run_first[block] || binding->run[used - 1].end != at)
				binding->run[used++].begin = (uint16_t)at;
			binding->run[used - 1].end = (uint16_t)(at + BINDING_CHUNK);
		}
	}
	binding->run_first[VALUES_BLOCKS] = used;
}

int layout_slots(struct binding *binding, unsigned int schemes)
{
	static struct sharing sharing;

	count_sharing(&sharing, schemes);
	if (count_pins(binding, schemes) > BINDING_PINS)
		return -ENOSPC;
	for (unsigned int when = 0; when < TABLE_WHENS; when++) {
		if (binding->in[when].range.count > BINDING_ACTIVE)
			return -ENOSPC;
	}
	if (binding->io.range.count > BINDING_ACTIVE)
		return -ENOSPC;
	place_ranges(binding);
	place_pins(binding, &sharing, schemes);
	index_words(binding);
	list_runs(binding);
	binding->out_slice = (uint16_t)(binding->out[TABLE_AT_READ].count / BINDING_OUT_TURNS + 1);
	return 0;
}
