/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A servo motor finds gains with which it is calm and follows well, whatever it moves: a hundred
 * motors at random. It stays within its distance; and what ends it.
 */
#include "tests/loops/axis.h"

#include <math.h>
#include <string.h>
#include "daemon/loops/servo_tune.h"
#include "sim/prng.h"

#define UNITS 5.0	/* of the screw, in a turn */

static struct axis axis;
static struct servo_tune tune;

static double place(void)
{
	return axis.motor.angle / (2 * M_PI) * UNITS;
}

static void step(void)
{
	if (servo_tune_step(&tune, &axis.servo, true, axis.now_ns + AXIS_CYCLE_NS))
		servo_off(&axis.servo);
	axis_step(&axis);
}

static double peak; /* speed of a search */

static double speed(void)
{
	return fabs(axis.motor.speed) / (2 * M_PI) * UNITS;
}

/* Wherever the shaft was. */
static void run_tune(double distance)
{
	const double from = place();
	double furthest = 0;

	peak = 0;

	assert_true(servo_tune_begin(&tune, &axis.servo, distance, 0, axis.now_ns));
	for (long k = 0; tune.state == SERVO_TUNE_RUNS; k++) {
		assert_in_range(k, 0, 40000);
		step();
		furthest = fmax(furthest, fabs(place() - from));
		peak = fmax(peak, speed());
	}
	assert_true(axis.output == 0 && !axis.servo.enabled);
	/* slower than it may be, and slow when it is switched off */
	if (peak > axis.servo.config.speed_most)
		fail_msg("%g instead of %g", peak, axis.servo.config.speed_most);
	assert_true(speed() < 0.4 * peak);
	assert_true(furthest < distance / 2 * 1.15);
}

static void begin_with(const struct servo_config *config, const struct sim_motor_config *motor)
{
	memset(&tune, 0, sizeof(tune));
	axis_init(&axis, config, motor);
	axis_enable(&axis);
}

static void found_is(double found, double real, double part)
{
	if (!(fabs(found - real) <= fabs(real) * part))
		fail_msg("%g instead of %g", found, real);
}

static void it_finds_what_the_motor_is(void **state)
{
	const struct sim_motor_config *motor = &sim_motor_small;
	const double units = UNITS / (2 * M_PI);

	(void)state;
	begin_with(&axis_config, motor);
	run_tune(40);
	assert_int_equal(tune.state, SERVO_TUNE_DONE);
	found_is(tune.rate, motor->constant * motor->volts / motor->ohm / motor->inertia * units,
		 0.1);
	found_is(tune.slowing,
		 (motor->constant * motor->constant / motor->ohm + motor->viscous) / motor->inertia,
		 0.1);
	found_is(tune.friction, motor->friction / motor->inertia * units, 0.3);
	/* those that were found by hand */
	found_is(tune.gains.velocity, axis_config.gains.velocity, 0.15);
	found_is(tune.gains.acceleration, axis_config.gains.acceleration, 0.15);
}

static double between(struct sim_prng *prng, double low, double high)
{
	return low * pow(high / low, sim_prng_unit(prng));
}

/* Errors of a move, and of a second of rest after it. */
static void follows(double speed, double most_moving, double most_resting)
{
	double way = 20 * UNITS;

	axis_enable(&axis);
	axis.most = 0;
	axis_move(&axis, axis.wish.position + way, speed, fmin(speed * 5, 0.4 * tune.rate));
	if (axis.most > most_moving)
		fail_msg("%g off while it moves", axis.most);
	axis_run(&axis, 0.5);
	axis.most = 0;
	axis_run(&axis, 1);
	axis_expect_fault(&axis, SERVO_FINE);
	if (axis.most > most_resting)
		fail_msg("%g off at rest", axis.most);
}

static void hundred_motors_find_their_gains(void **state)
{
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, 7);
	for (unsigned int i = 0; i < 100; i++) {
		struct sim_motor_config motor = {
			.volts = between(&prng, 12, 60),
			.ohm = between(&prng, 0.4, 4),
			.constant = between(&prng, 0.03, 0.15),
			.viscous = 1e-5,
			.inertia = between(&prng, 2e-5, 5e-4),
			.counts = 4 * round(between(&prng, 250, 2500)),
		};
		const double stall = motor.constant * motor.volts / motor.ohm;
		const double fastest = motor.volts / motor.constant / (2 * M_PI) * UNITS;
		struct servo_config config = axis_config;

		motor.friction = stall * between(&prng, 0.01, 0.1);
		config.scale = motor.counts / UNITS;
		config.speed_most = 0.6 * fastest;
		config.speed_jump = 3 * fastest;
		config.follow_least = 2 + 8 / config.scale;
		config.follow_most = 10;
		config.stall_s = 1;
		begin_with(&config, &motor);
		run_tune(50);
		if (tune.state != SERVO_TUNE_DONE)
			fail_msg("motor %u: reason %d: %g V, %g ohm, %g Nm/A, %g kg m^2, friction "
				 "%g, %g counts; fault %d",
				 i, (int)tune.reason, motor.volts, motor.ohm, motor.constant,
				 motor.inertia, motor.friction / stall, motor.counts,
				 (int)axis.servo.fault);
		assert_true(servo_regain(&axis.servo, &tune.gains));
		axis_run(&axis, 0.5);
		follows(fastest / 3, 1, 0.05 + 4 / config.scale);
	}
}

/* Ended early: off, and nothing is found. */
static void expect_failed(enum servo_tune_reason reason)
{
	for (long k = 0; tune.state == SERVO_TUNE_RUNS; k++) {
		assert_in_range(k, 0, 40000);
		step();
	}
	step();
	assert_int_equal(tune.state, SERVO_TUNE_FAILED);
	assert_int_equal(tune.reason, reason);
	assert_true(axis.output == 0 && !axis.servo.enabled);
	assert_true(tune.gains.p == 0);
}

static void begin_tune(double distance, double most)
{
	begin_with(&axis_config, &sim_motor_small);
	assert_true(servo_tune_begin(&tune, &axis.servo, distance, most, axis.now_ns));
}

static void run_for(double seconds)
{
	for (long k = lround(seconds * 1000); k > 0; k--)
		step();
}

static void what_ends_it(void **state)
{
	(void)state;
	/* on request */
	begin_tune(40, 0);
	run_for(1);
	assert_true(servo_tune_abort(&tune));
	expect_failed(SERVO_TUNE_STOPPED);
	assert_false(servo_tune_abort(&tune));
	/* commanded off */
	begin_tune(40, 0);
	run_for(1);
	axis.wish.enable = false;
	expect_failed(SERVO_TUNE_STOPPED);
	/* by a fault, each of them */
	begin_tune(40, 0);
	run_for(1);
	axis.input.high = true;
	expect_failed(SERVO_TUNE_STOPPED);
	axis_expect_fault(&axis, SERVO_SWITCH);
	axis.input.high = false;
	begin_tune(40, 0);
	run_for(1);
	axis.input.emergency = true;
	expect_failed(SERVO_TUNE_STOPPED);
	begin_tune(40, 0);
	run_for(1);
	axis.silent = true;
	expect_failed(SERVO_TUNE_STOPPED);
	axis_expect_fault(&axis, SERVO_STALE);
	/* nothing moves: the motor is not connected, or held */
	begin_tune(40, 0.15);
	sim_motor_break(&axis.motor, SIM_MOTOR_CUT);
	expect_failed(SERVO_TUNE_STILL);
	begin_tune(40, 0);
	sim_motor_break(&axis.motor, SIM_MOTOR_STALLED);
	expect_failed(SERVO_TUNE_STILL);
	axis_expect_fault(&axis, SERVO_FINE);
	/* the encoder's cable breaks: in each of the pushes */
	for (double seconds = 0.45; seconds < 2.8; seconds += 0.13) {
		begin_tune(40, 0);
		run_for(seconds);
		sim_motor_break(&axis.motor, SIM_MOTOR_SILENT);
		run_for(0.07);
		assert_int_equal(tune.state, SERVO_TUNE_FAILED);
		assert_true(axis.output == 0 && !axis.servo.enabled);
	}
	/* it counts the wrong way */
	begin_tune(40, 0);
	sim_motor_break(&axis.motor, SIM_MOTOR_REVERSED);
	expect_failed(SERVO_TUNE_REVERSED);
	/* ... from some time on: it runs away, and is stopped soon */
	for (double seconds = 0.5; seconds < 3; seconds += 0.37) {
		double at;

		begin_tune(40, 0);
		run_for(seconds);
		at = place();
		sim_motor_break(&axis.motor, SIM_MOTOR_REVERSED);
		for (long k = 0; tune.state == SERVO_TUNE_RUNS; k++) {
			assert_in_range(k, 0, 40000);
			step();
			assert_true(fabs(place() - at) < 40);
		}
		assert_int_equal(tune.state, SERVO_TUNE_FAILED);
		assert_true(axis.output == 0);
	}
	/* held where it turns */
	begin_tune(40, 0);
	run_for(2);
	sim_motor_break(&axis.motor, SIM_MOTOR_STALLED);
	run_for(0.1);
	assert_int_equal(tune.state, SERVO_TUNE_FAILED);
	/* something pulls it away */
	begin_tune(4, 0.5);
	run_for(0.3);
	axis.motor.torque = 0.4;
	for (long k = 0; tune.state == SERVO_TUNE_RUNS; k++) {
		assert_in_range(k, 0, 40000);
		step();
		assert_true(fabs(place()) < 6);
	}
	assert_int_equal(tune.state, SERVO_TUNE_FAILED);
	assert_true(axis.output == 0);
}

static void what_it_does_not_begin_with(void **state)
{
	(void)state;
	begin_with(&axis_config, &sim_motor_small);
	assert_false(servo_tune_begin(&tune, &axis.servo, 0, 0, axis.now_ns));
	assert_false(servo_tune_begin(&tune, &axis.servo, -1, 0, axis.now_ns));
	assert_false(servo_tune_begin(&tune, &axis.servo, NAN, 0, axis.now_ns));
	assert_false(servo_tune_begin(&tune, &axis.servo, INFINITY, 0, axis.now_ns));
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, 1.1, axis.now_ns));
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, -0.1, axis.now_ns));
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, NAN, axis.now_ns));
	/* fewer counts than tell anything */
	assert_false(servo_tune_begin(&tune, &axis.servo, 0.2, 0, axis.now_ns));
	axis.wish.enable = false;
	step();
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, 0, axis.now_ns));
	assert_int_equal(tune.state, SERVO_TUNE_NONE);
	/* while it moves, or is commanded to */
	axis_enable(&axis);
	for (int k = 0; k < 100; k++) {
		axis.wish.position += 0.05;
		axis.wish.velocity = 50;
		step();
	}
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, 0, axis.now_ns));
	axis.wish.velocity = 0;
	step();
	axis.servo.wanted_rate = 0;
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, 0, axis.now_ns));
	run_for(0.5);
	/* a soft limit is too near, or a limit switch is pressed */
	axis.servo.homed = true;
	axis.servo.config.most = axis.servo.position + 5;
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, 0, axis.now_ns));
	axis.servo.config.most = axis.servo.position + 6;
	axis.servo.config.least = axis.servo.position - 5;
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, 0, axis.now_ns));
	axis.servo.homed = false;
	axis.servo.low_at = axis.servo.position;
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, 0, axis.now_ns));
	axis.servo.low_at = NAN;
	axis_enable(&axis);
	assert_true(servo_tune_begin(&tune, &axis.servo, 10, 0, axis.now_ns));
	assert_false(servo_tune_begin(&tune, &axis.servo, 10, 0, axis.now_ns));
}

/* Readings are lost now and then, or come in every fourth cycle only: their times tell. */
static void lost_readings_do_not_matter(void **state)
{
	(void)state;
	for (unsigned int seldom = 0; seldom < 2; seldom++) {
		begin_tune(100, 0);
		for (long k = 0; tune.state == SERVO_TUNE_RUNS; k++) {
			assert_in_range(k, 0, 40000);
			axis.silent = seldom ? k % 4 > 0 : k % 7 < 2;
			step();
		}
		axis.silent = false;
		assert_int_equal(tune.state, SERVO_TUNE_DONE);
		found_is(tune.gains.velocity, axis_config.gains.velocity, 0.15);
		found_is(tune.gains.acceleration, axis_config.gains.acceleration, 0.2);
	}
}

/* A motor that could go much faster than its axis may. */
static void it_keeps_to_half_of_its_speed(void **state)
{
	(void)state;
	for (double most = 20; most < 300; most *= 1.5) {
		struct servo_config config = axis_config;

		config.speed_most = most;
		begin_with(&config, &sim_motor_small);
		run_tune(40);
		assert_int_equal(tune.state, SERVO_TUNE_DONE);
		found_is(tune.gains.velocity, axis_config.gains.velocity, 0.2);
		found_is(tune.gains.acceleration, axis_config.gains.acceleration, 0.2);
	}
}

/* It takes 8 ms until some turned outputs are applied: a packet was lost. */
static double gain_with_losses(unsigned int every)
{
	unsigned int turns = 0;
	long late = 0;

	begin_tune(40, 0);
	for (long k = 0; tune.state == SERVO_TUNE_RUNS; k++) {
		bool applied;

		assert_in_range(k, 0, 40000);
		if (tune.turns != turns && every && tune.turns % every == 0)
			late = 8;
		turns = tune.turns;
		applied = late <= 0;
		late -= late > 0;
		/* as long as the device has the output of before */
		if (servo_tune_step(&tune, &axis.servo, applied, axis.now_ns + AXIS_CYCLE_NS))
			servo_off(&axis.servo);
		if (!applied)
			axis.output = -axis.output;
		axis_step(&axis);
	}
	assert_int_equal(tune.state, SERVO_TUNE_DONE);
	return tune.gains.p;
}

static void a_packet_lost_at_a_turn_is_not_its_delay(void **state)
{
	const double usual = gain_with_losses(0);

	(void)state;
	found_is(gain_with_losses(5), usual, 0.3);
	found_is(gain_with_losses(3), usual, 0.3);
}

/* What holds it where it is, from outside: a spring that is tight at the beginning. */
static void spring(double tight)
{
	const double slack = axis.motor.angle - tight;

	for (unsigned int k = 0; k < 1000; k++) {
		axis.motor.torque = -0.2 * fmax(axis.motor.angle - slack, 0);
		axis_step(&axis);
	}
}

static void it_begins_where_it_rests(void **state)
{
	double slack;

	(void)state;
	begin_with(&axis_config, &sim_motor_small);
	spring(1);
	assert_true(axis.servo.output > 0.05);
	slack = axis.motor.angle - 1;
	assert_true(servo_tune_begin(&tune, &axis.servo, 40, 0, axis.now_ns));
	for (long k = 0; tune.state == SERVO_TUNE_RUNS; k++) {
		assert_in_range(k, 0, 40000);
		axis.motor.torque = tune.push > 0 ? 0 : -0.2 * fmax(axis.motor.angle - slack, 0);
		step();
	}
	assert_int_equal(tune.state, SERVO_TUNE_DONE);
	found_is(tune.gains.velocity, axis_config.gains.velocity, 0.15);
	/* one that falls never rests: it is given up soon */
	begin_with(&axis_config, &sim_motor_small);
	axis.motor.torque = -0.05;
	axis_run(&axis, 0.5);
	assert_true(servo_tune_begin(&tune, &axis.servo, 40, 0, axis.now_ns));
	expect_failed(SERVO_TUNE_UNLIKE);
	assert_true(fabs(place()) < 20);
	/* one that was pushed against is not taken for one without an encoder */
	for (double output = 0.15; output < 0.8; output += 0.3) {
		begin_with(&axis_config, &sim_motor_small);
		sim_motor_break(&axis.motor, SIM_MOTOR_STALLED);
		axis.wish.velocity = 0;
		axis_run(&axis, 0.1);
		/* at its last count it had that */
		axis.servo.idle_output = axis.servo.output = -output;
		assert_true(servo_tune_begin(&tune, &axis.servo, 40, 0, axis.now_ns));
		expect_failed(SERVO_TUNE_STILL);
		axis_expect_fault(&axis, SERVO_FINE);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(it_finds_what_the_motor_is),
		cmocka_unit_test(hundred_motors_find_their_gains),
		cmocka_unit_test(what_ends_it),
		cmocka_unit_test(what_it_does_not_begin_with),
		cmocka_unit_test(lost_readings_do_not_matter),
		cmocka_unit_test(it_keeps_to_half_of_its_speed),
		cmocka_unit_test(a_packet_lost_at_a_turn_is_not_its_delay),
		cmocka_unit_test(it_begins_where_it_rests),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
