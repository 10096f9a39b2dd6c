/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing by the device: alone and in groups, finished by the commander or by
 * itself, cancelled, tripped, out of time. Afterwards no axis jumps. What becomes of
 * the count is in homing_count.c, what happens at any lost packet in abort.c.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/home_rig.h"
#include "wire/packet.h"
#include "wire/pulse.h"

static void axis_is_homed_and_the_others_stay(void **state)
{
	const struct pokeys_one_shot shot = home(1, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_until(&world, is_idle, 500 * MS);
	assert_int_equal(world.state.engine.task, POKEYS_TASK_HOMING);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_DONE);
	assert_int_equal(world.state.engine.task_axes, 1);
	assert_int_equal(world.state.engine.task_count, 1);
	assert_int_equal(world.state.engine.axis[0].homed, 1);
	assert_int_equal(world.state.engine.axis[1].homed, 0);
	assert_in_range(world_pulses(&world, 0), 100, 160);
	assert_int_equal(world_pulses(&world, 1), 0);
	assert_int_equal(world.event_count[EVENT_TASK], 1);
}

/* Its place among the results is another's for a while, and a phase says that it goes on. */
static void how_it_ended_is_told_though_many_others_ended_before(void **state)
{
	const uint32_t id = world.command.one_shot_head;

	(void)state;
	start(1);
	for (unsigned int i = 0; i < POKEYS_ONE_SHOT_RESULTS; i++)
		assert_int_equal(act(POKEYS_ONE_SHOT_NOP), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.one_shot[id % POKEYS_ONE_SHOT_RESULTS].id,
			 id + POKEYS_ONE_SHOT_RESULTS);
	while (world_outcome(&world, id) == POKEYS_OUTCOME_NONE) {
		assert_int_not_equal(world.state.engine.task_phase, POKEYS_TASK_IDLE);
		world_cycle(&world);
	}
	assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_DONE);
}

/* The commander still points to where the axis was in the old coordinates. */
static void homed_axis_does_not_jump_back(void **state)
{
	int64_t homed;

	(void)state;
	start(1);
	world_until(&world, is_idle, 2 * SECOND);
	homed = world_pulses(&world, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), homed);
	assert_int_equal(world.state.engine.axis[0].parked, 1);
	assert_int_equal(world.state.engine.axis[1].enabled, 1);
	world_go(&world, 0, (int32_t)homed, 0);
	world_run(&world, 20 * MS);
	assert_int_equal(world.state.engine.axis[0].parked, 0);
	world_go(&world, 0, 2000, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 2000);
}

static void homed_axis_follows_after_its_enable_was_low(void **state)
{
	(void)state;
	start(1);
	world_until(&world, is_idle, 2 * SECOND);
	world_go(&world, 0, 1000, 0);
	world_run(&world, 100 * MS);
	assert_true(world_pulses(&world, 0) < 200);
	world.command.axis[0].enable = 0;
	world_run(&world, 3 * MS);
	world.command.axis[0].enable = 1;
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 1000);
}

static void group_is_homed_when_all_of_it_is(void **state)
{
	const struct pokeys_one_shot shot = home(5, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	world_go(&world, 2, 3000, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_do(&world, &shot, 3 * SECOND), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.axis[0].homed, 1);
	assert_int_equal(world.state.engine.axis[2].homed, 1);
	assert_int_equal(world.state.engine.axis[1].homed, 0);
	assert_int_equal(world.sent.pulse[0x21], 1);
}

static void half_a_group_is_not_homed(void **state)
{
	(void)state;
	world_go(&world, 2, 5000, 0);
	world_run(&world, 800 * MS);
	start(5);
	while (world.state.engine.axis[0].state != WIRE_AXIS_HOME)
		world_cycle(&world);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_CANCEL), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_CANCELLED);
	assert_int_equal(world.state.engine.axis[0].homed, 0);
	assert_int_equal(world.state.engine.axis[2].homed, 0);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_FAILED);
	/* that one counts from its home, which is none of the group's */
	world_run(&world, 100 * MS);
	assert_int_equal(world.state.engine.axis[0].position_epoch, 2);
}

static int begin_with_limits(void **state)
{
	(void)state;
	set_up(0, WIRE_SWITCH_LIMIT_N);
	return 0;
}

static void limit_of_one_stops_the_group(void **state)
{
	int64_t stopped[2];

	(void)state;
	wire_limit(2, INT32_MIN, -100);
	start(5);
	world_until(&world, is_idle, 2 * SECOND);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_TRIPPED);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_FAILED);
	assert_int_equal(world.state.engine.axis[0].homed | world.state.engine.axis[2].homed, 0);
	stopped[0] = world_pulses(&world, 0);
	stopped[1] = world_pulses(&world, 2);
	assert_true(llabs(stopped[0] - stopped[1]) <= 1);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), stopped[0]);
	assert_int_equal(world_pulses(&world, 2), stopped[1]);
}

/* It stands on its limit switch, beyond home: the override lets it home off there. */
static void group_is_homed_off_a_limit_switch(void **state)
{
	const struct pokeys_one_shot shot = home(5, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	world.command.flags |= POKEYS_COMMAND_LIMIT_OVERRIDE;
	world_run(&world, 50 * MS);
	wire_limit(2, -300, 300);
	assert_int_equal(world_do(&world, &shot, 3 * SECOND), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.axis[0].homed & world.state.engine.axis[2].homed, 1);
	world.command.flags &= ~(uint32_t)POKEYS_COMMAND_LIMIT_OVERRIDE;
	world_run(&world, 500 * MS);
	assert_int_equal(world.rig.device.engine.override, 0);
}

static void commander_may_finish_it(void **state)
{
	const struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_FINISH), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.engine.task_phase, POKEYS_TASK_COMPLETE);
	assert_int_equal(world.state.engine.axis[0].state, WIRE_AXIS_HOME);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_FINISH), POKEYS_OUTCOME_DONE);
	assert_true(is_idle(&world));
	assert_int_equal(world.sent.pulse[0x22], 1);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_FINISH), POKEYS_OUTCOME_DONE);
}

static void homing_that_nobody_finishes_finishes_itself(void **state)
{
	const struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_until(&world, is_idle, 12 * SECOND);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_DONE);
}

/* What homing configurations of LinuxCNC do after it. */
static void position_may_be_set_after_it(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { 4000 },
	};

	(void)state;
	start(1);
	world_until(&world, is_idle, 2 * SECOND);
	assert_int_equal(world_do(&world, &set, 500 * MS), POKEYS_OUTCOME_DONE);
	assert_int_equal(world_pulses(&world, 0), 4000);
}

static void cancelled_homing_stands(void **state)
{
	int64_t stopped;

	(void)state;
	start(1);
	world_run(&world, 20 * MS);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_CANCEL), POKEYS_OUTCOME_DONE);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
	stopped = world_pulses(&world, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), stopped);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_CANCELLED);
}

static void trip_ends_it_and_is_left_alone(void **state)
{
	(void)state;
	start(1);
	sim_bench_emergency(&world.rig.device, true);
	world_until(&world, is_idle, 100 * MS);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_TRIPPED);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_FAILED);
	world_run(&world, 500 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOP_EMERGENCY);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

/* The switch is broken. */
static void time_limit_ends_it(void **state)
{
	struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	shot.parameter[0] = 0.5f;
	world.rig.device.bench.machine.axis[0].home.wired = false;
	sim_machine_rewired(&world.rig.device.bench.machine);
	world.rig.device.bench.machine.raw_home = 0;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_FAILED);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_TIMED_OUT);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
}

static void link_that_is_lost_ends_it_and_nothing_is_replayed(void **state)
{
	int64_t stopped;

	(void)state;
	world.rig.device.bench.machine.axis[0].home.wired = false;
	start(1);
	sim_rig_silence(&world.rig, world.now, 400 * MS);
	world_until(&world, world_is_lost, 400 * MS);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_LOST);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_UNKNOWN);
	world_until(&world, world_is_running, 1 * SECOND);
	world_run(&world, 300 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	stopped = world_pulses(&world, 0);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world_pulses(&world, 0), stopped);
}

static void outputs_that_are_enabled_one_by_one_are_on_while_homing(void **state)
{
	(void)state;
	set_up(WIRE_AXIS_ENABLED_MASKED, 0);
	world.command.axis[0].enable = 0;
	world_run(&world, 50 * MS);
	assert_false(sim_axis_powered(&world.rig.device, 0));
	start(1);
	assert_true(sim_axis_powered(&world.rig.device, 0));
	world_until(&world, is_idle, 2 * SECOND);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_DONE);
	world_run(&world, 50 * MS);
	assert_false(sim_axis_powered(&world.rig.device, 0));
}

/* It would go on until its time limit. */
static void axis_without_a_home_switch_is_refused(void **state)
{
	struct pokeys_one_shot shot = home(2, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	set_up_without(0, 0, 2);
	world_refuses(&world, &shot, REFUSAL_NO_HOME_SWITCH, 1);
	shot.mask = 3;
	world_refuses(&world, &shot, REFUSAL_NO_HOME_SWITCH, 1);
	shot.mask = 1;
	assert_int_equal(world_do(&world, &shot, 20 * SECOND), POKEYS_OUTCOME_DONE);
}

static void what_is_not_valid_is_refused(void **state)
{
	const float bad[] = { NAN, INFINITY, -1, 4000 };
	struct pokeys_one_shot shot = home(0, 0);

	(void)state;
	world_refuses(&world, &shot, REFUSAL_NO_AXIS, 0);
	shot.mask = 0x11; /* axis 4 is not set up */
	world_refuses(&world, &shot, REFUSAL_AXIS_OFF, 4);
	shot = home(1, 0);
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		shot.parameter[0] = bad[i];
		world_refuses(&world, &shot, REFUSAL_VALUE, 0);
	}
	shot = home(1, 0);
	shot.value[0] = 1 << 25;
	world_refuses(&world, &shot, REFUSAL_POSITION, 0);
	start(2);
	shot = home(1, 0); /* one at a time */
	world_refuses(&world, &shot, REFUSAL_BUSY, 0);
	world.command.flags = 0;
	world_run(&world, 200 * MS);
	world_refuses(&world, &shot, REFUSAL_MACHINE_OFF, 0);
	assert_int_equal(world.sent.pulse[0x21], 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(axis_is_homed_and_the_others_stay, begin),
		cmocka_unit_test_setup(how_it_ended_is_told_though_many_others_ended_before, begin),
		cmocka_unit_test_setup(homed_axis_does_not_jump_back, begin),
		cmocka_unit_test_setup(homed_axis_follows_after_its_enable_was_low, begin),
		cmocka_unit_test_setup(group_is_homed_when_all_of_it_is, begin),
		cmocka_unit_test_setup(half_a_group_is_not_homed, begin),
		cmocka_unit_test_setup(limit_of_one_stops_the_group, begin_with_limits),
		cmocka_unit_test_setup(group_is_homed_off_a_limit_switch, begin_with_limits),
		cmocka_unit_test_setup(commander_may_finish_it, begin),
		cmocka_unit_test_setup(homing_that_nobody_finishes_finishes_itself, begin),
		cmocka_unit_test_setup(position_may_be_set_after_it, begin),
		cmocka_unit_test_setup(cancelled_homing_stands, begin),
		cmocka_unit_test_setup(trip_ends_it_and_is_left_alone, begin),
		cmocka_unit_test_setup(time_limit_ends_it, begin),
		cmocka_unit_test_setup(link_that_is_lost_ends_it_and_nothing_is_replayed, begin),
		cmocka_unit_test(outputs_that_are_enabled_one_by_one_are_on_while_homing),
		cmocka_unit_test(axis_without_a_home_switch_is_refused),
		cmocka_unit_test_setup(what_is_not_valid_is_refused, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
