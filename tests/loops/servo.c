/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * An axis follows what is commanded and holds against what pushes it; when it may be enabled; and
 * what is no configuration.
 */
#include "tests/loops/axis.h"

#include <math.h>
#include <string.h>

#define NEAR 0.02	/* units: what dry friction leaves */

static struct axis axis;

static int begin(void **state)
{
	(void)state;
	axis_init(&axis, &axis_config, &sim_motor_small);
	return 0;
}

static void expect_there(double position)
{
	assert_true(fabs(axis.servo.position - position) <= NEAR);
	axis_expect_fault(&axis, SERVO_FINE);
}

static void it_follows_a_move_and_stops_there(void **state)
{
	(void)state;
	axis_enable(&axis);
	axis_move(&axis, 100, 200, 3000);
	/* what it moves while the reading is on its way is no error */
	assert_true(axis.most < 0.1);
	axis_run(&axis, 0.3);
	axis.most = 0;
	axis_run(&axis, 1);
	assert_true(axis.most <= NEAR);
	expect_there(100);
	axis_move(&axis, -20, 100, 1000);
	axis_run(&axis, 0.3);
	expect_there(-20);
	/* slower than a count in a cycle */
	axis.most = 0;
	axis_move(&axis, -19, 0.5, 100);
	assert_true(axis.most < 0.05);
}

/* Whether or not readings are lost: the screw is where it is commanded to be, now. */
static void the_age_of_a_reading_is_no_error(void **state)
{
	(void)state;
	for (unsigned int lost = 0; lost < 4; lost++) {
		double worst = 0;

		axis_init(&axis, &axis_config, &sim_motor_small);
		axis_enable(&axis);
		for (unsigned int i = 0; i < 1000; i++) {
			const double speed = i < 100 ? 2 * i : 200;

			axis.wish.position += speed * 0.001;
			axis.wish.velocity = speed;
			axis.silent = i % 4 < lost;
			axis_step(&axis);
			if (i > 200)
				worst = fmax(worst, fabs(axis.motor.angle / (2 * M_PI) * 5 -
							 axis.wish.position));
		}
		axis_expect_fault(&axis, SERVO_FINE);
		/* 0.2 for each millisecond */
		assert_true(worst < 0.05);
		axis.silent = false;
	}
}

static void without_a_speed_it_estimates_one(void **state)
{
	(void)state;
	axis_enable(&axis);
	for (int i = 0; i < 1000; i++) {
		axis.wish.position = 0.1 * i;
		axis.wish.velocity = NAN;
		if (i == 500)
			axis.most = 0;
		axis_step(&axis);
	}
	axis_expect_fault(&axis, SERVO_FINE);
	assert_true(axis.most < 0.2);
	assert_true(fabs(axis.servo.wanted_rate - 100) < 0.1);
	/* by a commander of 100 Hz, which then stands */
	axis.wish.enable = false;
	axis_run(&axis, 0.5);
	axis_enable(&axis);
	axis.wish.velocity = NAN;
	for (int i = 0; i < 3000; i++) {
		axis.wish.position += i % 10 || i > 2000 ? 0 : 0.2;
		axis_step(&axis);
		if (i > 100 && i < 2000)
			assert_true(fabs(axis.servo.wanted_rate - 20) < 0.1);
	}
	axis_expect_fault(&axis, SERVO_FINE);
	assert_true(axis.servo.wanted_rate == 0);
	expect_there(axis.wish.position);
}

static void a_jump_without_a_speed_is_none(void **state)
{
	struct servo_config config = axis_config;

	(void)state;
	config.gains = (struct servo_gains){ .p = 0.001, .velocity = 0.001 };
	axis_init(&axis, &config, &sim_motor_small);
	axis_enable(&axis);
	axis.wish.velocity = NAN;
	axis.wish.position = 0.1;
	axis_step(&axis);
	axis.wish.position = 1.5;
	axis_step(&axis);
	/* highest speed, and not 1400 units in a second */
	assert_true(axis.output > 0.29 && axis.output < 0.31);
}

static void a_motor_may_be_wired_the_other_way_if_the_scale_is(void **state)
{
	struct servo_config config = axis_config;

	(void)state;
	config.scale = -400;
	axis_init(&axis, &config, &sim_motor_small);
	sim_motor_break(&axis.motor, SIM_MOTOR_REVERSED);
	axis_enable(&axis);
	axis_move(&axis, 50, 100, 1000);
	axis_run(&axis, 0.3);
	expect_there(50);
}

static void it_holds_against_a_push(void **state)
{
	(void)state;
	axis_enable(&axis);
	axis_run(&axis, 0.1);
	axis.most = 0;
	axis.motor.torque = 0.1; /* 125 N at the screw */
	axis_run(&axis, 1);
	assert_true(axis.most < 0.1);
	expect_there(0);
	assert_true(fabs(axis.servo.integral) > 0.03);
	axis.most = 0;
	axis.motor.torque = -0.1;
	axis_run(&axis, 1);
	assert_true(axis.most < 0.2);
	expect_there(0);
}

static void play_in_the_screw_is_no_oscillation(void **state)
{
	struct sim_motor_config motor = sim_motor_small;
	struct servo_config config = axis_config;

	(void)state;
	motor.backlash = 0.1; /* 0.08 mm */
	config.deadband = 0.1;
	axis_init(&axis, &config, &motor);
	axis_enable(&axis);
	axis_move(&axis, 20, 50, 500);
	axis_move(&axis, 10, 50, 500);
	axis_run(&axis, 1);
	axis.most = 0;
	axis_run(&axis, 1);
	assert_true(axis.most < 0.15);
	axis_expect_fault(&axis, SERVO_FINE);
}

static void an_error_in_the_deadband_is_none(void **state)
{
	struct servo_config config = axis_config;

	(void)state;
	/* nor is one of a count */
	axis_enable(&axis);
	axis.wish.position += 1 / 400.0;
	axis_run(&axis, 5);
	assert_true(axis.output == 0 && axis.servo.integral == 0);
	config.deadband = 0.1;
	axis_init(&axis, &config, &sim_motor_small);
	axis_enable(&axis);
	axis.wish.position += 0.09;
	axis_run(&axis, 5);
	assert_true(axis.output == 0 && axis.servo.integral == 0);
	axis.wish.position += 0.2;
	axis_step(&axis);
	assert_true(axis.output > 0.2);
}

static void its_output_has_a_limit_that_does_not_wind_it_up(void **state)
{
	struct servo_config config = axis_config;
	double most = 0;

	(void)state;
	config.output_most = config.stall_output = 0.4;
	config.integral_most = 0.4;
	config.follow_least = config.follow_most = 50;
	axis_init(&axis, &config, &sim_motor_small);
	axis_enable(&axis);
	axis.wish.position = 40; /* at once */
	for (int i = 0; i < 2000; i++) {
		axis_step(&axis);
		assert_true(fabs(axis.output) <= 0.4);
		most = fmax(most, axis.servo.position);
	}
	assert_true(most < 40.2);
	expect_there(40);
	/* what pushes more than the integral may */
	axis.motor.torque = -0.3;
	config.integral_most = 0.05;
	axis.servo.config.integral_most = 0.05;
	axis_run(&axis, 1);
	assert_true(fabs(axis.servo.integral) <= 0.05);
}

static void other_gains_make_no_jump(void **state)
{
	static const struct servo_gains bad[] = {
		{ .p = NAN },
		{ .p = -1 },
		{ .p = 1, .i = INFINITY },
		{ .p = 1, .d = -1 },
		{ .p = 1, .velocity = NAN },
		{ .p = 1, .acceleration = 1e7 },
		{ .d = 1 },
	};
	const struct servo_gains stiff = { .p = 2, .d = 0.01 };
	const struct servo_gains other = { .p = 0.7, .i = 5, .d = 0.006, .velocity = 0.001 };
	double before;

	(void)state;
	axis_enable(&axis);
	axis.motor.torque = 0.1;
	for (int i = 0; i < 500; i++) {
		axis.wish.velocity = 50;
		axis.wish.position += 0.05;
		axis_step(&axis);
	}
	before = axis.output;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
		assert_false(servo_regain(&axis.servo, &bad[i]));
	for (int i = 0; i < 20; i++) {
		assert_true(servo_regain(&axis.servo, i % 2 ? &axis_config.gains : &other));
		axis.wish.position += 0.05;
		axis_step(&axis);
		assert_true(fabs(axis.output - before) < 0.05);
		before = axis.output;
	}
	assert_true(servo_regain(&axis.servo, &other));
	axis_expect_fault(&axis, SERVO_FINE);
	/* and they are those that count from now on; nothing is left of the others */
	axis.wish.velocity = 0;
	axis_run(&axis, 3);
	assert_true(fabs(axis.servo.bridge) < 0.001);
	axis.wish.position += 0.1;
	before = axis.output;
	axis_step(&axis);
	assert_true(fabs(axis.output - before - 0.07) < 0.02);
	/* without I there is no integral */
	assert_true(servo_regain(&axis.servo, &stiff));
	axis_run(&axis, 2);
	assert_true(axis.servo.integral == 0 && fabs(axis.servo.bridge) < 0.001);
}

static void off_has_to_be_commanded_first(void **state)
{
	(void)state;
	/* on from the start */
	assert_null(servo_init(&axis.servo, &axis_config));
	axis.wish.enable = true;
	axis_run(&axis, 0.1);
	assert_false(axis.servo.enabled);
	assert_int_equal(axis.servo.refusal, SERVO_OFF_FIRST);
	axis_enable(&axis);
	assert_int_equal(axis.servo.refusal, SERVO_TAKEN);
	/* its commander was gone for a cycle */
	axis.wish.alive = false;
	axis_step(&axis);
	assert_true(axis.output == 0 && !axis.servo.enabled);
	axis.wish.alive = true;
	axis_run(&axis, 0.1);
	assert_false(axis.servo.enabled);
	axis_enable(&axis);
	/* another one has come, in whose image it is on */
	servo_another(&axis.servo);
	axis_run(&axis, 0.1);
	assert_true(!axis.servo.enabled && axis.output == 0);
	axis_enable(&axis);
	axis.wish.enable = false;
	axis_step(&axis);
	assert_true(axis.output == 0 && !axis.servo.enabled);
}

static void it_begins_without_a_kick(void **state)
{
	(void)state;
	axis_enable(&axis);
	axis.motor.torque = 0.1;
	for (int i = 1; i < 300; i++) {
		axis.wish.velocity = fmin(i, 100);
		axis.wish.position += axis.wish.velocity / 1000;
		axis_step(&axis);
	}
	axis_expect_fault(&axis, SERVO_FINE);
	axis.wish.enable = false;
	axis.motor.torque = 0;
	axis_run(&axis, 0.5);
	axis_enable(&axis);
	assert_true(fabs(axis.output) < 0.001);
	axis_run(&axis, 0.1);
	expect_there(axis.wish.position);
}

static void it_is_enabled_only_where_it_is(void **state)
{
	static const double elsewhere[] = { 0.6, -0.6, 1e9, NAN, INFINITY };

	(void)state;
	for (size_t i = 0; i < sizeof(elsewhere) / sizeof(elsewhere[0]); i++) {
		axis.wish.enable = false;
		axis_step(&axis);
		axis.wish.enable = true;
		axis.wish.position = elsewhere[i];
		axis_step(&axis);
		assert_true(!axis.servo.enabled && axis.output == 0);
		assert_int_equal(axis.servo.refusal,
				 isfinite(elsewhere[i]) ? SERVO_ELSEWHERE : SERVO_NOT_READY);
		/* nor later, when the command comes by */
		axis.wish.position = 0;
		axis_run(&axis, 0.01);
		assert_false(axis.servo.enabled);
	}
	/* it was pushed by hand meanwhile */
	axis.wish.enable = false;
	axis.motor.torque = 0.1;
	axis_run(&axis, 0.2);
	axis.motor.torque = 0;
	axis_run(&axis, 0.2);
	assert_true(axis.servo.position > 1);
	axis_enable(&axis);
	axis_run(&axis, 1);
	axis_expect_fault(&axis, SERVO_FINE);
}

static void a_position_can_be_given_while_it_is_off(void **state)
{
	(void)state;
	axis_enable(&axis);
	axis_move(&axis, 10, 50, 500);
	assert_false(servo_place(&axis.servo, 3, true));
	axis.wish.enable = false;
	axis_run(&axis, 0.2);
	assert_false(servo_place(&axis.servo, NAN, true));
	assert_false(servo_place(&axis.servo, 1e300, true));
	/* what is far away leaves nothing behind */
	assert_true(servo_place(&axis.servo, 1e12, false));
	axis_step(&axis);
	assert_false(axis.servo.homed);
	assert_true(servo_place(&axis.servo, 3, true));
	assert_true(axis.servo.homed && axis.servo.position == 3);
	axis_step(&axis);
	assert_true(fabs(axis.servo.position - 3) < 1e-9);
	axis_enable(&axis);
	axis_move(&axis, 13, 50, 500);
	axis_run(&axis, 0.3);
	expect_there(13);
	axis.input.epoch++;
	axis_step(&axis);
	assert_false(axis.servo.homed);
	axis.wish.enable = false;
	axis_step(&axis);
	assert_true(servo_place(&axis.servo, 13, true));
	/* a device that was restarted counts from 0: it was lost for a moment, or not even that */
	for (int lost = 0; lost < 2; lost++) {
		assert_true(axis.servo.homed);
		axis.input.usable = !lost;
		axis.input.epoch += !lost;
		axis.motor.counted = lost;
		axis.count = lost;
		axis_step(&axis);
		assert_false(axis.servo.homed);
		assert_false(servo_place(&axis.servo, 3, true));
		axis.wish.enable = false;
		axis.input.usable = true;
		axis_run(&axis, 0.1);
		assert_true(!axis.servo.homed && fabs(axis.servo.position - 13) <= NEAR);
		assert_true(servo_place(&axis.servo, 13, true));
	}
}

static void counts_go_on_after_the_largest(void **state)
{
	(void)state;
	axis.motor.counted = 2147483647.0 - 2000;
	axis.count = sim_motor_count(&axis.motor);
	axis.input.usable = false;
	axis_step(&axis);
	axis.input.usable = true;
	axis_step(&axis);
	axis_enable(&axis);
	axis_move(&axis, 20, 100, 1000);
	axis_run(&axis, 0.3);
	expect_there(20);
	assert_true(axis.count < 0);
	axis_move(&axis, -5, 100, 1000);
	axis_run(&axis, 0.3);
	expect_there(-5);
}

static const struct {
	size_t offset;
	double value;
	const char *word;
} refused[] = {
#define BAD(member, value, word) { offsetof(struct servo_config, member), value, word }
	BAD(scale, 0, "counts-per-unit"),
	BAD(scale, NAN, "counts-per-unit"),
	BAD(scale, INFINITY, "counts-per-unit"),
	BAD(least, INFINITY, "min-position"),
	BAD(most, NAN, "min-position"),
	BAD(speed_most, 0, "max-speed"),
	BAD(speed_most, 900, "impossible-speed"),
	BAD(speed_jump, NAN, "max-speed"),
	BAD(deadband, -1, "deadband"),
	BAD(deadband, 0.5, "deadband"),
	BAD(deadband, NAN, "deadband"),
	BAD(output_most, 0, "max-output"),
	BAD(output_most, 1.1, "max-output"),
	BAD(output_most, NAN, "max-output"),
	BAD(integral_most, -0.1, "max-integral"),
	BAD(integral_most, 1.1, "max-integral"),
	BAD(smooth, -1, "smooth-s"),
	BAD(smooth, NAN, "smooth-s"),
	BAD(follow_least, 0, "min-following-error"),
	BAD(follow_most, 0.1, "max-following-error"),
	BAD(follow_most, NAN, "max-following-error"),
	BAD(stall_output, 0, "stall-output"),
	BAD(stall_move, NAN, "stall-distance"),
	BAD(runaway_output, 1, "runaway-output"),
	BAD(runaway_move, 0, "runaway-distance"),
	BAD(gains.p, NAN, "pid-p"),
	BAD(gains.p, 2e6, "pid-p"),
	BAD(gains.velocity, -1, "velocity-gain"),
	BAD(scale, 1e-310, "counts-per-unit"),
	BAD(scale, 1e8, "impossible-speed"),
	BAD(speed_jump, 1e12, "impossible-speed"),
	BAD(follow_least, 0.009, "4 counts"),
	BAD(stall_move, 1e-9, "4 counts"),
	BAD(runaway_move, 1e-9, "4 counts"),
	BAD(silent_output, 0, "silent-output"),
	BAD(silent_s, NAN, "silent-s"),
#undef BAD
};

static void expect_refused(const struct servo_config *config, const char *word)
{
	struct servo servo;
	const char *why = servo_init(&servo, config);

	if (!why || !strstr(why, word))
		fail_msg("'%s' does not name %s", why ? why : "(taken)", word);
}

static void what_is_no_configuration(void **state)
{
	struct servo_config config;

	(void)state;
	for (size_t i = 0; i < sizeof(refused) / sizeof(refused[0]); i++) {
		config = axis_config;
		memcpy((char *)&config + refused[i].offset, &refused[i].value,
		       sizeof(refused[i].value));
		expect_refused(&config, refused[i].word);
	}
	config = axis_config;
	config.gains.p = config.gains.i = 0;
	expect_refused(&config, "pid-p");
	config = axis_config;
	config.stale_ns = 0;
	expect_refused(&config, "max-age-ms");
	config.stale_ns = UINT64_C(100000001);
	expect_refused(&config, "max-age-ms");
	config = axis_config;
	config.stall_s = 0;
	expect_refused(&config, "stall-s");
	config = axis_config;
	config.output_most = 0.8;
	expect_refused(&config, "stall-output");
	assert_null(servo_init(&axis.servo, &servo_usual));
}

static void go_on(double way)
{
	axis.wish.position += way;
	axis_step(&axis);
}

/* What came late was counted before; the next answer comes in time. */
static void a_late_answer_makes_no_jump_of_the_next_one(void **state)
{
	const double way = 0.3;

	(void)state;
	axis_enable(&axis);
	axis.wish.velocity = NAN;
	for (int i = 0; i < 500; i++)
		go_on(way * fmin(i / 200.0, 1));
	for (int i = 0; i < 20; i++) {
		const uint64_t asked_ns = axis.count_ns;

		axis.silent = true;
		for (int k = 0; k < 3; k++)
			go_on(way);
		axis.count_ns = axis.now_ns;
		axis.input.asked_ns = asked_ns;
		axis.silent = false;
		go_on(way);
		axis.input.asked_ns = 0;
		for (int k = 0; k < 100; k++)
			go_on(way);
		axis_expect_fault(&axis, SERVO_FINE);
	}
}

/* It coasts onto the switch: that is where the switch is, when it is enabled again. */
static void a_switch_is_found_while_something_else_stops_it(void **state)
{
	(void)state;
	for (int i = 0; i < 2; i++) {
		bool *const stop = i ? &axis.input.heater : &axis.input.emergency;

		axis_init(&axis, &axis_config, &sim_motor_small);
		axis_enable(&axis);
		axis_move(&axis, -5, 50, 2000);
		*stop = true;
		axis_step(&axis);
		axis_expect_fault(&axis, i ? SERVO_HEATER : SERVO_EMERGENCY);
		axis.wish.enable = false;
		axis.input.low = true;
		axis_run(&axis, 0.2);
		*stop = false;
		assert_true(axis_reset(&axis));
		axis.wish.position = axis.servo.position;
		axis.wish.enable = true;
		axis_step(&axis);
		axis_expect_fault(&axis, SERVO_FINE);
		assert_true(axis.servo.enabled);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(it_follows_a_move_and_stops_there, begin),
		cmocka_unit_test_setup(the_age_of_a_reading_is_no_error, begin),
		cmocka_unit_test_setup(without_a_speed_it_estimates_one, begin),
		cmocka_unit_test(a_jump_without_a_speed_is_none),
		cmocka_unit_test(a_motor_may_be_wired_the_other_way_if_the_scale_is),
		cmocka_unit_test_setup(it_holds_against_a_push, begin),
		cmocka_unit_test(play_in_the_screw_is_no_oscillation),
		cmocka_unit_test_setup(an_error_in_the_deadband_is_none, begin),
		cmocka_unit_test(its_output_has_a_limit_that_does_not_wind_it_up),
		cmocka_unit_test_setup(other_gains_make_no_jump, begin),
		cmocka_unit_test_setup(off_has_to_be_commanded_first, begin),
		cmocka_unit_test_setup(it_begins_without_a_kick, begin),
		cmocka_unit_test_setup(it_is_enabled_only_where_it_is, begin),
		cmocka_unit_test_setup(a_position_can_be_given_while_it_is_off, begin),
		cmocka_unit_test_setup(counts_go_on_after_the_largest, begin),
		cmocka_unit_test_setup(a_late_answer_makes_no_jump_of_the_next_one, begin),
		cmocka_unit_test(what_is_no_configuration),
		cmocka_unit_test(a_switch_is_found_while_something_else_stops_it),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
