/* SPDX-License-Identifier: MIT */
/*
 * A command image into its cell in shared memory.
 *
 * Seven of eight bytes of it are the ring of one-shots, and hardly ever is there a new
 * one. A one-shot that was queued is not changed any more, and nobody else writes into
 * the cell, so what the cell has of this session stays: only what was queued since then
 * is copied.
 */
#ifndef SHM_COMMAND_CELL_H
#define SHM_COMMAND_CELL_H

#include <stddef.h>
#include <string.h>
#include <pokeys/command.h>

/* How many of the newest one-shots the cell has not yet. */
static inline uint32_t command_cell_new(const struct pokeys_command *cell,
					const struct pokeys_command *command)
{
	uint32_t more = command->one_shot_head - cell->one_shot_head;

	if (cell->hash != POKEYS_COMMAND_HASH || cell->session != command->session ||
	    more > POKEYS_ONE_SHOTS)
		return POKEYS_ONE_SHOTS;
	return more;
}

/* The cell holds what this commander wrote into it last, or anything at all. Realtime. */
static inline void command_cell_fill(struct pokeys_command *cell,
				     const struct pokeys_command *command)
{
	uint32_t more = command_cell_new(cell, command);

	memcpy(cell, command, offsetof(struct pokeys_command, one_shot));
	cell->magic = POKEYS_COMMAND_MAGIC;
	cell->version = POKEYS_COMMAND_VERSION;
	cell->size_units = sizeof(*cell) / 8;
	cell->hash = POKEYS_COMMAND_HASH;
	for (; more; more--) {
		uint32_t slot = (command->one_shot_head - more) % POKEYS_ONE_SHOTS;

		cell->one_shot[slot] = command->one_shot[slot];
	}
}

#endif
