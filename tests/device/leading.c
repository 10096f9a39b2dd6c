/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * References lead a position that moves on by the way that the axis needs to brake, and by
 * no more.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

static struct world world;

static int begin(void **state)
{
	(void)state;
	world_moving(&world, NULL);
	return 0;
}

static int begin_with_soft_limits(void **state)
{
	struct pokeys_axis_settings *axis = &world.config.settings.axis[0];

	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	axis->options |= WIRE_AXIS_SOFT_LIMITS;
	axis->options_mask |= WIRE_AXIS_SOFT_LIMITS;
	axis->set |= POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM;
	axis->soft_minimum = -500;
	axis->soft_maximum = 3000;
	world_all_moving(&world);
	return 0;
}

/*
 * As LinuxCNC does: a position in each period, and the speed of it (`said` times that is
 * commanded with it). Returns how far the axis is ahead at most; *behind: at constant speed,
 * and *rest: when the position has stopped.
 */
static double follow(double braking, double said, double *behind, double *rest)
{
	const double highest = 15000, period = 0.001;
	double position = 0, speed = 0, ahead = 0;

	for (unsigned int i = 0; i < 1000; i++) {
		speed += i < 200 ? braking * period : -braking * period;
		speed = fmin(fmax(speed, 0), highest);
		position += speed * period;
		world_go(&world, 0, (int32_t)lrint(position), (float)(said * speed));
		world_cycle(&world);
		ahead = fmax(ahead, (double)world_pulses(&world, 0) - position);
		if (i == 199)
			*behind = position - (double)world_pulses(&world, 0);
		if (i > 200 && speed == 0)
			break;
	}
	*rest = position - (double)world_pulses(&world, 0);
	world_run(&world, 100 * MS);
	assert_int_equal(world_pulses(&world, 0), lrint(position));
	return ahead;
}

/* A quarter of what the device could, and nearly all of it. The way to brake is 225 pulses. */
static void position_is_followed_at_its_own_speed(void **state)
{
	const double brakings[] = { 125000, 450000 };
	double behind, rest;

	(void)state;
	for (unsigned int i = 0; i < 2; i++) {
		assert_true(follow(brakings[i], 1, &behind, &rest) < 8);
		assert_true(behind >= 0 && behind < 45);
		assert_true(fabs(rest) < 45);
		world_go(&world, 0, 0, 0);
		world_run(&world, 2 * SECOND);
	}
}

/* If no velocity is commanded, or only a limit, the speed is computed from the positions. */
static void velocity_beside_the_position_need_not_be_its_own(void **state)
{
	const double said[] = { 0, 1.2, 1.45, 5 };
	double behind, rest;

	(void)state;
	for (unsigned int i = 0; i < 4; i++) {
		assert_true(follow(125000, said[i], &behind, &rest) < 8);
		assert_true(behind >= 0 && behind < 45);
		assert_true(fabs(rest) < 45);
		world_go(&world, 0, 0, 0);
		world_run(&world, 2 * SECOND);
	}
}

/* As from a commander that steps, and for a position that swings by less than it moves. */
static void position_that_jumps_is_not_led(void **state)
{
	(void)state;
	for (int32_t i = 1; i <= 20; i++) {
		world_go(&world, 0, i * 400, 20000);
		for (unsigned int ms = 0; ms < 25; ms++) {
			world_cycle(&world);
			assert_true(world.state.engine.axis[0].reference <= i * 400);
		}
	}
	for (int32_t i = 0; i < 100; i++) {
		world_go(&world, 0, 8000 + (i & 1) * 20, 20000);
		world_cycle(&world);
		assert_true(world.state.engine.axis[0].reference <= 8020);
	}
}

/* Two steps that follow each other closely are no speed either, nor is one each few images. */
static void position_that_moves_by_steps_is_not_led(void **state)
{
	int32_t position = 0;

	(void)state;
	for (int32_t apart = 5; apart < 12; apart++) {
		for (unsigned int i = 0; i < 100; i++) {
			position += i % (unsigned int)apart ? 0 : 200;
			world_go(&world, 0, position, 0);
			world_cycle(&world);
			assert_true(world.state.engine.axis[0].reference <= position);
		}
		world_run(&world, 500 * MS);
	}
}

/* The position moves by 15 pulses/ms, in images that come every 4 ms. */
static void images_need_not_come_in_each_cycle(void **state)
{
	const struct pokeys_axis *axis = &world.state.engine.axis[0];

	(void)state;
	world.command.period_ns = 4 * MS;
	for (int32_t i = 1; i <= 400; i++) {
		world.commanding = i % 4 == 0;
		if (world.commanding)
			world_go(&world, 0, i * 15, 15000);
		world_cycle(&world);
		if (i > 100)
			assert_in_range(axis->reference - i / 4 * 4 * 15, 223, 226);
	}
}

/*
 * Its commander is late by 60 ms, and goes on from where it was: the axis waits for it at the
 * reference, and does not go back.
 */
static void axis_waits_for_a_late_commander(void **state)
{
	int64_t before = 0;

	(void)state;
	world.config.heartbeat_timeout_ns = 1 * SECOND;
	world_all_moving(&world);
	world.command.period_ns = MS;
	for (int32_t i = 1; i <= 600; i++) {
		world_go(&world, 0, i * 15, 15000);
		if (i == 300) {
			world.commanding = false;
			world_run(&world, 60 * MS);
			world.commanding = true;
			assert_in_range(world_pulses(&world, 0), 4500 - 15, 4500 + 225);
		}
		world_cycle(&world);
		assert_true(world_pulses(&world, 0) >= before);
		before = world_pulses(&world, 0);
	}
	assert_in_range(before, 9000 - 45, 9000);
}

/* An axis that is far behind can stop at its position, so that is where it is sent. */
static void axis_that_is_far_behind_is_not_led(void **state)
{
	const struct pokeys_axis *axis = &world.state.engine.axis[0];

	(void)state;
	for (int32_t i = 1; i <= 200; i++) { /* three times as fast as it can go */
		world_go(&world, 0, i * 60, 60000);
		world_cycle(&world);
		assert_true(axis->reference - i * 60 <= 400);
		if (i > 60)
			assert_int_equal(axis->reference, i * 60);
	}
}

/* It catches up after its commander has gone, and goes no further than it was commanded. */
static void axis_that_catches_up_ends_at_the_position(void **state)
{
	(void)state;
	for (int32_t i = 1; i <= 200; i++) {
		world_go(&world, 0, i * 30, 30000);
		world_cycle(&world);
	}
	world.commanding = false;
	world_run(&world, 90 * MS);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_int_equal(world.state.engine.axis[0].reference, 6000);
	world_run(&world, 500 * MS);
	assert_true(world_pulses(&world, 0) <= 6000);
}

/* It says that it writes each millisecond, and does so each four. */
static void what_a_commander_says_of_its_period_is_looked_at(void **state)
{
	const struct pokeys_axis *axis = &world.state.engine.axis[0];

	(void)state;
	world.command.period_ns = MS;
	for (int32_t i = 1; i <= 400; i++) {
		world.commanding = i % 4 == 0;
		if (world.commanding)
			world_go(&world, 0, i * 15, 0);
		world_cycle(&world);
		assert_true(axis->reference - i / 4 * 4 * 15 <= 226);
	}
}

/* This computer stands still for some images: the reference goes on from where it was. */
static void a_pause_of_the_daemon_ends_no_lead(void **state)
{
	const struct pokeys_axis *axis = &world.state.engine.axis[0];
	int32_t before = 0;

	(void)state;
	world.command.period_ns = MS;
	for (int32_t i = 1; i <= 460; i++) {
		if (i % 100 == 0) {
			world_stall(&world, (uint64_t)(i / 50) * MS);
			i += i / 50;
		}
		world_go(&world, 0, i * 15, 15000);
		world_cycle(&world);
		assert_true(axis->reference >= before);
		before = axis->reference;
		if (i > 99)
			assert_in_range(before - i * 15, 200, 226);
	}
}

/* The last good position is where it stays. */
static void axis_that_is_refused_goes_to_its_last_position(void **state)
{
	(void)state;
	for (int32_t i = 1; i <= 100; i++) {
		world_go(&world, 0, i * 15, 15000);
		world_cycle(&world);
	}
	world_go(&world, 0, 1515, NAN);
	world_run(&world, 200 * MS);
	assert_int_equal(world_pulses(&world, 0), 1500);
	assert_int_equal(world.state.engine.axis[0].reference, 1500);
}

/* The commander of a disabled axis follows its position. These changes are not a command. */
static void what_was_before_it_was_enabled_does_not_count(void **state)
{
	const struct pokeys_axis *axis = &world.state.engine.axis[0];

	(void)state;
	for (int32_t i = 1; i <= 100; i++) {
		world_go(&world, 0, 0, 0);
		world.command.axis[0].enable = 0;
		world.command.axis[0].position = i * 15 - 1500;
		world_cycle(&world);
	}
	for (unsigned int i = 0; i < 20; i++) {
		world_go(&world, 0, 0, 0);
		world_cycle(&world);
		assert_int_equal(axis->reference, 0);
	}
}

static void lead_can_be_switched_off(void **state)
{
	double behind, rest;

	(void)state;
	world.config.axis[0].lead = false;
	world_all_moving(&world);
	assert_true(follow(125000, 1, &behind, &rest) < 8);
	assert_in_range(behind, 150, 300);
	assert_true(fabs(rest) < 30);
}

/* Wherever it jumps to, in each cycle: 20000^2 / 2 / 500000 is the way from the highest speed. */
static void the_way_is_that_of_the_highest_speed_at_most(void **state)
{
	const struct pokeys_axis *axis = &world.state.engine.axis[0];
	int32_t position = 0;

	(void)state;
	for (int32_t i = 1; i <= 200; i++) {
		position += i < 100 ? i * 100 : -i * 100;
		world_go(&world, 0, position, i & 8 ? 0 : 1e6f);
		world_cycle(&world);
		assert_true(abs(axis->reference - position) <= 400);
	}
}

static void references_do_not_lead_beyond_a_soft_limit(void **state)
{
	const struct pokeys_axis *axis = &world.state.engine.axis[0];

	(void)state;
	for (int32_t i = 0; i <= 3000; i += 10) {
		world_go(&world, 0, i, 10000);
		world_cycle(&world);
		assert_true(axis->reference <= 3000);
	}
	assert_int_equal(axis->reference, 3000);
	for (int32_t i = 3000; i >= -500; i -= 10) {
		world_go(&world, 0, i, 10000);
		world_cycle(&world);
		assert_true(axis->reference >= -500);
	}
	world_run(&world, 100 * MS);
	assert_int_equal(world_pulses(&world, 0), -500);
}

/* Its commander ends in mid-way: the axis brakes, and does not come back. */
static void axis_brakes_where_its_position_ends(void **state)
{
	int64_t before = 0;

	(void)state;
	for (int32_t i = 1; i <= 300; i++) {
		world_go(&world, 0, i * 15, 15000);
		world_cycle(&world);
	}
	world.commanding = false;
	for (unsigned int ms = 0; ms < 400; ms++) {
		world_cycle(&world);
		assert_true(world_pulses(&world, 0) >= before);
		before = world_pulses(&world, 0);
	}
	assert_in_range(before, 4500, 4500 + 225);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(position_is_followed_at_its_own_speed, begin),
		cmocka_unit_test_setup(velocity_beside_the_position_need_not_be_its_own, begin),
		cmocka_unit_test_setup(position_that_jumps_is_not_led, begin),
		cmocka_unit_test_setup(position_that_moves_by_steps_is_not_led, begin),
		cmocka_unit_test_setup(images_need_not_come_in_each_cycle, begin),
		cmocka_unit_test_setup(axis_waits_for_a_late_commander, begin),
		cmocka_unit_test_setup(axis_that_is_far_behind_is_not_led, begin),
		cmocka_unit_test_setup(axis_that_catches_up_ends_at_the_position, begin),
		cmocka_unit_test_setup(what_a_commander_says_of_its_period_is_looked_at, begin),
		cmocka_unit_test_setup(a_pause_of_the_daemon_ends_no_lead, begin),
		cmocka_unit_test_setup(axis_that_is_refused_goes_to_its_last_position, begin),
		cmocka_unit_test_setup(what_was_before_it_was_enabled_does_not_count, begin),
		cmocka_unit_test_setup(lead_can_be_switched_off, begin),
		cmocka_unit_test_setup(the_way_is_that_of_the_highest_speed_at_most, begin),
		cmocka_unit_test_setup(references_do_not_lead_beyond_a_soft_limit,
				       begin_with_soft_limits),
		cmocka_unit_test_setup(axis_brakes_where_its_position_ends, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
