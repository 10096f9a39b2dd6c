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
#include "halbridge/cell.h"
#include "halbridge/layout.h"

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

/* A pin that counts when it has changed. */
static void follow_slot(struct binding *binding, uint16_t i)
{
	const struct binding_slot *slot = &binding->slot[i];
	uint64_t value = cell_load(binding->pointers[slot->pointer], slot->type);

	if (value == binding->seen[i])
		return;
	binding->seen[i] = value;
	cell_store(cell_member(binding, slot), slot->type, value);
	values_changed(binding->values, (enum values_block)slot->block);
	binding->touched = true;
}

static void list_slot(const struct binding *binding, struct binding_turns *turns, uint16_t i)
{
	const struct binding_slot *slot = &binding->slot[i];
	const unsigned int type = slot->type;

	if (!binding->linked[i] && !slot->always)
		return;
	if (slot->follows)
		turns->following[type][turns->following_count[type]++] = i;
	else
		turns->active[type][turns->active_count[type]++] =
			(struct binding_way){ slot->offset, slot->pointer };
}

static void list_active(const struct binding *binding, struct binding_turns *turns)
{
	const uint16_t first = turns->range.first;

	memset(turns->active_count, 0, sizeof(turns->active_count));
	memset(turns->following_count, 0, sizeof(turns->following_count));
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
		const uint16_t i = (uint16_t)(turns->range.first + turns->next);
		const struct binding_slot *slot = &binding->slot[i];
		void *pin = binding->pointers[slot->pointer];
		bool linked = pin != binding->own[slot->pointer];

		if (slot->follows)
			follow_slot(binding, i);
		else
			cell_copy(cell_member(binding, slot), pin, slot->type);
		another |= linked != binding->linked[i];
		binding->linked[i] = linked;
		if (++turns->next == turns->range.count)
			turns->next = 0;
	}
	if (another)
		list_active(binding, turns);
}

/* One loop per type; both sides are aligned, the table took the type from the member. */
#define GATHER(type_)	do {								\
		const struct binding_way *way = turns->active[type];			\
		const struct binding_way *end = way + turns->active_count[type];	\
											\
		for (; way < end; way++)						\
			*(type_ *)(values + way->offset) =				\
				*(type_ *)binding->pointers[way->pointer];		\
	} while (0)

static void gather_active(struct binding *binding, const struct binding_turns *turns,
			  unsigned int type)
{
	unsigned char *values = (unsigned char *)binding->values;

	if (type == TABLE_BIT)
		GATHER(pin_bit);
	else if (type == TABLE_FLOAT)
		GATHER(pin_float);
	else
		GATHER(pin_word);
}

#define FOLLOW(type_)	do {								\
		for (uint16_t k = 0; k < turns->following_count[type]; k++) {		\
			uint16_t i = turns->following[type][k];				\
											\
			if (*(type_ *)binding->pointers[binding->slot[i].pointer] !=	\
			    (type_)binding->seen[i])					\
				follow_slot(binding, i);				\
		}									\
	} while (0)

static void gather_following(struct binding *binding, const struct binding_turns *turns,
			     unsigned int type)
{
	if (type == TABLE_BIT)
		FOLLOW(pin_bit);
	else if (type == TABLE_FLOAT)
		FOLLOW(pin_float);
	else
		FOLLOW(pin_word);
}

static void gather(struct binding *binding, struct binding_turns *turns)
{
	gather_turn(binding, turns);
	for (unsigned int type = 0; type < TABLE_TYPES; type++) {
		gather_active(binding, turns, type);
		gather_following(binding, turns, type);
	}
}

void binding_gather(struct binding *binding, enum table_when when)
{
	gather(binding, &binding->in[when]);
	if (when == TABLE_AT_READ)
		gather(binding, &binding->io);
}
