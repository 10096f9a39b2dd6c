/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The binding's way out: values to pins.
 *
 * What was written is kept as a second struct values; a piece of it that is as
 * it was spares all its pins at once, and most pieces are. In a piece that
 * differs only the pins whose value differs are touched. An I/O pin that has
 * the value already, because somebody set it there, is not; one that is written
 * is noted as seen, so that it is not taken for somebody's wish when it is read
 * again.
 */
#include <string.h>
#include "halbridge/cell.h"

_Static_assert((offsetof(struct values, changed) / BINDING_CHUNK + 1) * BINDING_CHUNK <=
		       sizeof(struct values),
	       "the last chunk ends in struct values");

/* Whether it has changed or not; an I/O pin is somebody else's then. */
static void scatter_slot(struct binding *binding, uint16_t i)
{
	const struct binding_slot *slot = &binding->slot[i];

	if (slot->twin == BINDING_NO_TWIN)
		cell_copy(binding->pointers[slot->pointer], cell_member(binding, slot), slot->type);
}

static uint64_t word(const unsigned char *at)
{
	uint64_t value;

	memcpy(&value, at, sizeof(value));
	return value;
}

/* Most chunks are as they were: this comparison is all that their pins cost. */
static bool is_same(const unsigned char *a, const unsigned char *b)
{
	return !((word(a) ^ word(b)) | (word(a + 8) ^ word(b + 8)) | (word(a + 16) ^ word(b + 16)) |
		 (word(a + 24) ^ word(b + 24)));
}

/* An I/O pin: not, if somebody set it to that himself. */
static void scatter_twin(struct binding *binding, const struct binding_slot *slot)
{
	uint64_t value = cell_load(cell_member(binding, slot), slot->type);

	if (value == cell_load(binding->shown + slot->offset, slot->type) ||
	    value == binding->seen[slot->twin])
		return;
	cell_store(binding->pointers[slot->pointer], slot->type, value);
	binding->seen[slot->twin] = value;
}

/* The pin of this slot, if its value is another one than was written last. */
#define SCATTER(type_, cell_)	do {							\
		type_ value = *(const type_ *)(values + slot->offset);			\
											\
		if (value != *(const type_ *)(binding->shown + slot->offset))		\
			*(cell_ *)binding->pointers[slot->pointer] = (cell_)value;	\
	} while (0)

static void scatter_word(struct binding *binding, size_t number)
{
	const unsigned char *values = (const unsigned char *)binding->values;
	const struct binding_slot *slot = &binding->slot[binding->word[number]];
	const struct binding_slot *end = &binding->slot[binding->word[number + 1]];

	for (; slot < end; slot++) {
		if (slot->twin != BINDING_NO_TWIN)
			scatter_twin(binding, slot);
		else if (slot->type == TABLE_BIT)
			SCATTER(uint8_t, pin_bit);
		else if (slot->type == TABLE_FLOAT)
			SCATTER(uint64_t, pin_float);
		else
			SCATTER(uint32_t, pin_word);
	}
}

static void scatter_chunk(struct binding *binding, size_t at)
{
	const unsigned char *values = (const unsigned char *)binding->values;

	for (size_t k = at; k < at + BINDING_CHUNK; k += BINDING_WORD) {
		if (word(values + k) == word(binding->shown + k))
			continue;
		scatter_word(binding, k / BINDING_WORD);
		memcpy(binding->shown + k, values + k, BINDING_WORD);
	}
}

static void scatter_block(struct binding *binding, unsigned int block)
{
	const unsigned char *values = (const unsigned char *)binding->values;
	const struct binding_run *run = &binding->run[binding->run_first[block]];
	const struct binding_run *end = &binding->run[binding->run_first[block + 1]];

	for (; run < end; run++) {
		for (size_t at = run->begin; at < run->end; at += BINDING_CHUNK) {
			if (!is_same(values + at, binding->shown + at))
				scatter_chunk(binding, at);
		}
	}
}

static void scatter_touched(struct binding *binding)
{
	for (unsigned int k = 0; k < VALUES_TOUCHED; k++) {
		uint64_t chunks = binding->values->touched[k];

		for (; chunks; chunks &= chunks - 1)
			scatter_chunk(binding, (64 * k + (unsigned int)__builtin_ctzll(chunks)) *
						       (size_t)BINDING_CHUNK);
		binding->values->touched[k] = 0;
	}
}

/* Somebody has set one: others of its member follow, or it is taken back at once. */
static void scatter_io(struct binding *binding)
{
	const struct binding_range range = binding->io.range;

	for (uint16_t i = range.first; i < range.first + range.count; i++) {
		const struct binding_slot *slot = &binding->slot[i];
		uint64_t value = cell_load(cell_member(binding, slot), slot->type);

		if (value == binding->seen[i])
			continue;
		binding->seen[i] = value;
		cell_store(binding->pointers[slot->pointer], slot->type, value);
	}
	binding->touched = false;
}

static void scatter_turn(struct binding *binding)
{
	const struct binding_range range = binding->out[TABLE_AT_READ];
	uint16_t next = binding->next_out;

	for (uint16_t count = binding->out_slice; count; count--) {
		scatter_slot(binding, (uint16_t)(range.first + next));
		if (++next == range.count)
			next = 0;
	}
	binding->next_out = next;
}

/* There are few of them: those that tell what became of the pins just read. */
static void scatter_written(struct binding *binding)
{
	const struct binding_range range = binding->out[TABLE_AT_WRITE];

	for (uint16_t i = range.first; i < range.first + range.count; i++)
		scatter_slot(binding, i);
}

void binding_scatter(struct binding *binding, enum table_when when)
{
	if (when == TABLE_AT_WRITE) {
		scatter_written(binding);
		return;
	}
	if (binding->touched)
		scatter_io(binding);
	for (uint32_t blocks = binding->values->changed & VALUES_ALL; blocks; blocks &= blocks - 1)
		scatter_block(binding, (unsigned int)__builtin_ctz(blocks));
	binding->values->changed = 0;
	scatter_touched(binding);
	scatter_turn(binding);
}

void binding_scatter_all(struct binding *binding)
{
	for (unsigned int when = 0; when < TABLE_WHENS; when++) {
		const struct binding_range range = binding->out[when];

		for (uint16_t i = range.first; i < range.first + range.count; i++)
			scatter_slot(binding, i);
	}
	memcpy(binding->shown, binding->values, sizeof(*binding->values));
}
