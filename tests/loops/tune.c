/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A heater finds gains with which it is calm, whatever it heats: a hundred plants at random, from
 * a nozzle to an oven.
 */
#include "tests/loops/oven.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void commanded(struct oven *oven, double target)
{
	oven->target = 0;
	oven_run(oven, 0.2);
	oven->target = target;
	oven_step(oven);
	assert_int_equal(oven->heater.refusal, HEATER_TAKEN);
}

static void tunes(struct oven *oven, double target)
{
	assert_int_equal(heater_tune(&oven->heater, target), HEATER_TAKEN);
	for (int i = 0; i < 40000 && oven->heater.tune.state == TUNE_RUNS; i++)
		oven_step(oven);
	oven_expect_fault(oven, HEATER_FINE);
	if (oven->heater.tune.state != TUNE_DONE)
		fail_msg("it ended as %d after %g s, in cycle %u: %g W, %g K/s, %g W/K, delay %g "
			 "s, lag %g s, to %g",
			 (int)oven->heater.tune.state,
			 (double)(oven->now_ns - oven->heater.tune.begun_ns) / 1e9,
			 oven->heater.tune.cycles, oven->heat.config.watts,
			 oven->heat.config.watts / oven->heat.config.capacity,
			 oven->heat.config.loss, oven->heat.config.delay_s, oven->heat.config.lag_s,
			 target);
	assert_true(oven->power == 0 && oven->heater.target == 0);
}

static void a_hot_end_and_a_bed_find_their_gains(void **state)
{
	struct heater_config config = heater_usual;
	struct oven oven;

	(void)state;
	for (int bed = 0; bed < 2; bed++) {
		const double target = bed ? 90 : 210;

		/* what it has is of no use to it */
		config.gains = (struct pid_gains){ .p = 1, .i = 1 };
		oven_init(&oven, &config, bed ? &sim_heat_bed : &sim_heat_hotend);
		tunes(&oven, target);
		printf("%s: p %.4g i %.4g d %.4g, period %.3g s, height %.3g K\n",
		       bed ? "bed" : "hot end", oven.heater.tune.gains.p, oven.heater.tune.gains.i,
		       oven.heater.tune.gains.d, oven.heater.tune.period, oven.heater.tune.height);
		assert_true(heater_regain(&oven.heater, &oven.heater.tune.gains));
		oven_run(&oven, 1800);
		commanded(&oven, target);
		oven_mark(&oven);
		oven_run(&oven, 900);
		assert_true(oven.most < target + 8);
		oven_mark(&oven);
		oven_run(&oven, 600);
		oven_expect_fault(&oven, HEATER_FINE);
		assert_true(oven.most < target + 1 && oven.least > target - 1);
	}
}

/* Search with so much power until two oscillations are over, and with another one from then on. */
static enum heater_tuning searched(struct oven *oven, double most, double first, double then)
{
	struct heater_config config = heater_usual;

	config.power_most = most;
	oven_init(oven, &config, &sim_heat_hotend);
	oven_run(oven, 1);
	assert_int_equal(heater_tune(&oven->heater, 180), HEATER_TAKEN);
	for (int i = 0; i < 40000 && oven->heater.tune.state == TUNE_RUNS; i++) {
		oven_step(oven);
		heater_available(&oven->heater, oven->heater.tune.cycles < 2 ? first : then);
		oven->power = oven->heater.power;
	}
	return oven->heater.tune.state;
}

static void what_it_finds_is_for_the_power_that_it_got(void **state)
{
	struct oven oven;
	double expected;

	(void)state;
	assert_int_equal(searched(&oven, 0.5, 1, 1), TUNE_DONE);
	expected = oven.heater.tune.gains.p;
	assert_int_equal(searched(&oven, 1, 0.5, 0.5), TUNE_DONE);
	assert_true(fabs(oven.heater.tune.gains.p - expected) < expected * 0.02);
	/* what it got on the way there does not count */
	assert_int_equal(searched(&oven, 1, 0.7, 0.5), TUNE_DONE);
	assert_true(fabs(oven.heater.tune.gains.p - expected) < expected * 0.1);
}

static void with_a_power_that_varies_nothing_is_found(void **state)
{
	struct oven oven;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven_run(&oven, 1);
	assert_int_equal(heater_tune(&oven.heater, 180), HEATER_TAKEN);
	for (int i = 0; i < 40000 && oven.heater.tune.state == TUNE_RUNS; i++) {
		oven_step(&oven);
		heater_available(&oven.heater, i % 20 < 10 ? 0.8 : 0.6);
		oven.power = oven.heater.power;
	}
	assert_int_equal(oven.heater.tune.state, TUNE_FAILED);
	assert_true(heater_is_off(&oven.heater));
}

static void it_ends_when_it_is_told_to(void **state)
{
	struct oven oven;

	(void)state;
	/* off was commanded before, and still is: that alone ends nothing */
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven_run(&oven, 1);
	assert_int_equal(heater_tune(&oven.heater, 210), HEATER_TAKEN);
	oven_run(&oven, 20);
	assert_true(oven.power == 1);
	heater_off(&oven.heater);
	oven_step(&oven);
	assert_true(oven.power == 0 && heater_is_off(&oven.heater));
	assert_int_equal(oven.heater.tune.state, TUNE_FAILED);
	/* a fault, and a target that cannot be */
	assert_int_equal(heater_tune(&oven.heater, 300), HEATER_OUT_OF_RANGE);
	assert_int_equal(heater_tune(&oven.heater, 0), HEATER_OUT_OF_RANGE);
	assert_int_equal(heater_tune(&oven.heater, 210), HEATER_TAKEN);
	oven.device = false;
	oven_step(&oven);
	oven_expect_fault(&oven, HEATER_DEVICE);
	assert_int_equal(oven.heater.tune.state, TUNE_FAILED);
	assert_int_equal(heater_tune(&oven.heater, 210), HEATER_AFTER_FAULT);
}

/* What was measured before does not come back as a kick. */
static void a_target_that_ends_it_is_followed_from_there(void **state)
{
	struct oven oven;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven_warm(&oven, 250);
	assert_int_equal(heater_tune(&oven.heater, 100), HEATER_TAKEN);
	while (oven.heater.temperature > 102) {
		oven_step(&oven);
		assert_true(oven.power == 0);
	}
	oven.target = 90;
	for (int i = 0; i < 30; i++) {
		oven_step(&oven);
		assert_true(oven.power == 0);
	}
	oven_run(&oven, 300);
	assert_true(heater_is_at(&oven.heater, 1));
}

static double between(struct sim_prng *prng, double least, double most)
{
	return least * pow(most / least, sim_prng_unit(prng));
}

static void a_hundred_plants_at_random(void **state)
{
	const char *given = getenv("POKEYS_SEED");
	struct heater_config config = heater_usual;
	struct sim_prng prng;
	struct oven oven;

	(void)state;
	sim_prng_init(&prng, given ? strtoull(given, NULL, 0) : 20055);
	config.window_ns = UINT64_C(120000000000);
	config.gains = (struct pid_gains){ .p = 1, .i = 1 };
	for (int i = 0; i < 100; i++) {
		struct sim_heat_config heat = sim_heat_hotend;
		const double target = 60 + 140 * sim_prng_unit(&prng);

		/* 0.2 to 4 K/s at first, and so much power to spare */
		heat.watts = between(&prng, 30, 1000);
		heat.capacity = heat.watts / between(&prng, 0.2, 4);
		heat.loss = heat.watts / (target - heat.room) * (0.15 + 0.6 * sim_prng_unit(&prng));
		heat.delay_s = between(&prng, 0.2, 4);
		heat.lag_s = between(&prng, 0.2, 3);
		oven_init(&oven, &config, &heat);
		tunes(&oven, target);
		struct heater_config found = config;

		found.gains = oven.heater.tune.gains;
		oven_init(&oven, &found, &heat);
		oven.target = target;
		oven_run(&oven, 3600);
		oven_expect_fault(&oven, HEATER_FINE);
		if (oven.most > target + 15)
			fail_msg("plant %d: %g degrees above %g", i, oven.most - target, target);
		oven_mark(&oven);
		oven_run(&oven, 600);
		if (oven.most > target + 1.5 || oven.least < target - 1.5)
			fail_msg("plant %d: %g to %g degrees at %g", i, oven.least, oven.most,
				 target);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_hot_end_and_a_bed_find_their_gains),
		cmocka_unit_test(what_it_finds_is_for_the_power_that_it_got),
		cmocka_unit_test(with_a_power_that_varies_nothing_is_found),
		cmocka_unit_test(it_ends_when_it_is_told_to),
		cmocka_unit_test(a_target_that_ends_it_is_followed_from_there),
		cmocka_unit_test(a_hundred_plants_at_random),
	};

	return cmocka_run_group_tests_name("tune", tests, NULL, NULL);
}
