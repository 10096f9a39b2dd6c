/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Copying by table instead of by hand, and as little as possible.
 *
 * HAL gives a pin as a pointer that it moves when the pin is linked, so a
 * value goes through one pointer and one offset. Pins lie one or two cache
 * lines apart in HAL's memory: with some three thousand of them, touching each
 * costs more than everything else, though hardly any is used.
 *
 * An IN pin that is not linked changes only by somebody's setp, so outputs and
 * lamps that are not linked get their turn every few periods. Linked pins are
 * read always, and so are those that control something, where a script's short
 * pulse must be seen. Which are linked shows in their pointers, and those are
 * looked at in turn as well.
 *
 * OUT pins are written when their block is marked and their value is another
 * one. Linking a pin to a signal that others use already gives the signal's old
 * value to it, so all pins are also written in turn, changed or not: nothing
 * stays wrong for longer than the turns take.
 *
 * I/O pins, and IN pins that share their member with another pin (two names of
 * one thing), count when they have changed: either may be linked or set, and
 * the other one, which stays at what it was, has no say.
 */
#include "halbridge/binding.h"
#include <errno.h>
#include <string.h>
#include "halbridge/layout.h"

/* HAL's view of the same bytes. */
typedef volatile bool pin_bit;
typedef volatile uint64_t pin_float;
typedef volatile uint32_t pin_word;

int binding_init(struct binding *binding, struct values *values, void *volatile *pointers,
		 unsigned int schemes)
{
	memset(binding, 0, sizeof(*binding));
	binding->values = values;
	binding->pointers = pointers;
	binding->in_turns = BINDING_TURNS;
	return layout_slots(binding, schemes);
}

void binding_exported(struct binding *binding)
{
	for (size_t i = 0; i < binding->pins; i++)
		binding->own[i] = binding->pointers[i];
}

_Static_assert((offsetof(struct values, changed) / BINDING_CHUNK + 1) * BINDING_CHUNK <=
	       sizeof(struct values), "the last chunk ends in struct values");

static uint64_t load(const void *at, unsigned int type)
{
	if (type == TABLE_BIT)
		return *(const pin_bit *)at;
	return type == TABLE_FLOAT ? *(const pin_float *)at : *(const pin_word *)at;
}

static void store(void *at, unsigned int type, uint64_t value)
{
	if (type == TABLE_BIT)
		*(pin_bit *)at = value != 0;
	else if (type == TABLE_FLOAT)
		*(pin_float *)at = value;
	else
		*(pin_word *)at = (uint32_t)value;
}

static void *member(const struct binding *binding, const struct binding_slot *slot)
{
	return (unsigned char *)binding->values + slot->offset;
}

static void gather_slot(struct binding *binding, uint16_t i)
{
	const struct binding_slot *slot = &binding->slot[i];
	uint64_t value = load(binding->pointers[slot->pointer], slot->type);

	if (slot->follows && value == binding->seen[i])
		return;
	binding->seen[i] = value;
	store(member(binding, slot), slot->type, value);
	if (slot->follows)	/* an I/O pin says so itself already */
		store(binding->shown + slot->offset, slot->type, value);
}

static void list_slot(const struct binding *binding, struct binding_turns *turns, uint16_t i)
{
	const struct binding_slot *slot = &binding->slot[i];

	if (!binding->linked[i] && !slot->always)
		return;
	if (slot->follows)
		turns->following[turns->following_count++] = i;
	else
		turns->active[slot->type][turns->active_count[slot->type]++] =
			(struct binding_way){ slot->offset, slot->pointer };
}

static void list_active(const struct binding *binding, struct binding_turns *turns)
{
	const uint16_t first = turns->range.first;

	memset(turns->active_count, 0, sizeof(turns->active_count));
	turns->following_count = 0;
	for (uint16_t i = first; i < first + turns->range.count; i++)
		list_slot(binding, turns, i);
}

/* Those whose turn it is (at first, all): their value, and whether they are linked now. */
static void gather_turn(struct binding *binding, struct binding_turns *turns)
{
	uint16_t count = turns->range.count;
	bool another = false;

	if (turns->begun)
		count = (uint16_t)((count + binding->in_turns - 1) / binding->in_turns);
	else
		list_active(binding, turns);
	turns->begun = true;
	for (; count; count--) {
		uint16_t i = (uint16_t)(turns->range.first + turns->next);
		uint16_t pin = binding->slot[i].pointer;
		bool linked = binding->pointers[pin] != binding->own[pin];

		gather_slot(binding, i);
		another |= linked != binding->linked[i];
		binding->linked[i] = linked;
		turns->next = (uint16_t)(turns->next + 1);
		if (turns->next == turns->range.count)
			turns->next = 0;
	}
	if (another)
		list_active(binding, turns);
}

/* One loop per type; both sides are aligned, the table took the type from the member. */
#define GATHER(type_)	do {								\
	for (; way < end; way++)							\
		*(type_ *)(values + way->offset) = *(type_ *)binding->pointers[way->pointer];	\
	} while (0)

static void gather_active(struct binding *binding, const struct binding_turns *turns)
{
	unsigned char *values = (unsigned char *)binding->values;

	for (unsigned int type = 0; type < TABLE_TYPES; type++) {
		const struct binding_way *way = turns->active[type];
		const struct binding_way *end = way + turns->active_count[type];

		if (type == TABLE_BIT)
			GATHER(pin_bit);
		else if (type == TABLE_FLOAT)
			GATHER(pin_float);
		else
			GATHER(pin_word);
	}
	for (uint16_t i = 0; i < turns->following_count; i++)
		gather_slot(binding, turns->following[i]);
}

void binding_gather(struct binding *binding, enum table_when when)
{
	gather_turn(binding, &binding->in[when]);
	gather_active(binding, &binding->in[when]);
	if (when == TABLE_AT_WRITE)
		return;
	gather_turn(binding, &binding->io);
	gather_active(binding, &binding->io);
}

static void write_pin(struct binding *binding, const struct binding_slot *slot, uint64_t value)
{
	store(binding->pointers[slot->pointer], slot->type, value);
	if (slot->twin != BINDING_NO_TWIN)
		binding->seen[slot->twin] = value;
}

/* Whether it has changed or not; an I/O pin is somebody else's then. */
static void scatter_slot(struct binding *binding, uint16_t i)
{
	const struct binding_slot *slot = &binding->slot[i];

	if (slot->twin == BINDING_NO_TWIN)
		write_pin(binding, slot, load(member(binding, slot), slot->type));
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
	return !((word(a) ^ word(b)) | (word(a + 8) ^ word(b + 8)) |
		 (word(a + 16) ^ word(b + 16)) | (word(a + 24) ^ word(b + 24)));
}

static void scatter_word(struct binding *binding, size_t number)
{
	const unsigned char *values = (const unsigned char *)binding->values;
	const unsigned char *shown = binding->shown;
	const uint16_t end = binding->word[number + 1];

	for (uint16_t i = binding->word[number]; i < end; i++) {
		const struct binding_slot *slot = &binding->slot[i];
		uint64_t value = load(values + slot->offset, slot->type);

		if (value != load(shown + slot->offset, slot->type))
			write_pin(binding, slot, value);
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

static void scatter_block(struct binding *binding, enum values_block block)
{
	const unsigned char *values = (const unsigned char *)binding->values;
	const size_t end = values_block_end(block), words = BINDING_CHUNK / BINDING_WORD;
	size_t at = values_block_begin(block) / BINDING_CHUNK * BINDING_CHUNK;

	for (; at < end; at += BINDING_CHUNK) {
		const uint16_t *first = &binding->word[at / BINDING_WORD];

		if (first[0] != first[words] && !is_same(values + at, binding->shown + at))
			scatter_chunk(binding, at);
	}
}

static void scatter_turn(struct binding *binding)
{
	const struct binding_range range = binding->out[TABLE_AT_READ];

	for (uint16_t count = binding->out_slice; count; count--) {
		scatter_slot(binding, (uint16_t)(range.first + binding->next_out));
		binding->next_out = (uint16_t)(binding->next_out + 1);
		if (binding->next_out == range.count)
			binding->next_out = 0;
	}
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
	for (uint32_t blocks = binding->values->changed & VALUES_ALL; blocks; blocks &= blocks - 1)
		scatter_block(binding, (enum values_block)__builtin_ctz(blocks));
	binding->values->changed = 0;
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
