/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Copying by table instead of by hand.
 *
 * HAL gives a pin as a pointer that it moves when the pin is linked, so a
 * value goes through one pointer and one offset, both in dense arrays sorted
 * by direction, funct and type: four tight loops, no branch per pin, about
 * half a nanosecond each. The exchange stays free of pointers that can point
 * anywhere, and one value can be given to several pins.
 *
 * An I/O pin belongs to both sides. It is written only when the exchange has
 * changed the value it was given; otherwise a wish that came in between from
 * another thread would be lost.
 */
#include "halbridge/binding.h"
#include <errno.h>
#include <stdbool.h>
#include <string.h>

/* HAL's view of the same bytes. */
typedef volatile bool pin_bit;
typedef volatile double pin_float;
typedef volatile uint32_t pin_word;

struct layout {
	struct binding *binding;
	size_t used;
};

static bool belongs(const struct table_row *row, unsigned int direction, unsigned int when,
		    unsigned int type)
{
	return row->kind == TABLE_PIN && row->direction == direction && row->type == type &&
	       (direction == TABLE_IO || row->when == when);
}

static struct binding_range lay(struct layout *layout, unsigned int direction, unsigned int when,
				unsigned int type)
{
	struct binding_range range = { .first = (uint16_t)layout->used };
	size_t pin = 0;

	for (size_t i = 0; i < table_row_count; i++) {
		const struct table_row *row = &table_rows[i];

		for (size_t k = 0; belongs(row, direction, when, type) && k < row->count; k++)
			layout->binding->slot[layout->used++] = (struct binding_slot){
				.offset = (uint16_t)(row->offset + k * row->stride),
				.pointer = (uint16_t)(pin + k),
			};
		pin += row->kind == TABLE_PIN ? row->count : 0;
	}
	range.count = (uint16_t)(layout->used - range.first);
	return range;
}

int binding_init(struct binding *binding, struct values *values, void *volatile *pointers)
{
	struct layout layout = { .binding = binding };
	size_t io = 0;

	if (table_pin_count() > BINDING_PINS)
		return -ENOSPC;
	memset(binding, 0, sizeof(*binding));
	binding->values = values;
	binding->pointers = pointers;
	for (unsigned int type = 0; type < TABLE_TYPES; type++) {
		for (unsigned int when = 0; when < TABLE_WHENS; when++) {
			binding->in[when][type] = lay(&layout, TABLE_IN, when, type);
			binding->out[when][type] = lay(&layout, TABLE_OUT, when, type);
		}
		binding->io[type] = lay(&layout, TABLE_IO, 0, type);
		io += binding->io[type].count;
	}
	return io > BINDING_IO ? -ENOSPC : 0;
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

static size_t type_size(unsigned int type)
{
	return type == TABLE_BIT ? sizeof(bool) : type == TABLE_FLOAT ? sizeof(double) : 4;
}

/* Bytes of an I/O pin's value in struct values, for comparing. */
static uint64_t value_bytes(const struct binding *binding, const struct binding_slot *slot,
			    unsigned int type)
{
	uint64_t bytes = 0;

	memcpy(&bytes, (const unsigned char *)binding->values + slot->offset, type_size(type));
	return bytes;
}

void binding_gather(struct binding *binding, enum table_when when)
{
	size_t io = 0;

	for (unsigned int type = 0; type < TABLE_TYPES; type++) {
		struct binding_range range = binding->io[type];

		copy_in(binding, binding->in[when][type], type);
		copy_in(binding, range, type);
		for (unsigned int i = 0; i < range.count; i++)
			binding->seen[io++] = value_bytes(binding, &binding->slot[range.first + i],
							  type);
	}
}

void binding_scatter(struct binding *binding, enum table_when when)
{
	size_t io = 0;

	for (unsigned int type = 0; type < TABLE_TYPES; type++) {
		struct binding_range range = binding->io[type];

		copy_out(binding, binding->out[when][type], type);
		for (uint16_t i = 0; i < range.count; i++, io++) {
			struct binding_range one = { (uint16_t)(range.first + i), 1 };

			if (value_bytes(binding, &binding->slot[one.first], type) !=
			    binding->seen[io])
				copy_out(binding, one, type);
		}
	}
}
