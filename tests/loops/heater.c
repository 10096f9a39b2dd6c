/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A heater reaches its target and stays there: hot end and bed, PID and bang-bang, steps, a fan
 * that begins to blow, other gains; and what it takes as a target.
 */
#include "tests/loops/oven.h"

#include <math.h>
#include <string.h>

static struct heater_config bed(void)
{
	struct heater_config config = heater_usual;

	config.most = 130;
	config.target_most = 120;
	/* 70, 10 and 200 of 255 would be for a stiffer one */
	config.gains = (struct pid_gains){ .p = 0.27, .i = 0.004, .d = 0.8, .smooth = 0.5 };
	return config;
}

static void a_hot_end_gets_hot_and_stays(void **state)
{
	struct oven oven;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven.target = 200;
	oven_run(&oven, 300);
	oven_expect_fault(&oven, HEATER_FINE);
	assert_true(oven.most < 215); /* overshoot */
	assert_true(heater_is_at(&oven.heater, 1));
	oven_mark(&oven);
	oven_run(&oven, 600);
	assert_true(oven.most < 201 && oven.least > 199);
	/* what it loses is what it gets */
	assert_true(fabs(oven.energy / 600 - 0.075 * (200 - 22)) < 0.5);
	/* a fan begins to blow, and ends */
	oven.fan = true;
	oven_run(&oven, 300);
	oven_expect_fault(&oven, HEATER_FINE);
	assert_true(oven.least > 190 && heater_is_at(&oven.heater, 1));
	oven.fan = false;
	oven_run(&oven, 300);
	assert_true(oven.most < 210 && heater_is_at(&oven.heater, 1));
	/* to another target, and off */
	oven.target = 250;
	oven_run(&oven, 300);
	assert_true(heater_is_at(&oven.heater, 1));
	oven.target = 150;
	oven_run(&oven, 400);
	assert_true(heater_is_at(&oven.heater, 1));
	oven.target = 0;
	oven_step(&oven);
	assert_true(oven.power == 0 && !heater_is_at(&oven.heater, 1000));
	oven_run(&oven, 2000);
	oven_expect_fault(&oven, HEATER_FINE);
	assert_true(oven.heater.temperature < 25);
}

static void a_bed_gets_warm_and_stays(void **state)
{
	const struct heater_config config = bed();
	struct oven oven;

	(void)state;
	oven_init(&oven, &config, &sim_heat_bed);
	oven.target = 100;
	oven_run(&oven, 900);
	oven_expect_fault(&oven, HEATER_FINE);
	assert_true(oven.most < 106 && heater_is_at(&oven.heater, 1));
	oven_mark(&oven);
	oven_run(&oven, 1800);
	assert_true(oven.most < 101 && oven.least > 99);
}

static void bang_bang_stays_within_its_hysteresis_and_the_delay(void **state)
{
	struct heater_config config = bed();
	struct oven oven;

	(void)state;
	config.law = HEATER_BANG_BANG;
	oven_init(&oven, &config, &sim_heat_bed);
	oven.target = 80;
	oven_run(&oven, 600);
	oven_mark(&oven);
	for (int i = 0; i < 10000; i++) {
		oven_step(&oven);
		assert_true(oven.power == 0 || oven.power == 1);
	}
	oven_expect_fault(&oven, HEATER_FINE);
	assert_true(oven.most < 84 && oven.least > 77);
}

static void power_has_a_limit(void **state)
{
	struct heater_config config = heater_usual;
	struct oven oven;

	(void)state;
	config.power_most = 0.6;
	oven_init(&oven, &config, &sim_heat_hotend);
	oven.target = 150;
	for (int i = 0; i < 5000; i++) {
		oven_step(&oven);
		assert_true(oven.power >= 0 && oven.power <= 0.6);
	}
	oven_expect_fault(&oven, HEATER_FINE);
	assert_true(heater_is_at(&oven.heater, 1));
}

static void other_gains_make_no_jump(void **state)
{
	static const struct pid_gains nothing = { .p = 0, .i = 0 };
	static const struct pid_gains other = { .p = 0.03, .i = 0.001, .d = 0.1, .smooth = 1 };
	static const struct pid_gains bad[] = {
		{ .p = NAN },
		{ .i = INFINITY },
		{ .d = -1 },
		{ .smooth = -1 },
	};
	struct oven oven;
	double before;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	/* without noise, so that a jump is one of the gains */
	oven.heat.config.noise = 0;
	oven.target = 200;
	for (int seconds = 10; seconds < 120; seconds += 10) {
		oven_run(&oven, 10);
		before = oven.power;
		assert_true(heater_regain(&oven.heater,
					  seconds % 20 ? &other : &heater_usual.gains));
		/* more than all of it, or less than nothing, the integral cannot make up for */
		const bool can = oven.heater.pid.integral > 0 && oven.heater.pid.integral < 1;

		oven_step(&oven);
		if (can && before > 0 && before < 1 && fabs(oven.power - before) > 0.12)
			fail_msg("after %d s: from %g to %g", seconds, before, oven.power);
	}
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
		assert_false(heater_regain(&oven.heater, &bad[i]));
	assert_true(oven.heater.config.gains.p == heater_usual.gains.p ||
		    oven.heater.config.gains.p == other.p);
	oven_run(&oven, 300);
	assert_true(heater_is_at(&oven.heater, 1));
	assert_false(heater_regain(&oven.heater, &nothing));
	/* while the power is at its limit, the integral is not filled with what was cut off */
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven.target = 200;
	oven_run(&oven, 10);
	assert_true(oven.power == 1 && heater_regain(&oven.heater, &other));
	oven_run(&oven, 300);
	assert_true(oven.most < 209);
}

/* What an integral held, nothing would take back. */
static void without_an_integral_gain_nothing_is_held(void **state)
{
	const struct pid_gains none = { .p = 0.1, .i = 0, .d = 0, .smooth = 1 };
	struct oven oven;
	double before;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven.heat.config.noise = 0;
	oven_warm(&oven, 200);
	before = oven.power;
	assert_true(before > 0.1 && heater_regain(&oven.heater, &none));
	oven_step(&oven);
	assert_true(fabs(oven.power - before) < 0.02);
	oven_run(&oven, 600);
	oven_expect_fault(&oven, HEATER_FINE);
	assert_true(fabs(oven.power - none.p * (200 - oven.heater.temperature)) < 0.001);
	/* and back: it goes on from there */
	before = oven.power;
	assert_true(heater_regain(&oven.heater, &heater_usual.gains));
	oven_step(&oven);
	assert_true(fabs(oven.power - before) < 0.05);
	oven_run(&oven, 600);
	assert_true(heater_is_at(&oven.heater, 1));
}

static void a_target_that_cannot_be_is_refused_and_the_old_one_stays(void **state)
{
	static const double bad[] = { -1, 266, 1e300, INFINITY, -INFINITY, NAN };
	struct oven oven;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven_warm(&oven, 200);
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		oven.target = bad[i];
		oven_run(&oven, 1);
		assert_int_equal(oven.heater.refusal, HEATER_OUT_OF_RANGE);
		assert_true(oven.heater.target == 200 && heater_is_at(&oven.heater, 2));
	}
	oven.target = 265;
	oven_step(&oven);
	assert_int_equal(oven.heater.refusal, HEATER_TAKEN);
	assert_true(oven.heater.target == 265);
}

static void what_is_not_ready_is_not_switched_on_and_is_no_fault(void **state)
{
	struct oven oven;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven.device = false;
	oven_run(&oven, 1);
	oven.target = 100;
	oven_run(&oven, 10);
	oven_expect_fault(&oven, HEATER_FINE);
	assert_int_equal(oven.heater.condition, HEATER_DEVICE);
	assert_int_equal(oven.heater.refusal, HEATER_NOT_READY);
	assert_true(oven.power == 0);
	/* when the device is there, it does not begin by itself: who has commanded it may be gone
	 */
	oven.device = true;
	oven_run(&oven, 10);
	assert_int_equal(oven.heater.refusal, HEATER_NOT_READY);
	assert_true(oven.power == 0);
	oven.target = 101;
	oven_step(&oven);
	assert_int_equal(oven.heater.refusal, HEATER_TAKEN);
	assert_true(oven.power > 0);
}

static void a_target_of_before_its_start_is_not_taken(void **state)
{
	struct heater heater;
	uint64_t now_ns = 1000000000;

	(void)state;
	assert_null(heater_init(&heater, &heater_usual));
	for (int i = 0; i < 100; i++, now_ns += HEATER_PERIOD_NS) {
		heater_sample(&heater, 0.9, now_ns);
		heater_device(&heater, true);
		heater_commander(&heater, true, now_ns);
		assert_int_equal(heater_command(&heater, 200), HEATER_AFTER_FAULT);
		assert_true(heater_step(&heater, now_ns) == 0);
	}
}

static void nothing_is_taken_before_there_is_a_temperature(void **state)
{
	struct heater heater;

	(void)state;
	assert_null(heater_init(&heater, &heater_usual));
	assert_int_equal(heater_command(&heater, 0), HEATER_TAKEN);
	assert_int_equal(heater_command(&heater, 100), HEATER_NOT_READY);
	assert_int_equal(heater_tune(&heater, 100), HEATER_NOT_READY);
	assert_true(heater_step(&heater, 7200000000000) == 0);
}

static void who_commands_it_is_gone(void **state)
{
	struct heater_config config = heater_usual;
	struct oven oven;

	(void)state;
	for (int hold = 0; hold < 3; hold++) {
		config.lease_ns = hold == 2 ? UINT64_MAX :
				  hold      ? UINT64_C(5000000000) :
					      HEATER_PERIOD_NS;
		oven_init(&oven, &config, &sim_heat_hotend);
		oven_warm(&oven, 200);
		oven.commander = false;
		oven_step(&oven);
		assert_true(oven.heater.target == 200);
		oven_step(&oven);
		assert_true((oven.heater.target == 0) == (hold == 0));
		oven_run(&oven, 4.7);
		assert_true((oven.heater.target == 0) == (hold == 0));
		oven_run(&oven, 0.3);
		assert_true((oven.heater.target == 0) == (hold < 2));
		oven_run(&oven, 3600);
		oven_expect_fault(&oven, HEATER_FINE);
		if (hold == 2)
			continue;
		/* one that comes back with its old target has to say off first */
		oven.commander = true;
		oven_run(&oven, 10);
		assert_true(oven.power == 0 && oven.heater.target == 0);
		assert_int_equal(oven.heater.refusal, HEATER_AFTER_FAULT);
		oven.target = 0;
		oven_step(&oven);
		oven.target = 200;
		oven_step(&oven);
		assert_true(oven.power > 0);
	}
	/* nobody was ever there: not for a lease from the computer's start either */
	config.lease_ns = UINT64_C(10000000000);
	oven_init(&oven, &config, &sim_heat_hotend);
	oven.heater.commander_ns = 0;
	oven.commander = false;
	oven.target = 100;
	oven_step(&oven);
	assert_true(oven.power == 0);
}

/* The next one is there, and alive, but has not switched on what heats. */
static void who_commanded_it_is_gone_though_another_one_came(void **state)
{
	struct heater_config config = heater_usual;
	struct oven oven;

	(void)state;
	config.lease_ns = UINT64_C(60000000000);
	oven_init(&oven, &config, &sim_heat_hotend);
	oven_warm(&oven, 200);
	oven_run(&oven, 3600);
	heater_another(&oven.heater);
	oven.target = 150;
	oven_run(&oven, 59);
	assert_true(oven.heater.target == 200);
	assert_int_equal(oven.heater.refusal, HEATER_AFTER_FAULT);
	oven_run(&oven, 2);
	assert_true(oven.heater.target == 0 && oven.power == 0);
	oven_expect_fault(&oven, HEATER_FINE);
	/* who switches it off and on again commands it */
	oven.target = 0;
	oven_step(&oven);
	oven.target = 150;
	oven_run(&oven, 600);
	assert_true(heater_is_at(&oven.heater, 2));
}

/* A profile goes up in small steps, faster than it can follow and slower, with a fan or without. */
static void a_profile_is_followed(void **state)
{
	struct oven oven;

	(void)state;
	for (int tenths = 1; tenths <= 20; tenths += 3) {
		oven_init(&oven, &heater_usual, &sim_heat_hotend);
		oven.target = 30;
		while (oven.target < 240) {
			oven_run(&oven, 1);
			oven_expect_fault(&oven, HEATER_FINE);
			oven.target += tenths / 10.0;
			oven.fan = oven.target > 150 && tenths % 2;
		}
		oven_run(&oven, 300);
		oven_expect_fault(&oven, HEATER_FINE);
	}
}

/* Disturbed for one period, at any moment of the way: a motor that starts, a relay beside it. */
static void a_disturbance_is_no_fault(void **state)
{
	struct heater_config config = bed();
	struct oven oven;

	(void)state;
	for (int law = HEATER_PID; law <= HEATER_BANG_BANG; law++)
		for (int tenths = -30; tenths <= 30; tenths += 15)
			for (int seconds = 5; seconds < 250; seconds += 12) {
				config.law = (enum heater_law)law;
				oven_init(&oven, &config, &sim_heat_bed);
				oven.target = 85;
				oven_run(&oven, seconds);
				oven.heat.drifted = tenths / 10.0;
				oven_step(&oven);
				oven.heat.drifted = 0;
				oven_run(&oven, 400);
				oven_expect_fault(&oven, HEATER_FINE);
			}
}

static void a_step_that_comes_too_soon_is_none(void **state)
{
	struct oven oven;
	double before;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven_warm(&oven, 200);
	before = oven.power;
	for (int i = 1; i < 40; i++) {
		const uint64_t now_ns = oven.now_ns + (uint64_t)i * 1000000;

		heater_sample(&oven.heater, 0.05, now_ns);
		assert_true(heater_step(&oven.heater, now_ns) == before);
	}
}

static void what_was_not_delivered_has_no_effect_to_be_seen(void **state)
{
	struct heater_config config = bed();
	struct oven oven;

	(void)state;
	/* half of what it asks for: it never gets hot, and that is not its fault for long */
	oven_init(&oven, &config, &sim_heat_bed);
	oven.target = 80;
	for (int i = 0; i < 12000; i++) {
		oven_step(&oven);
		heater_available(&oven.heater, oven.power / 2);
		oven.power /= 2;
		assert_true(oven.heater.load <= 0.51);
	}
	heater_available(&oven.heater, NAN);
	heater_available(&oven.heater, 2);
	assert_true(oven.heater.power <= 0.5);
}

/* The highest temperature on the way to 60 degrees and for a while there. */
static double overshoot(bool by_configuration)
{
	struct heater_config config = bed();
	struct oven oven;

	config.gains = (struct pid_gains){ .p = 0.02, .i = 0.002, .d = 0.1, .smooth = 0.5 };
	config.power_most = by_configuration ? 0.5 : 1;
	oven_init(&oven, &config, &sim_heat_bed);
	oven_run(&oven, 1);
	oven.target = 60;
	for (int i = 0; i < 20000; i++) {
		oven_step(&oven);
		heater_available(&oven.heater, 0.5);
		oven.power = oven.heater.power;
		assert_true(oven.power <= 0.5);
	}
	oven_expect_fault(&oven, HEATER_FINE);
	assert_true(fabs(oven.heat.sensor - 60) < 1);
	return oven.most - 60;
}

static void a_limit_behind_it_fills_the_integral_no_more_than_its_own(void **state)
{
	(void)state;
	assert_true(overshoot(false) < overshoot(true) + 0.2);
}

static void run_with(struct oven *oven, double available, double seconds)
{
	for (long i = lround(seconds * 10); i > 0; i--) {
		oven_step(oven);
		heater_available(&oven->heater, available);
		oven->power = oven->heater.power;
	}
}

/* It holds its target with a little less than it may have, or than it would like to have. */
static void one_that_is_warm_with_what_it_gets_is_in_order(void **state)
{
	struct heater_config config = bed();
	struct oven oven;
	double power = 0;

	(void)state;
	oven_init(&oven, &config, &sim_heat_bed);
	oven_run(&oven, 1);
	oven.target = 60;
	oven_run(&oven, 1800);
	for (int i = 0; i < 1000; i++) {
		oven_step(&oven);
		power += oven.power / 1000;
	}
	for (double part = 1.02; part < 1.2; part += 0.02) {
		run_with(&oven, power * part, 300);
		oven_expect_fault(&oven, HEATER_FINE);
		assert_true(fabs(oven.heat.sensor - 60) < 1);
	}
}

/* It was allowed not to rise: another heater had the power. */
static void with_all_of_its_power_again_it_has_time_to_rise(void **state)
{
	struct heater_config config = bed();
	struct oven oven;

	(void)state;
	config.window_ns = UINT64_C(120000000000);
	for (double seconds = 30; seconds < 115; seconds += 5) {
		oven_init(&oven, &config, &sim_heat_bed);
		oven_run(&oven, 1);
		oven.target = 100;
		while (oven.heat.sensor < 60)
			oven_step(&oven);
		assert_true(oven.heater.rise_ns[2] > 0);
		run_with(&oven, 0.2, seconds);
		oven_expect_fault(&oven, HEATER_FINE);
		oven_run(&oven, 60);
		oven_expect_fault(&oven, HEATER_FINE);
	}
}

/* Its supply is shared with something that is switched on and off all the time. */
static void a_power_that_comes_and_goes_hides_nothing(void **state)
{
	static const enum sim_heat_fault faults[] = { SIM_HEAT_OUT, SIM_HEAT_STUCK };
	struct heater_config config = bed();
	struct oven oven;

	(void)state;
	for (int i = 0; i < 2; i++) {
		for (double seconds = 1; seconds < 30; seconds += 3) {
			oven_init(&oven, &config, &sim_heat_bed);
			oven_run(&oven, 1);
			oven.target = 60;
			oven_run(&oven, 900);
			oven_expect_fault(&oven, HEATER_FINE);
			/* it is in the room, or stuck a little below the target */
			sim_heat_break(&oven.heat, faults[i]);
			oven.target = 62.5;
			for (double t = 0; t < 600 && !oven.heater.fault; t += 2 * seconds) {
				run_with(&oven, 0.6, seconds);
				run_with(&oven, 1, seconds);
			}
			oven_expect_fault(&oven, i ? HEATER_UNHEEDED : HEATER_FELL);
			assert_true(oven.heat.block < 130);
		}
	}
}

static void configurations_are_judged(void **state)
{
	static const struct sensor_config table = {
		.kind = SENSOR_TABLE,
		.reference = 5,
		.count = 2,
		.points = { { 0.5, 0 }, { 4.5, 270 } },
	};
	struct heater_config config;
	struct heater heater;

	(void)state;
#define REFUSES(member, value, text) \
	do { \
		config = heater_usual; \
		config.law = HEATER_BANG_BANG; \
		config.member = value; \
		if (!heater_init(&heater, &config) || \
		    !strstr(heater_init(&heater, &config), text)) \
			fail_msg(#member " = " #value ": %s", heater_init(&heater, &config)); \
	} while (0)
	assert_null(heater_init(&heater, &heater_usual));
	REFUSES(least, NAN, "min-temperature");
	REFUSES(least, 280, "min-temperature");
	REFUSES(most, INFINITY, "min-temperature");
	REFUSES(target_most, 0, "max-target");
	REFUSES(target_most, 277, "max-target");
	REFUSES(target_most, NAN, "max-target");
	REFUSES(gains.p, -1, "pid-p");
	REFUSES(gains.i, 1e9, "pid-i");
	REFUSES(gains.d, NAN, "pid-d");
	REFUSES(hysteresis, 0, "hysteresis");
	REFUSES(hysteresis, 4, "hysteresis");
	REFUSES(hysteresis, NAN, "hysteresis");
	REFUSES(power_most, 0, "max-power");
	REFUSES(power_most, 1.1, "max-power");
	REFUSES(power_most, NAN, "max-power");
	REFUSES(rate_most, 0, "max-rate");
	REFUSES(rate_most, 1e6, "max-rate");
	REFUSES(rate_most, NAN, "max-rate");
	REFUSES(slack, 0, "slack");
	REFUSES(slack, 1000, "slack");
	REFUSES(rise, NAN, "rise");
	REFUSES(rise, 0.1, "rise");
	REFUSES(window_ns, 1, "window");
	REFUSES(window_ns, UINT64_MAX, "window");
	REFUSES(stale_ns, 0, "max-age-ms");
	REFUSES(stale_ns, UINT64_MAX, "max-age-ms");
	REFUSES(lease_ns, 0, "hold-s");
	REFUSES(sensor.pull_up, 0, "pull-up");
	/* what it cannot read it cannot judge */
	REFUSES(sensor, table, "max-temperature is above");
	REFUSES(most, 100000, "max-temperature is above");
	REFUSES(least, -200, "min-temperature is below");
	config = heater_usual;
	config.gains.p = config.gains.i = 0;
	assert_non_null(heater_init(&heater, &config));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_hot_end_gets_hot_and_stays),
		cmocka_unit_test(a_bed_gets_warm_and_stays),
		cmocka_unit_test(bang_bang_stays_within_its_hysteresis_and_the_delay),
		cmocka_unit_test(power_has_a_limit),
		cmocka_unit_test(other_gains_make_no_jump),
		cmocka_unit_test(without_an_integral_gain_nothing_is_held),
		cmocka_unit_test(a_target_that_cannot_be_is_refused_and_the_old_one_stays),
		cmocka_unit_test(what_is_not_ready_is_not_switched_on_and_is_no_fault),
		cmocka_unit_test(a_target_of_before_its_start_is_not_taken),
		cmocka_unit_test(nothing_is_taken_before_there_is_a_temperature),
		cmocka_unit_test(who_commands_it_is_gone),
		cmocka_unit_test(who_commanded_it_is_gone_though_another_one_came),
		cmocka_unit_test(a_profile_is_followed),
		cmocka_unit_test(a_disturbance_is_no_fault),
		cmocka_unit_test(a_step_that_comes_too_soon_is_none),
		cmocka_unit_test(what_was_not_delivered_has_no_effect_to_be_seen),
		cmocka_unit_test(a_limit_behind_it_fills_the_integral_no_more_than_its_own),
		cmocka_unit_test(one_that_is_warm_with_what_it_gets_is_in_order),
		cmocka_unit_test(with_all_of_its_power_again_it_has_time_to_rise),
		cmocka_unit_test(a_power_that_comes_and_goes_hides_nothing),
		cmocka_unit_test(configurations_are_judged),
	};

	return cmocka_run_group_tests_name("heater", tests, NULL, NULL);
}
