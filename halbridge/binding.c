/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Copying by table instead of by hand.
 *
 * HAL gives a pin as a pointer that it moves when the pin is linked, so a
 * value goes through one pointer and one offset, both in dense arrays sorted
 * by direction, funct, block and type: tight loops, no branch per pin, about
 * half a nanosecond each. The exchange stays free of pointers that can point
 * anywhere, and one value can be given to several pins.
 *
 * OUT pins are written when their block has changed. Linking a pin to a signal
 * that others use already gives the signal's old value to it, so one block is
 * written anew in each period in any case: nothing stays wrong for longer than
 * there are blocks.
 *
 * An I/O pin belongs to both sides. It is taken when it has changed, and written
 * when the value is another than was last seen at it; otherwise a wish that came
 * in between from another thread would be lost. So two I/O pins of one member
 * follow each other.
 *
 * Two IN pins of one member (two names of one thing): whichever changed last
 * counts, so either may be linked or set, and the other one, which stays at
 * what it was, has no say.
 */
#include "halbridge/binding.h"
#include <errno.h>
#include <stdbool.h>
#include <string.h>
#include "halbridge/layout.h"

/* HAL's view of the same bytes. */
typedef volatile bool pin_bit;
typedef volatile double pin_float;
typedef volatile uint32_t pin_word;

int binding_init(struct binding *binding, struct values *values, void *volatile *pointers,
		 unsigned int schemes)
{
	memset(binding, 0, sizeof(*binding));
	binding->values = values;
	binding->pointers = pointers;
	return layout_slots(binding, schemes);
}

/* One loop per type; both sides are aligned, the table took the type from the member. */
#define COPY_IN(type_)	do {								\
	for (; slot < end; slot++)							\
		*(type_ *)(values + slot->offset) = *(type_ *)binding->pointers[slot->pointer];	\
	} while (0)

#define COPY_OUT(type_)	do {								\
	for (; slot < end; slot++)							\
		*(type_ *)binding->pointers[slot->pointer] = *(type_ *)(values + slot->offset);	\
	} while (0)

static void copy_in(struct binding *binding, struct binding_range range, unsigned int type)
{
	unsigned char *values = (unsigned char *)binding->values;
	const struct binding_slot *slot = &binding->slot[range.first];
	const struct binding_slot *end = slot + range.count;

	if (type == TABLE_BIT)
		COPY_IN(pin_bit);
	else if (type == TABLE_FLOAT)
		COPY_IN(pin_float);
	else
		COPY_IN(pin_word);
}

static void copy_out(struct binding *binding, struct binding_range range, unsigned int type)
{
	unsigned char *values = (unsigned char *)binding->values;
	const struct binding_slot *slot = &binding->slot[range.first];
	const struct binding_slot *end = slot + range.count;

	if (type == TABLE_BIT)
		COPY_OUT(pin_bit);
	else if (type == TABLE_FLOAT)
		COPY_OUT(pin_float);
	else
		COPY_OUT(pin_word);
}

/* Bytes of a value, for comparing. */
static uint64_t bytes_of(const void *value, unsigned int type)
{
	uint64_t bytes = 0;

	if (type == TABLE_BIT)
		bytes = *(const pin_bit *)value;
	else if (type == TABLE_FLOAT)
		memcpy(&bytes, value, sizeof(bytes));
	else
		bytes = *(const pin_word *)value;
	return bytes;
}

static const void *value_at(const struct binding *binding, const struct binding_slot *slot)
{
	return (const unsigned char *)binding->values + slot->offset;
}

/* Of the pins of one member, those that have changed since the last look. */
static void gather_shared(struct binding *binding, struct binding_range range, unsigned int type,
			  uint64_t *seen)
{
	for (uint16_t i = 0; i < range.count; i++) {
		struct binding_range one = { (uint16_t)(range.first + i), 1 };
		const struct binding_slot *slot = &binding->slot[one.first];
		uint64_t bytes = bytes_of(binding->pointers[slot->pointer], type);

		if (bytes == seen[i])
			continue;
		seen[i] = bytes;
		copy_in(binding, one, type);
	}
}

/* Shared pins are remembered in the order of their slots, and those lie together. */
static uint64_t *seen_of(struct binding *binding, struct binding_range range)
{
	return &binding->shared_seen[range.first - binding->shared[0][0].first];
}

void binding_gather(struct binding *binding, enum table_when when)
{
	size_t io = 0;

	for (unsigned int type = 0; type < TABLE_TYPES; type++) {
		struct binding_range range = binding->io[type];
		struct binding_range shared = binding->shared[when][type];

		copy_in(binding, binding->in[when][type], type);
		gather_shared(binding, shared, type, seen_of(binding, shared));
		gather_shared(binding, range, type, &binding->io_seen[io]);
		io += range.count;
	}
}

static void scatter_io(struct binding *binding)
{
	size_t io = 0;

	for (unsigned int type = 0; type < TABLE_TYPES; type++) {
		struct binding_range range = binding->io[type];

		for (uint16_t i = 0; i < range.count; i++, io++) {
			struct binding_range one = { (uint16_t)(range.first + i), 1 };
			uint64_t bytes = bytes_of(value_at(binding, &binding->slot[one.first]),
						  type);

			if (bytes == binding->io_seen[io])
				continue;
			binding->io_seen[io] = bytes;
			copy_out(binding, one, type);
		}
	}
}

static void scatter_blocks(struct binding *binding, enum table_when when, uint32_t blocks)
{
	for (blocks &= binding->all[when]; blocks; blocks &= blocks - 1) {
		const struct binding_range *ranges =
			binding->out[when][__builtin_ctz(blocks)];

		for (unsigned int type = 0; type < TABLE_TYPES; type++) {
			if (ranges[type].count)
				copy_out(binding, ranges[type], type);
		}
	}
	scatter_io(binding);
}

void binding_scatter(struct binding *binding, enum table_when when)
{
	uint32_t blocks = binding->values->changed;

	if (when == TABLE_AT_READ) {
		binding->turn = (binding->turn + 1) % VALUES_BLOCKS;
		blocks |= UINT32_C(1) << binding->turn;
	} else {
		blocks = UINT32_MAX;	/* there are few of them */
	}
	binding->values->changed = 0;
	scatter_blocks(binding, when, blocks);
}

void binding_scatter_all(struct binding *binding, enum table_when when)
{
	scatter_blocks(binding, when, UINT32_MAX);
}
