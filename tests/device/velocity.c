/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Velocity mode: an axis runs at the speed that is commanded, stands when
 * nothing good is commanded, and no packet that is lost or late leaves it
 * running. Bad commands are refused before the wire, in words that say why.
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

static void run_at(unsigned int axis, float velocity)
{
	world.command.axis[axis] = (struct pokeys_axis_command){
		.velocity = velocity,
		.mode = POKEYS_AXIS_VELOCITY,
		.enable = 1,
	};
}

/* pulses/s, as the simulated planner has it */
static double speed(unsigned int axis)
{
	sim_rig_run(&world.rig, world.now);
	return world.rig.device.engine.axis[axis].planner.speed * 1e3;
}

/* Axis 0 by speed, from this count on; 1 and 2 by position, 1 with soft limits. */
static void begin_at(int32_t count)
{
	struct pokeys_axis_settings *axis;

	world_init(&world, NULL);
	world.rig.device.engine.axis[0].pulses = count;
	world_axes(&world);
	world.config.settings.axis[0].options &= (uint8_t)~WIRE_AXIS_POSITION_MODE;
	axis = &world.config.settings.axis[1];
	axis->options |= WIRE_AXIS_SOFT_LIMITS;
	axis->options_mask |= WIRE_AXIS_SOFT_LIMITS;
	axis->set |= POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM;
	axis->soft_minimum = -1000;
	axis->soft_maximum = 1000;
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	run_at(0, 0);
	world_go(&world, 1, 0, 0);
	world_machine_on(&world);
}

static int begin(void **state)
{
	(void)state;
	begin_at(0);
	return 0;
}

/* A conveyor that has run for hours. */
static void a_count_that_wraps_is_no_loss(void **state)
{
	(void)state;
	begin_at(INT32_MAX - 3000);
	run_at(0, 10000);
	world_run(&world, 1 * SECOND);
	assert_true(world.state.engine.axis[0].position < 0);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

/* A program may use the count of an axis in velocity mode, too. */
static void a_count_set_elsewhere_is_a_loss(void **state)
{
	(void)state;
	run_at(0, 10000);
	world_run(&world, 100 * MS);
	world_set_elsewhere(&world, 1, 100000);
	world_run(&world, 100 * MS);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 1);
	assert_int_equal(world.state.engine.axis[0].position_epoch, 2);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

static void refused(enum command_fault fault, unsigned int axis)
{
	world_run(&world, 3 * MS);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, fault);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, axis);
}

static void axis_runs_at_the_commanded_speed(void **state)
{
	(void)state;
	assert_int_equal(world.state.engine.axis[0].mode, POKEYS_AXIS_VELOCITY);
	run_at(0, 5000);
	world_run(&world, 200 * MS);
	assert_true(fabs(speed(0) - 5000) < 1);
	assert_int_equal(world.state.engine.axis[0].reference, 5000);
	assert_false(world.state.engine.axis[0].in_position);
	run_at(0, -700);
	world_run(&world, 200 * MS);
	assert_true(fabs(speed(0) + 700) < 1);
	run_at(0, 0);
	world_run(&world, 200 * MS);
	assert_true(fabs(speed(0)) < 1e-9);
}

static void axes_in_position_mode_are_driven_beside_it(void **state)
{
	(void)state;
	run_at(0, 3000);
	world_go(&world, 1, 800, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 1), 800);
	assert_int_equal(world_pulses(&world, 2), 0);
	assert_true(fabs(speed(0) - 3000) < 1);
}

static void axis_stands_when_its_enable_falls(void **state)
{
	(void)state;
	run_at(0, 5000);
	world_run(&world, 100 * MS);
	world.command.axis[0].enable = 0;
	world_run(&world, 100 * MS);
	assert_true(fabs(speed(0)) < 1e-9);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

static void axis_stands_when_the_machine_goes_off_or_the_commander_dies(void **state)
{
	(void)state;
	run_at(0, 5000);
	world_run(&world, 100 * MS);
	world.command.flags = 0;
	world_run(&world, 100 * MS);
	assert_true(fabs(speed(0)) < 1e-9);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	assert_true(fabs(speed(0) - 5000) < 1);
	world.commanding = false;
	world_until(&world, world_is_safe, 400 * MS);
	assert_true(fabs(speed(0)) < 1e-9);
}

static void axis_stands_while_its_command_is_bad(void **state)
{
	const float bad[] = { NAN, INFINITY, -INFINITY, 20100, -20100 };

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		run_at(0, 5000);
		world_run(&world, 100 * MS);
		assert_true(fabs(speed(0) - 5000) < 1);
		run_at(0, bad[i]);
		world_run(&world, 200 * MS);
		assert_true(fabs(speed(0)) < 1e-9);
		assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	}
}

static void refusals_say_which_axis_and_why(void **state)
{
	(void)state;
	run_at(0, 25000);
	refused(COMMAND_FAULT_AXIS_SPEED, 0);
	run_at(0, 0);
	world_go(&world, 1, 1001, 0);
	refused(COMMAND_FAULT_AXIS_SOFT_LIMIT, 1);
	world_go(&world, 1, -1001, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 1), 0);
	world_go(&world, 1, 1000, 0);
	run_at(2, 0);
	refused(COMMAND_FAULT_AXIS_SETUP, 2);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 1), 1000);
}

/* Set down outside (it was homed there, say), it may come back but not go on. */
static void axis_outside_its_soft_limits_may_come_back(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 2,
		.value = { [1] = 1500 },
	};

	(void)state;
	world.command.flags = 0;
	world.command.axis[1].enable = 0;
	world_run(&world, 100 * MS);
	assert_int_equal(world_do(&world, &set, 500 * MS), POKEYS_OUTCOME_DONE);
	world_go(&world, 1, 1500, 0);
	world_machine_on(&world);
	world_go(&world, 1, 1501, 0);
	refused(COMMAND_FAULT_AXIS_SOFT_LIMIT, 1);
	world_go(&world, 1, 900, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 1), 900);
}

static uint8_t old[64];

static void keep_fast(struct world *w, const uint8_t *packet)
{
	struct wire_pulse_move_req move;

	(void)w;
	if (packet[1] != 0x85 || packet[2] != 0x20)
		return;
	wire_pulse_move_decode_req(packet, &move);
	if (move.reference[0] == 5000)
		memcpy(old, packet, sizeof(old));
}

/* The network kept an older packet back: the axis must not run on. */
static void speed_that_was_overtaken_is_corrected(void **state)
{
	(void)state;
	world.watch = keep_fast;
	run_at(0, 5000);
	world_run(&world, 100 * MS);
	world.watch = NULL;
	run_at(0, 0);
	world_run(&world, 100 * MS);
	sim_rig_send_from(&world.rig, world.now, 77, old, sizeof(old));
	world_run(&world, 50 * MS);
	assert_true(fabs(speed(0)) < 1e-9);
	assert_true(world.rig.device.bench.machine.axis[0].steps > 0);
}

static void loss_leaves_no_axis_running(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 0, 2 * MS, 0 },
		.loss = 0.05,
		.duplicate = 0.05,
		.reorder = 0.05,
		.reorder_ns = 3 * MS,
	};
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, world_seed());
	world_faults(&world, &faults);
	for (unsigned int i = 0; i < 300; i++) {
		run_at(0, (float)sim_prng_below(&prng, 20000) - 10000);
		world_run(&world, (1 + sim_prng_below(&prng, 60)) * MS);
		run_at(0, 0);
		world_run(&world, 150 * MS);
		assert_true(fabs(speed(0)) < 1e-9);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(axis_runs_at_the_commanded_speed, begin),
		cmocka_unit_test(a_count_that_wraps_is_no_loss),
		cmocka_unit_test_setup(a_count_set_elsewhere_is_a_loss, begin),
		cmocka_unit_test_setup(axes_in_position_mode_are_driven_beside_it, begin),
		cmocka_unit_test_setup(axis_stands_when_its_enable_falls, begin),
		cmocka_unit_test_setup(axis_stands_when_the_machine_goes_off_or_the_commander_dies,
				       begin),
		cmocka_unit_test_setup(axis_stands_while_its_command_is_bad, begin),
		cmocka_unit_test_setup(refusals_say_which_axis_and_why, begin),
		cmocka_unit_test_setup(axis_outside_its_soft_limits_may_come_back, begin),
		cmocka_unit_test_setup(speed_that_was_overtaken_is_corrected, begin),
		cmocka_unit_test_setup(loss_leaves_no_axis_running, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
