/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing of a motor through the device: by a switch of its own, or by its limit switch; who may
 * begin it, and what ends it. Where the axis is, is asked of the simulated motor.
 */

#include <math.h>
#include "tests/device/servo_rig.h"
#include "wire/io.h"

enum { HOME_PIN = 23, COUNTS = 400, UNITS = 5 }; /* counts a unit; units of a turn */

#define SWITCH_AT (-8.0)	/* where the lower switch closes */

static double place(void)
{
	return servo_motor(SIGN)->angle / (2 * M_PI) * UNITS;
}

static uint8_t switch_pin;
static bool switch_inverted, broken;
static double follow = 0.5; /* allowed following error */

static void set_pin(uint8_t pin, bool pressed, bool inverted)
{
	sim_bench_pin(&world.rig.device, pin, pressed != inverted);
}

static void cycle(void)
{
	set_pin(switch_pin, !broken && place() <= SWITCH_AT, switch_inverted);
	servo_cycle();
}

static void run(uint64_t for_ns)
{
	for (uint64_t k = 0; k < for_ns / MS; k++)
		cycle();
}

static void prepare(bool by_limit)
{
	struct servoing_config *config;

	servo_prepare(NULL);
	config = &world.config.servo[SIGN];
	config->home = (struct servo_home_config){
		.search = -50,
		.latch = 2,
		.acceleration = 1000,
		.offset = 10,
		.position = 15,
		.distance = 40,
	};
	config->servo.follow_least = follow;
	config->servo.follow_most = 4 * follow;
	config->servo.runaway_move = 0.4 * follow;
	config->servo.stale_ns = (uint64_t)(20 * follow) * MS;
	config->home_pin = switch_pin = by_limit ? LOW_PIN : HOME_PIN;
	config->home_inverted = switch_inverted = by_limit;
	broken = false;
	if (!by_limit)
		world_pin(&world, HOME_PIN, WIRE_PIN_INPUT);
	servo_start();
	run(20 * MS);
	servo_enable(SIGN);
}

static enum pokeys_outcome home(uint8_t flags)
{
	return servo_do(POKEYS_ONE_SHOT_SERVO_HOME, SIGN, 0, flags);
}

static void until_ended(void)
{
	for (unsigned int k = 0; servo_shown(SIGN)->home_end == POKEYS_SERVO_HOME_NONE; k++) {
		assert_true(k < 30000);
		cycle();
	}
}

/* The counts that the network brings are some milliseconds old, and so is the switch. */
static void expect_homed(double within)
{
	until_ended();
	assert_int_equal(servo_shown(SIGN)->home_end, POKEYS_SERVO_HOME_DONE);
	run(300 * MS);
	assert_int_equal(servo_shown(SIGN)->homing, POKEYS_SERVO_HOMING_HOLD);
	assert_true(servo_shown(SIGN)->homed);
	assert_true(fabs(servo_shown(SIGN)->position - (place() - SWITCH_AT) - 10) < within);
	assert_true(fabs(servo_shown(SIGN)->position - 15) < 0.02);
	/* from there on it is the commander's */
	world.command.servo[SIGN].position = servo_shown(SIGN)->commanded;
	run(120 * MS);
	assert_int_equal(servo_shown(SIGN)->homing, POKEYS_SERVO_HOMING_NONE);
	for (unsigned int k = 0; k < 500; k++) {
		world.command.servo[SIGN].position += 0.01;
		cycle();
	}
	run(200 * MS);
	assert_true(fabs(servo_shown(SIGN)->position - 20) < 0.02);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
}

static void it_homes_to_a_switch_of_its_own(void **state)
{
	(void)state;
	prepare(false);
	assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
	assert_int_equal(servo_shown(SIGN)->homing, POKEYS_SERVO_HOMING_LEAVE);
	expect_homed(0.02);
	assert_int_equal(world.event_count[EVENT_SERVO_HOME], 2);
	assert_int_equal(world.last_event[EVENT_SERVO_HOME].b, POKEYS_SERVO_HOME_DONE);
	/* again, from there */
	assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
	assert_false(servo_shown(SIGN)->homed);
	expect_homed(0.02);
}

static void it_homes_to_its_limit_switch(void **state)
{
	(void)state;
	prepare(true);
	assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
	expect_homed(0.02);
	/* which stops it as before */
	for (unsigned int k = 0; k < 1000 && !servo_shown(SIGN)->fault; k++) {
		world.command.servo[SIGN].position -= 0.05;
		cycle();
	}
	assert_int_equal(servo_shown(SIGN)->fault, POKEYS_SERVO_SWITCH);
	assert_true(place() < SWITCH_AT + 0.1);
}

/* Stopped where it presses the switch, it is held there as anywhere else. */
static void aborted_on_its_limit_switch_it_is_held(void **state)
{
	(void)state;
	prepare(true);
	assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
	while (servo_shown(SIGN)->homing != POKEYS_SERVO_HOMING_BACK)
		cycle();
	assert_true(servo_shown(SIGN)->low);
	assert_int_equal(home(POKEYS_SERVO_END_HOMING), POKEYS_OUTCOME_DONE);
	run(500 * MS);
	assert_true(servo_shown(SIGN)->low);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	assert_int_equal(servo_shown(SIGN)->homing, POKEYS_SERVO_HOMING_HOLD);
	/* and may leave it */
	world.command.servo[SIGN].position = servo_shown(SIGN)->commanded;
	run(120 * MS);
	for (unsigned int k = 0; k < 500; k++) {
		world.command.servo[SIGN].position += 0.01;
		cycle();
	}
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	assert_false(servo_shown(SIGN)->low);
}

static void losses_do_not_change_where_it_is(void **state)
{
	const struct sim_link_faults faults = {
		.loss = 0.05,
		.delay = { .low_ns = MS / 10, .high_ns = MS },
	};

	(void)state;
	/* until the device has acknowledged a direction, the motor has no voltage */
	follow = 2;
	for (unsigned int limit = 0; limit < 2; limit++) {
		prepare(limit);
		sim_link_set_faults(&world.rig.link, 0, &faults);
		sim_link_set_faults(&world.rig.link, 1, &faults);
		assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
		expect_homed(0.04);
	}
	follow = 0.5;
}

static void the_other_limit_switch_stops_it(void **state)
{
	(void)state;
	prepare(true);
	assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
	run(100 * MS);
	set_pin(HIGH_PIN, true, true);
	cycle();
	servo_expect_off(2 * MS);
	assert_int_equal(servo_shown(SIGN)->fault, POKEYS_SERVO_SWITCH);
	assert_int_equal(servo_shown(SIGN)->home_end, POKEYS_SERVO_HOME_STOPPED);
	assert_int_equal(servo_shown(SIGN)->homing, POKEYS_SERVO_HOMING_NONE);
	assert_false(servo_shown(SIGN)->homed);
}

/* Another program, or none: the motor is off in the next cycle, as if it had moved it itself. */
static void it_ends_with_its_commander(void **state)
{
	(void)state;
	for (unsigned int way = 0; way < 3; way++) {
		prepare(false);
		assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
		run(100 * MS);
		assert_int_equal(servo_shown(SIGN)->homing, POKEYS_SERVO_HOMING_SEARCH);
		if (way == 0)
			world_commander(&world, 6);
		else if (way == 1)
			world.commanding = false;
		else
			world.command.servo[SIGN].enable = 0;
		servo_expect_off(120 * MS);
		assert_int_equal(servo_shown(SIGN)->home_end, POKEYS_SERVO_HOME_STOPPED);
		assert_int_equal(world.last_event[EVENT_SERVO_HOME].b, POKEYS_SERVO_HOME_STOPPED);
	}
}

static void it_stops_where_no_switch_is(void **state)
{
	(void)state;
	prepare(false);
	broken = true;
	assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
	until_ended();
	assert_int_equal(servo_shown(SIGN)->home_end, POKEYS_SERVO_HOME_NOT_FOUND);
	run(500 * MS);
	assert_int_equal(servo_shown(SIGN)->homing, POKEYS_SERVO_HOMING_HOLD);
	assert_true(place() < -40 && place() > -43);
	/* on request as well */
	world.command.servo[SIGN].position = servo_shown(SIGN)->commanded;
	run(120 * MS);
	assert_int_equal(home(POKEYS_SERVO_END_HOMING), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
	run(50 * MS);
	assert_int_equal(home(POKEYS_SERVO_END_HOMING), POKEYS_OUTCOME_DONE);
	assert_int_equal(servo_shown(SIGN)->home_end, POKEYS_SERVO_HOME_ABORTED);
	run(200 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	assert_false(servo_shown(SIGN)->homed);
}

static void make_it_an_output(void)
{
	struct pokeys_wish wish = { .session = 5, .generation = 9 };

	wish.settings.pin_set[HOME_PIN / 8] = 1u << HOME_PIN % 8;
	wish.settings.pin_function[HOME_PIN] = WIRE_PIN_OUTPUT;
	device_wish(world.device, &wish);
}

static void a_switch_that_is_not_read_is_none(void **state)
{
	(void)state;
	prepare(false);
	world.command.servo[SIGN].enable = 0;
	run(10 * MS);
	make_it_an_output();
	run(500 * MS);
	servo_enable(SIGN);
	assert_int_equal(home(0), POKEYS_OUTCOME_DONE);
	until_ended();
	assert_int_equal(servo_shown(SIGN)->home_end, POKEYS_SERVO_HOME_UNREAD);
	assert_true(fabs(place()) < 1);
}

static void it_needs_a_switch_and_a_motor_that_is_on(void **state)
{
	(void)state;
	prepare(false);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_HOME, TWO_PWM, 0, 0),
			 POKEYS_OUTCOME_REFUSED);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_HOME, MOTORS, 0, 0),
			 POKEYS_OUTCOME_REFUSED);
	world.command.servo[SIGN].enable = 0;
	run(10 * MS);
	assert_int_equal(home(0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(servo_shown(SIGN)->home_end, POKEYS_SERVO_HOME_NONE);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(it_homes_to_a_switch_of_its_own),
		cmocka_unit_test(it_homes_to_its_limit_switch),
		cmocka_unit_test(aborted_on_its_limit_switch_it_is_held),
		cmocka_unit_test(losses_do_not_change_where_it_is),
		cmocka_unit_test(the_other_limit_switch_stops_it),
		cmocka_unit_test(it_ends_with_its_commander),
		cmocka_unit_test(it_stops_where_no_switch_is),
		cmocka_unit_test(a_switch_that_is_not_read_is_none),
		cmocka_unit_test(it_needs_a_switch_and_a_motor_that_is_on),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
