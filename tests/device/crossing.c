/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What crosses: an answer that comes when nobody waits for it any more, a
 * command that changes while its predecessor is under way, a good wish beside
 * a bad value. None of them may move an axis or tell a commander a lie.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

static struct world world;
static unsigned int runs;

static void one_way(enum sim_link_dir dir, double loss, uint64_t delay_ns)
{
	const struct sim_link_faults faults = { .delay = { .low_ns = delay_ns }, .loss = loss };

	sim_link_set_faults(&world.rig.link, dir, &faults);
}

static int32_t steps(unsigned int axis)
{
	sim_rig_run(&world.rig, world.now);
	return (int32_t)world.rig.device.bench.machine.axis[axis].steps;
}

static int begin(void **state)
{
	(void)state;
	world_up(&world, NULL);
	world_run(&world, 100 * MS);
	return 0;
}

static int begin_moving(void **state)
{
	begin(state);
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	return 0;
}

/* The first one's answer is under way when the commander starts anew. */
static void answer_to_an_aborted_one_shot_ends_no_other(void **state)
{
	const struct pokeys_one_shot clock = {
		.operation = POKEYS_ONE_SHOT_SET_RTC,
		.value = { 2026, 1, 1, 0, 0, 0, 0, 0 },
	};
	const struct pokeys_one_shot counters = { .operation = POKEYS_ONE_SHOT_RESET_COUNTERS };

	(void)state;
	one_way(SIM_LINK_REPLY, 0, 20 * MS);
	world_one_shot(&world, &clock);
	world_run(&world, 2 * MS);
	one_way(SIM_LINK_REQUEST, 1, 25 * US);
	world_commander(&world, 6);
	world_run(&world, 2 * MS);
	assert_int_equal(world.state.one_shot_session, 6);
	assert_int_equal(world_do(&world, &counters, 200 * MS), POKEYS_OUTCOME_UNKNOWN);
}

static void count_runs(struct world *w, const uint8_t *packet)
{
	(void)w;
	runs += packet[1] == 0x85 && packet[2] == 0x02 && packet[3] == WIRE_ENGINE_RUNNING;
}

/* The answer to "run" got lost, and now the engine is to stand. */
static void run_is_not_repeated_after_machine_off(void **state)
{
	(void)state;
	world_go(&world, 0, 100000, 0);
	world_run(&world, 200 * MS);
	one_way(SIM_LINK_REPLY, 1, 25 * US);
	world.command.flags |= POKEYS_COMMAND_LIMIT_OVERRIDE;
	world_cycle(&world);
	world.command.flags = 0;
	world_cycle(&world);
	runs = 0;
	world.watch = count_runs;
	world_run(&world, 150 * MS);
	assert_int_equal(runs, 0);
}

/* No axis is ever told to go anywhere but to zero. */
static void only_to_zero(struct world *w, const uint8_t *packet)
{
	(void)w;
	if (packet[1] == 0x85 && packet[2] == 0x25)
		assert_int_equal(wire_get_u32(packet + 8), 0);
}

/* Whether the axis left its place while machine-on followed the setting at once. */
static void position_set_and_machine_on(unsigned int lost_replies)
{
	const struct pokeys_one_shot zero = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
	};
	uint32_t id;
	int32_t place;

	world_go(&world, 0, 5000, 0);
	world_run(&world, 1 * SECOND);
	world.command.flags = 0;
	world.command.axis[0].enable = 0;
	world_run(&world, 100 * MS);
	place = steps(0);
	assert_int_equal(place, 5000);
	one_way(SIM_LINK_REPLY, lost_replies ? 1 : 0, 25 * US);
	id = world_one_shot(&world, &zero);
	world_cycle(&world);
	world.watch = only_to_zero;
	world_go(&world, 0, 0, 0);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	for (unsigned int i = 0; i < 500; i++) {
		if (i == lost_replies)
			one_way(SIM_LINK_REPLY, 0, 25 * US);
		world_cycle(&world);
		assert_int_equal(steps(0), place);
	}
	assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.state, WIRE_ENGINE_RUNNING);
	assert_int_equal(world.state.engine.axis[0].position, 0);
}

static void position_can_be_set_after_a_move_and_machine_off(void **state)
{
	const struct pokeys_one_shot zero = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
	};

	(void)state;
	world_go(&world, 0, 5000, 0);
	world_run(&world, 1 * SECOND);
	world.command.flags = 0;
	world_run(&world, 100 * MS);
	assert_int_equal(world_do(&world, &zero, 500 * MS), POKEYS_OUTCOME_DONE);
}

static void machine_on_right_after_a_position_was_set_moves_nothing(void **state)
{
	(void)state;
	position_set_and_machine_on(0);
}

static void machine_on_before_the_position_is_known_to_be_set_moves_nothing(void **state)
{
	(void)state;
	position_set_and_machine_on(20);
}

static void axis_with_a_bad_value_can_be_disabled(void **state)
{
	int32_t place;

	(void)state;
	world_go(&world, 0, 100000, 0);
	world_run(&world, 200 * MS);
	world_go(&world, 0, 100000, NAN);
	world.command.axis[0].enable = 0;
	world_run(&world, 200 * MS);
	assert_int_equal(world.state.engine.axis[0].enabled, 0);
	place = steps(0);
	world_run(&world, 200 * MS);
	assert_int_equal(steps(0), place);
}

static void machine_off_is_heard_beside_unknown_flags(void **state)
{
	(void)state;
	world.command.flags = UINT32_C(1) << 20;
	world_run(&world, 100 * MS);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_int_equal(world.state.engine.state, WIRE_ENGINE_STOPPED);
	world.command.flags = UINT32_C(1) << 20 | POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 100 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

/* Flash is written, its answer was lost: silence is no loss for a while. */
static void motion_does_not_survive_an_outage_after_a_save(void **state)
{
	const struct pokeys_one_shot save = { .operation = POKEYS_ONE_SHOT_SAVE_CONFIG };
	int32_t place;

	(void)state;
	one_way(SIM_LINK_REPLY, 1, 25 * US);
	world_one_shot(&world, &save);
	world_run(&world, 2 * MS);
	one_way(SIM_LINK_REPLY, 0, 25 * US);
	world_run(&world, 100 * MS);
	world_go(&world, 0, 100000, 0);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 200 * MS);
	sim_rig_silence(&world.rig, world.now, 1500 * MS);
	world_run(&world, 1500 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	place = steps(0);
	world_run(&world, 500 * MS);
	assert_int_equal(steps(0), place);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(answer_to_an_aborted_one_shot_ends_no_other, begin),
		cmocka_unit_test_setup(run_is_not_repeated_after_machine_off, begin_moving),
		cmocka_unit_test_setup(position_can_be_set_after_a_move_and_machine_off,
				       begin_moving),
		cmocka_unit_test_setup(machine_on_right_after_a_position_was_set_moves_nothing,
				       begin_moving),
		cmocka_unit_test_setup(
			machine_on_before_the_position_is_known_to_be_set_moves_nothing,
			begin_moving),
		cmocka_unit_test_setup(axis_with_a_bad_value_can_be_disabled, begin_moving),
		cmocka_unit_test_setup(machine_off_is_heard_beside_unknown_flags, begin_moving),
		cmocka_unit_test_setup(motion_does_not_survive_an_outage_after_a_save, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
