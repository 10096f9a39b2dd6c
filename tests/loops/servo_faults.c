/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Each fault of a servo against its limit: the output is 0 in the cycle that finds it, it stays
 * so, and it is reset only when its cause is gone. And whatever comes in: an output only while
 * nothing is wrong.
 */
#include "tests/loops/axis.h"

#include <math.h>
#include <string.h>
#include "sim/prng.h"

static struct axis axis;

static int begin(void **state)
{
	(void)state;
	axis_init(&axis, &axis_config, &sim_motor_small);
	axis_enable(&axis);
	return 0;
}

/* It moves at this speed, units/s. */
static void cruise(double speed)
{
	for (int i = 0; i < 500; i++) {
		axis.wish.velocity = speed * fmin(i / 200.0, 1);
		axis.wish.position += axis.wish.velocity / 1000;
		axis_step(&axis);
	}
	axis_expect_fault(&axis, SERVO_FINE);
}

/* ... and goes on, with what was broken, until that is found. */
static double cruise_until_fault(double seconds)
{
	const double speed = axis.wish.velocity;

	for (int i = 1; i <= seconds * 1000; i++) {
		axis.wish.position += speed / 1000;
		axis_step(&axis);
		if (axis.servo.fault)
			return i / 1000.0;
	}
	return -1;
}

/* It is found in the next cycle. */
static void expect_at_once(enum servo_fault fault)
{
	axis_step(&axis);
	axis_expect_fault(&axis, fault);
	assert_true(axis.output == 0 && !axis.servo.enabled);
}

/* It stays off until its cause is gone, it is reset, and off was commanded. */
static void expect_latched(void (*mend)(void))
{
	const enum servo_fault fault = axis.servo.fault;

	axis.wish.enable = false;
	axis_run(&axis, 0.01);
	axis.wish.position = axis.servo.position;
	axis.wish.enable = true;
	axis_run(&axis, 0.01);
	assert_true(axis.output == 0 && !axis.servo.enabled);
	axis_expect_fault(&axis, fault);
	if (mend) {
		assert_false(axis_reset(&axis));
		mend();
		axis_run(&axis, 0.2);
	}
	assert_true(axis.output == 0 && !axis.servo.enabled);
	axis_expect_fault(&axis, fault);
	assert_true(axis_reset(&axis));
	/* on is still commanded: that does not count */
	axis_run(&axis, 0.1);
	assert_true(axis.output == 0 && !axis.servo.enabled);
	axis_enable(&axis);
	axis_run(&axis, 0.2);
	axis_expect_fault(&axis, SERVO_FINE);
}

static void device_back(void)
{
	axis.input.usable = true;
}

static void the_device_is_lost(void **state)
{
	(void)state;
	cruise(100);
	assert_true(axis.output > 0);
	axis.input.usable = false;
	expect_at_once(SERVO_DEVICE);
	expect_latched(device_back);
}

static void readings_back(void)
{
	axis.silent = false;
}

static void readings_are_old(void **state)
{
	double took;

	(void)state;
	cruise(20);
	axis.silent = true;
	took = cruise_until_fault(1);
	axis_expect_fault(&axis, SERVO_STALE);
	/* 5 ms, of which a cycle was over when the last one was read */
	assert_true(took > 0.003 && took < 0.0065);
	assert_true(axis.output == 0);
	expect_latched(readings_back);
	/* one of the future is none, not even the one after it */
	axis.silent = true;
	axis.count_ns = axis.now_ns + 3 * AXIS_CYCLE_NS;
	took = axis_until_fault(&axis, 1);
	axis_expect_fault(&axis, SERVO_STALE);
	assert_true(took < 0.0095);
	expect_latched(readings_back);
	axis.count_ns = axis.now_ns + 99 * AXIS_CYCLE_NS;
	cruise(20);
	assert_true(axis.servo.read_ns + 2 * AXIS_CYCLE_NS > axis.now_ns);
	/* a reading that is older than the last one is ignored */
	axis.silent = true;
	axis_step(&axis);
	for (int i = 0; i < 2; i++) {
		axis.count += 100;
		axis.count_ns -= 1000;
		axis_step(&axis);
		assert_true(fabs(axis.servo.position - axis.wish.position) < 0.2);
	}
	axis_expect_fault(&axis, SERVO_FINE);
}

/* The device has kept the last output, and nobody has looked. */
static void it_was_not_called_for_a_while(void **state)
{
	(void)state;
	cruise(20);
	axis.now_ns += 6 * AXIS_CYCLE_NS;
	axis.count_ns = axis.now_ns;
	expect_at_once(SERVO_STALE);
	expect_latched(NULL);
}

static bool *stopping;

static void calm(void)
{
	*stopping = false;
}

/* While it is off, neither is a fault, but it is not enabled. */
static void what_stops_it_from_outside(void **state)
{
	static const enum servo_fault faults[] = { SERVO_EMERGENCY, SERVO_HEATER };

	for (int i = 0; i < 2; i++) {
		begin(state);
		stopping = i ? &axis.input.heater : &axis.input.emergency;
		cruise(100);
		*stopping = true;
		expect_at_once(faults[i]);
		expect_latched(calm);
		axis.wish.enable = false;
		axis_step(&axis);
		*stopping = true;
		axis_step(&axis);
		axis_expect_fault(&axis, SERVO_FINE);
		axis.wish.enable = true;
		axis_step(&axis);
		assert_false(axis.servo.enabled);
		assert_int_equal(axis.servo.refusal, SERVO_NOT_READY);
	}
}

static void the_encoder_jumps(void **state)
{
	(void)state;
	assert_true(axis.servo.primed);
	axis.wish.enable = false;
	axis_step(&axis);
	assert_true(servo_place(&axis.servo, 0, true));
	axis_enable(&axis);
	/* 800 mm/s are 320 counts in a cycle */
	axis.motor.counted += 500;
	axis_step(&axis);
	expect_at_once(SERVO_JUMP);
	assert_false(axis.servo.homed);
	assert_true(fabs(axis.servo.position) < 0.1);
	axis_step(&axis);
	expect_latched(NULL);
	/* after lost replies the count changes by more at once, which is no jump */
	cruise(100);
	for (int i = 0; i < 100; i++) {
		axis.silent = i % 10 > 6;
		axis.wish.position += 0.1;
		axis_step(&axis);
	}
	axis_expect_fault(&axis, SERVO_FINE);
	/* after an hour nobody knows how often the counter has wrapped */
	axis.wish.enable = false;
	axis_run(&axis, 0.5);
	assert_true(servo_place(&axis.servo, 0, true));
	axis.now_ns += UINT64_C(4000000000000);
	axis.count_ns = axis.now_ns;
	axis_step(&axis);
	assert_false(axis.servo.homed);
}

static void sane(void)
{
	axis.wish.position = axis.servo.position;
	axis.wish.velocity = 0;
}

static void the_command_is_no_number(void **state)
{
	const double bad[] = { NAN, INFINITY, -INFINITY }, fast[] = { INFINITY, -1e300, 801 };

	(void)state;
	for (int i = 0; i < 3; i++) {
		axis.wish.position = bad[i];
		expect_at_once(SERVO_ODD);
		axis.wish.enable = false;
		axis_run(&axis, 0.01);
		assert_false(axis_reset(&axis));
		/* what is commanded with the reset counts */
		sane();
		assert_true(axis_reset(&axis));
		axis_enable(&axis);
	}
	/* a speed that is none is estimated; one that no axis has is a fault */
	axis.wish.velocity = NAN;
	axis_run(&axis, 0.1);
	axis_expect_fault(&axis, SERVO_FINE);
	for (int i = 0; i < 3; i++) {
		axis.wish.velocity = fast[i];
		expect_at_once(SERVO_ODD);
		expect_latched(sane);
	}
}

static void it_cannot_follow(void **state)
{
	(void)state;
	cruise(100);
	/* held back by more than it can push */
	axis.motor.torque = -2;
	assert_true(cruise_until_fault(1) > 0);
	axis_expect_fault(&axis, SERVO_FOLLOWING);
	assert_true(axis.output == 0);
	axis.motor.torque = 0;
	axis_run(&axis, 0.5);
	expect_latched(NULL);
	/* the command jumps: found before it moves; what comes later does not hide it */
	axis.wish.position += 3;
	expect_at_once(SERVO_FOLLOWING);
	assert_true(axis.servo.error > 2.9);
	axis.input.usable = false;
	expect_at_once(SERVO_FOLLOWING);
	axis.input.usable = true;
	axis_step(&axis);
	assert_true(fabs(axis.motor.speed) < 1);
}

/* It is held, and shakes. */
static double shaken_until_fault(double seconds, bool dips)
{
	for (int i = 1; i <= seconds * 1000; i++) {
		axis.motor.counted += i / 5 % 2 ? 1 : -1;
		if (dips && i % 100 == 0) {
			/* a cycle of no output */
			axis.wish.position -= 5;
			axis_step(&axis);
			axis.wish.position += 5;
		} else {
			axis_step(&axis);
		}
		if (axis.servo.fault)
			return i / 1000.0;
	}
	return -1;
}

static void it_is_stalled(void **state)
{
	(void)state;
	for (int dips = 0; dips < 2; dips++) {
		struct servo_config config = axis_config;
		double took;

		/* what is allowed to be far away is stalled for longer */
		config.follow_least = config.follow_most = 20;
		axis_init(&axis, &config, &sim_motor_small);
		axis_enable(&axis);
		cruise(50);
		sim_motor_break(&axis.motor, SIM_MOTOR_STALLED);
		axis.wish.position += 5;
		took = shaken_until_fault(1, dips);
		axis_expect_fault(&axis, SERVO_STALLED);
		assert_true(took > 0.19 && took < 0.25);
		sim_motor_break(&axis.motor, SIM_MOTOR_GOOD);
		expect_latched(NULL);
	}
}

/* However slowly it is commanded to move, from wherever. */
static void the_encoder_falls_silent(void **state)
{
	static const double speeds[] = { 0.5, 1, 5, 20, 100 };

	(void)state;
	for (size_t k = 0; k < sizeof(speeds) / sizeof(speeds[0]); k++) {
		double before;

		axis_init(&axis, &axis_config, &sim_motor_small);
		axis_enable(&axis);
		axis_run(&axis, 0.1);
		before = axis.motor.angle;
		sim_motor_break(&axis.motor, SIM_MOTOR_SILENT);
		axis.wish.velocity = speeds[k];
		assert_true(cruise_until_fault(2) > 0);
		assert_true(axis.servo.fault == SERVO_SILENT ||
			    axis.servo.fault == SERVO_FOLLOWING);
		/* it has turned, but not far */
		assert_true(fabs(axis.motor.angle - before) * 5 / 6.28 < 35);
	}
	/* a small step */
	axis_init(&axis, &axis_config, &sim_motor_small);
	axis_enable(&axis);
	sim_motor_break(&axis.motor, SIM_MOTOR_CUT);
	axis.wish.position += 0.3;
	assert_true(axis_until_fault(&axis, 0.3) > 0);
	axis_expect_fault(&axis, SERVO_SILENT);
}

/* For hours it is held by the same output, which is no fault. */
static void a_weight_is_held_and_let_down(void **state)
{
	(void)state;
	axis.motor.torque = -0.3; /* 380 N at the screw */
	axis_run(&axis, 100);
	axis_expect_fault(&axis, SERVO_FINE);
	assert_true(axis.output > 0.2);
	for (int i = 1; i < 6; i++) {
		axis_move(&axis, -10 * i, 10 * i, 500);
		axis_run(&axis, 0.2);
		axis_expect_fault(&axis, SERVO_FINE);
	}
	axis_move(&axis, 0, 50, 500);
	axis_expect_fault(&axis, SERVO_FINE);
}

static void it_runs_away(void **state)
{
	struct servo_config config = axis_config;
	double took;

	(void)state;
	config.follow_least = config.follow_most = 20;
	axis_init(&axis, &config, &sim_motor_small);
	axis_enable(&axis);
	sim_motor_break(&axis.motor, SIM_MOTOR_REVERSED);
	axis.wish.position += 0.3;
	took = axis_until_fault(&axis, 1);
	axis_expect_fault(&axis, SERVO_RUNAWAY);
	assert_true(took < 0.05);
	/* in the middle of a move as well */
	sim_motor_break(&axis.motor, SIM_MOTOR_GOOD);
	axis_run(&axis, 0.5);
	expect_latched(NULL);
	cruise(100);
	sim_motor_break(&axis.motor, SIM_MOTOR_REVERSED);
	assert_true(cruise_until_fault(0.1) > 0);
	axis_expect_fault(&axis, SERVO_RUNAWAY);
}

/* It is enabled while it still turns. */
static void a_coasting_axis_is_no_runaway(void **state)
{
	struct servo_config config = axis_config;

	(void)state;
	config.follow_least = config.follow_most = 20;
	axis_init(&axis, &config, &sim_motor_small);
	for (int i = 0; i < 20; i++) {
		axis.motor.speed = 20.0 * i - 200;
		axis_step(&axis);
		axis_step(&axis);
		axis.wish.enable = false;
		axis_step(&axis);
		axis.wish.enable = true;
		axis.wish.position = axis.servo.position;
		axis_run(&axis, 0.3);
		axis_expect_fault(&axis, SERVO_FINE);
	}
}

/* With full power to and fro, and pushed: what brakes is no runaway. */
static void braking_is_no_runaway(void **state)
{
	struct servo_config config = axis_config;
	struct sim_prng prng;

	(void)state;
	config.follow_least = config.follow_most = 100;
	config.runaway_move = 0.05;
	axis_init(&axis, &config, &sim_motor_small);
	axis_enable(&axis);
	sim_prng_init(&prng, 20055);
	for (int i = 0; i < 200; i++) {
		axis.wish.velocity = 0;
		axis.wish.position = 80 * sim_prng_unit(&prng) - 40;
		axis.motor.torque = 0.1 * sim_prng_unit(&prng) - 0.05;
		axis_run(&axis, 0.02 + 0.3 * sim_prng_unit(&prng));
		axis_expect_fault(&axis, SERVO_FINE);
	}
}

static void beyond_a_soft_limit(void **state)
{
	struct servo_config config = axis_config;

	(void)state;
	config.least = -10;
	config.most = 20;
	axis_init(&axis, &config, &sim_motor_small);
	axis_enable(&axis);
	/* not homed: nobody knows where the limits are */
	axis_move(&axis, 25, 50, 500);
	axis_expect_fault(&axis, SERVO_FINE);
	axis_run(&axis, 0.2);
	axis.wish.enable = false;
	axis_step(&axis);
	assert_true(servo_place(&axis.servo, 25, true));
	axis_enable(&axis);
	/* from beyond it may return, but not go there again */
	axis_move(&axis, 22, 20, 500);
	axis_run(&axis, 0.1);
	axis_expect_fault(&axis, SERVO_FINE);
	axis.wish.position += 0.02;
	expect_at_once(SERVO_SOFT_LIMIT);
	expect_latched(NULL);
	axis_move(&axis, 20, 20, 500);
	axis_move(&axis, 19, 20, 500);
	axis_move(&axis, 20, 20, 500);
	axis_expect_fault(&axis, SERVO_FINE);
	axis.wish.position = 20.001;
	expect_at_once(SERVO_SOFT_LIMIT);
	expect_latched(NULL);
	axis_move(&axis, -10, 50, 500);
	axis_expect_fault(&axis, SERVO_FINE);
	axis.wish.position = -10.001;
	expect_at_once(SERVO_SOFT_LIMIT);
}

static void at_a_limit_switch(void **state)
{
	(void)state;
	for (int high = 0; high < 2; high++) {
		const double outwards = high ? 1 : -1;
		bool *at = high ? &axis.input.high : &axis.input.low;

		axis_init(&axis, &axis_config, &sim_motor_small);
		axis_enable(&axis);
		cruise(50 * outwards);
		*at = true;
		expect_at_once(SERVO_SWITCH);
		axis_run(&axis, 0.2);
		/* from the switch it may go, but no further onto it; its contact bounces */
		assert_true(axis_reset(&axis));
		axis_enable(&axis);
		for (int i = 0; i < 20; i++) {
			*at = i % 2;
			axis_step(&axis);
		}
		axis_expect_fault(&axis, SERVO_FINE);
		/* nor bit by bit, enabled again and again */
		axis.motor.torque = 0;
		for (int i = 0; i < 20 && !axis.servo.fault; i++) {
			axis_move(&axis, axis.servo.position + 0.45 * outwards, 20, 500);
			axis.wish.enable = false;
			axis_step(&axis);
			axis.wish.position = axis.servo.position;
			axis.wish.enable = true;
			axis_step(&axis);
		}
		axis_expect_fault(&axis, SERVO_SWITCH);
		assert_true(axis_reset(&axis));
		axis_enable(&axis);
		axis_move(&axis, axis.servo.position - 20 * outwards, 20, 500);
		axis_expect_fault(&axis, SERVO_FINE);
		*at = false;
		axis_move(&axis, axis.servo.position - outwards, 20, 500);
		*at = true;
		expect_at_once(SERVO_SWITCH);
		assert_true(axis_reset(&axis));
		axis_enable(&axis);
		axis_move(&axis, axis.servo.position + 2 * outwards, 20, 500);
		axis_expect_fault(&axis, SERVO_SWITCH);
		/* not even by what may be between a position and the command for it */
		assert_true(axis_reset(&axis));
		axis.wish.enable = false;
		axis_run(&axis, 0.2);
		axis.wish.position = axis.servo.position + 0.4 * outwards;
		axis.wish.enable = true;
		expect_at_once(SERVO_SWITCH);
	}
}

static double any(struct sim_prng *prng)
{
	static const double odd[] = { NAN, INFINITY, -INFINITY, 1e300, -1e300, 0 };

	if (sim_prng_unit(prng) < 0.02)
		return odd[(unsigned int)(sim_prng_unit(prng) * 6)];
	return 2 * sim_prng_unit(prng) - 1;
}

/* What is wrong in this cycle is wrong in its output. */
static void an_output_only_while_nothing_is_wrong(void **state)
{
	struct sim_prng prng;
	unsigned int enabled = 0, silent = 0, faults[SERVO_FAULTS] = { 0 };

	(void)state;
	axis_init(&axis, &axis_config, &sim_motor_small);
	sim_prng_init(&prng, 20055);
	for (int i = 0; i < 400000; i++) {
		const double dice = sim_prng_unit(&prng);
		const bool was_enabled = axis.servo.enabled;

		axis.input.usable = dice > 0.001;
		axis.input.emergency = dice > 0.001 && dice < 0.0015;
		axis.input.heater = dice > 0.0015 && dice < 0.002;
		axis.input.low = dice > 0.002 && dice < 0.0025;
		axis.input.high = dice > 0.0025 && dice < 0.003;
		silent = dice > 0.003 && dice < 0.004 ? 10 : silent ? silent - 1 : 0;
		axis.silent = silent;
		axis.motor.counted += dice > 0.01 && dice < 0.0105 ? 1e4 * any(&prng) : 0;
		if (isnan(axis.motor.counted) || fabs(axis.motor.counted) > 1e9)
			axis.motor.counted = 0;
		axis.motor.torque = 0.05 * sim_prng_unit(&prng);
		axis.wish.alive = !(dice > 0.011 && dice < 0.012);
		axis.wish.enable = !(dice > 0.012 && dice < 0.05);
		if (!axis.wish.enable || !isfinite(axis.wish.position) ||
		    fabs(axis.wish.position) > 1e9)
			axis.wish.position = axis.servo.position;
		axis.wish.position += 0.05 * any(&prng);
		axis.wish.velocity = 10 * any(&prng); /* sometimes none */
		if (dice > 0.99)
			axis_reset(&axis);
		if (dice > 0.98 && dice < 0.985)
			axis.count_ns += (uint64_t)(1e6 * any(&prng));
		axis.input.epoch += dice > 0.985 && dice < 0.9852;
		axis_step(&axis);
		assert_true(fabs(axis.output) <= 1);
		if (axis.servo.fault || axis.servo.condition || !axis.wish.enable ||
		    !axis.wish.alive || !axis.input.usable || axis.input.emergency ||
		    axis.input.heater || !isfinite(axis.wish.position))
			assert_true(axis.output == 0 && !axis.servo.enabled);
		enabled += axis.servo.enabled;
		faults[axis.servo.fault] += was_enabled && !axis.servo.enabled;
	}
	assert_true(enabled > 20000);
	for (int i = SERVO_DEVICE; i <= SERVO_FOLLOWING; i++) {
		if (!faults[i])
			fail_msg("fault %d did not occur", i);
	}
}

/* Whoever gives no speed has none for a jump: it is an error at once. */
static void a_jump_of_the_command_is_found_at_once(void **state)
{
	(void)state;
	axis_init(&axis, &axis_config, &sim_motor_small);
	axis_enable(&axis);
	axis.wish.velocity = NAN;
	for (int i = 0; i < 100; i++) {
		axis.wish.position += 0.05;
		axis_step(&axis);
	}
	axis_expect_fault(&axis, SERVO_FINE);
	axis.wish.position += 20;
	axis_step(&axis);
	axis_expect_fault(&axis, SERVO_FOLLOWING);
	assert_true(axis.output == 0);
}

/* What has braked it is gone when it stands, and there is nothing to be counted. */
static void one_that_brakes_hard_is_not_silent(void **state)
{
	const struct sim_motor_config motor = {
		.volts = 36,
		.ohm = 4,
		.constant = 0.05,
		.inertia = 2.5e-4,
		.viscous = 1e-5,
		.friction = 0.03,
		.counts = 1312,
	};
	struct servo_config config = axis_config;

	(void)state;
	config.scale = motor.counts / 5;
	config.gains = (struct servo_gains){
		.p = 0.19, .i = 0.31, .d = 0.019, .velocity = 0.00175, .acceleration = 0.0007
	};
	config.follow_least = 2;
	config.follow_most = 10;
	for (double way = 80; way < 120; way++) {
		axis_init(&axis, &config, &motor);
		axis_enable(&axis);
		axis_move(&axis, way, 190, 560);
		axis_run(&axis, 1);
		axis_expect_fault(&axis, SERVO_FINE);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_jump_of_the_command_is_found_at_once),
		cmocka_unit_test(one_that_brakes_hard_is_not_silent),
		cmocka_unit_test_setup(the_device_is_lost, begin),
		cmocka_unit_test_setup(readings_are_old, begin),
		cmocka_unit_test_setup(it_was_not_called_for_a_while, begin),
		cmocka_unit_test(what_stops_it_from_outside),
		cmocka_unit_test_setup(the_encoder_jumps, begin),
		cmocka_unit_test_setup(the_command_is_no_number, begin),
		cmocka_unit_test_setup(it_cannot_follow, begin),
		cmocka_unit_test(it_is_stalled),
		cmocka_unit_test(the_encoder_falls_silent),
		cmocka_unit_test_setup(a_weight_is_held_and_let_down, begin),
		cmocka_unit_test(it_runs_away),
		cmocka_unit_test(a_coasting_axis_is_no_runaway),
		cmocka_unit_test(braking_is_no_runaway),
		cmocka_unit_test(beyond_a_soft_limit),
		cmocka_unit_test(at_a_limit_switch),
		cmocka_unit_test(an_output_only_while_nothing_is_wrong),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
