/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Of the ring of one-shots only what is new is copied, and yet each cell has all that the
 * daemon may look for, however cells and sessions alternate.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "shm/command_cell.h"
#include "tests/shm/folder.h"

enum { ROUNDS = 20000, CELLS = 2 };

static struct pokeys_command cell[CELLS], command;

static void begin(uint32_t session)
{
	memset(&command, 0, sizeof(command));
	command.session = session;
}

static void queue(unsigned int count)
{
	for (; count; count--) {
		struct pokeys_one_shot *shot =
			&command.one_shot[command.one_shot_head % POKEYS_ONE_SHOTS];

		shot->id = command.one_shot_head++;
		shot->value[7] = rand();
		shot->operation = (uint8_t)rand();
	}
}

/* The same, but for what marks it as an image. */
static void assert_whole(const struct pokeys_command *got)
{
	struct pokeys_command wanted = command;

	wanted.magic = POKEYS_COMMAND_MAGIC;
	wanted.version = POKEYS_COMMAND_VERSION;
	wanted.size_units = sizeof(wanted) / 8;
	wanted.hash = POKEYS_COMMAND_HASH;
	assert_memory_equal(got, &wanted, sizeof(wanted));
}

static void each_cell_is_whole_whatever_was_queued(void **state)
{
	(void)state;
	srand(folder_seed());
	memset(cell, 0xa5, sizeof(cell));
	begin(1);
	for (unsigned int round = 0; round < ROUNDS; round++) {
		struct pokeys_command *to = &cell[rand() % CELLS];

		command.heartbeat++;
		command.t_ns = (uint64_t)rand();
		queue(rand() % 3 ? 0 : (unsigned int)rand() % (rand() % 50 ? 3 : 140));
		if (rand() % 100 == 0)
			begin(command.session + 1);
		command_cell_fill(to, &command);
		assert_whole(to);
	}
}

static void an_empty_or_foreign_cell_is_filled_whole(void **state)
{
	(void)state;
	begin(7);
	queue(5);
	memset(cell, 0, sizeof(cell));
	cell[0].session = 7;
	cell[0].one_shot_head = 5; /* but it is not one of ours */
	command_cell_fill(&cell[0], &command);
	assert_whole(&cell[0]);
	cell[1] = cell[0];
	cell[1].session = 6;
	memset(cell[1].one_shot, 0x5a, sizeof(cell[1].one_shot));
	command_cell_fill(&cell[1], &command);
	assert_whole(&cell[1]);
}

static void without_a_new_one_the_ring_is_not_touched(void **state)
{
	(void)state;
	begin(3);
	queue(9);
	command_cell_fill(&cell[0], &command);
	memset(&cell[0].one_shot[9], 0x77, sizeof(cell[0].one_shot[9]));
	command.heartbeat++;
	command_cell_fill(&cell[0], &command);
	assert_int_equal(cell[0].heartbeat, command.heartbeat);
	assert_int_equal(cell[0].one_shot[9].index, 0x77);
	queue(1);
	command_cell_fill(&cell[0], &command);
	assert_whole(&cell[0]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_cell_is_whole_whatever_was_queued),
		cmocka_unit_test(an_empty_or_foreign_cell_is_filled_whole),
		cmocka_unit_test(without_a_new_one_the_ring_is_not_touched),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
