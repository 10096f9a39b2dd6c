/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The velocity estimator against motions whose velocity is known: the bounds
 * are what a machinist would see on a gauge. Samples come every millisecond,
 * their stamps are wrong by up to 50 us either way, from a seeded generator.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "halbridge/velocity.h"

#define MS	1000000

static uint32_t seed;

static double uniform(void)
{
	seed = seed * 1664525u + 1013904223u;
	return (seed >> 8) / 16777216.0;
}

/* One sample of x(t) counts at about millisecond k; the stamp is a bit off. */
static double sample(struct velocity *v, double (*x)(double), int k, double jitter_us)
{
	double t = k * 1e-3 + (uniform() - 0.5) * jitter_us * 1e-6;
	int64_t count = (int64_t)floor(x(t));

	return velocity_sample(v, count, 1000000000u + (uint64_t)k * MS);
}

static double speed;

static double steady(double t)
{
	return 0.3 + speed * t;
}

/* Worst and mean square relative error from `from` ms to `to` ms of steady motion. */
static void steady_error(double counts_per_second, double jitter_us, double *worst, double *rms)
{
	struct velocity v = { 0 };
	double sum = 0;

	speed = counts_per_second;
	*worst = 0;
	for (int k = 0; k < 12000; k++) {
		double error = fabs(sample(&v, steady, k, jitter_us) / counts_per_second - 1);

		if (k < 6000)
			continue;
		*worst = fmax(*worst, error);
		sum += error * error;
	}
	*rms = sqrt(sum / 6000);
}

static void low_speed_is_smooth(void **state)
{
	static const double speeds[] = { 3, 10, 47.3, 100, 333, -10, -100 };
	double worst, rms;

	(void)state;
	for (size_t i = 0; i < sizeof(speeds) / sizeof(speeds[0]); i++) {
		steady_error(speeds[i], 100, &worst, &rms);
		if (worst > 0.06 || rms > 0.02)
			fail_msg("at %g counts/s: worst %g, rms %g", speeds[i], worst, rms);
	}
}

static void about_one_count_per_sample_is_smooth(void **state)
{
	double worst, rms;

	(void)state;
	for (speed = 600; speed < 2500; speed += 37) {
		steady_error(speed, 100, &worst, &rms);
		if (worst > 0.1 || rms > 0.04)
			fail_msg("at %g counts/s: worst %g, rms %g", speed, worst, rms);
	}
}

static void jitter_of_the_stamps_is_averaged(void **state)
{
	static const double speeds[] = { 33333, 1e5, 1e6, -1e6 };
	double worst, rms;

	(void)state;
	for (size_t i = 0; i < sizeof(speeds) / sizeof(speeds[0]); i++) {
		steady_error(speeds[i], 100, &worst, &rms);
		if (worst > 0.01 || rms > 0.004)
			fail_msg("at %g counts/s: worst %g, rms %g", speeds[i], worst, rms);
	}
}

static double ramp(double t)
{
	return t < 0 ? 0 : 250000 * t * t; /* 500000 counts/s^2 */
}

static void acceleration_is_followed_within_a_few_samples(void **state)
{
	struct velocity v = { 0 };

	(void)state;
	for (int k = 0; k < 400; k++) {
		double rate = sample(&v, ramp, k, 50);

		/* never further behind than 12 ms of acceleration */
		if (k > 20 && fabs(rate - 500.0 * k) > 12 * 500.0)
			fail_msg("at %d ms: %g instead of %g", k, rate, 500.0 * k);
	}
}

static void standing_still_is_zero(void **state)
{
	struct velocity v = { 0 };

	(void)state;
	for (int k = 0; k < 2000; k++)
		assert_true(velocity_sample(&v, 12345, 1000000000u + (uint64_t)k * MS) == 0);
}

static void an_encoder_on_an_edge_stands(void **state)
{
	struct velocity v = { 0 };
	double rate = 1;

	(void)state;
	for (int k = 0; k < 2000; k++)
		rate = velocity_sample(&v, 77 + (k / 3) % 2, 1000000000u + (uint64_t)k * MS);
	assert_true(fabs(rate) < 1e-9);
}

static void stop_is_seen_at_once_and_ends_at_zero(void **state)
{
	struct velocity v = { 0 };
	int64_t count = 0;
	double rate = 0;
	int k = 0;

	(void)state;
	for (; k < 100; k++)
		rate = velocity_sample(&v, count += 100, 1000000000u + (uint64_t)k * MS);
	assert_true(fabs(rate - 100000) < 100);
	for (int after = 1; after < 700; after++, k++) {
		rate = velocity_sample(&v, count, 1000000000u + (uint64_t)k * MS);
		/* in so many ms not one count */
		if (after > 1 && rate > 1000.0 / (after - 1.2) + 1e-6)
			fail_msg("%d ms after the stop still %g", after, rate);
	}
	assert_true(rate == 0);
}

static void reversal_changes_the_sign(void **state)
{
	struct velocity v = { 0 };
	int64_t count = 0;
	double rate = 0;
	int k = 0;

	(void)state;
	for (; k < 50; k++)
		rate = velocity_sample(&v, count += 20, 1000000000u + (uint64_t)k * MS);
	assert_true(rate > 19000);
	for (; k < 60; k++)
		rate = velocity_sample(&v, count -= 20, 1000000000u + (uint64_t)k * MS);
	assert_true(rate < -19000);
}

static void a_rebase_keeps_the_rate(void **state)
{
	struct velocity v = { 0 };
	double rate = 0;
	int k = 0;

	(void)state;
	for (; k < 100; k++)
		rate = velocity_sample(&v, 50 * k, 1000000000u + (uint64_t)k * MS);
	velocity_rebase(&v, 0, 1000000000u + (uint64_t)k * MS);
	for (int n = 1; n < 50; n++) {
		rate = velocity_sample(&v, 50 * n, 1000000000u + (uint64_t)(k + n) * MS);
		if (fabs(rate - 50000) > 500)
			fail_msg("%d ms after the rebase: %g", n, rate);
	}
}

static void old_and_repeated_samples_change_nothing(void **state)
{
	struct velocity v = { 0 };
	double rate = 0;

	(void)state;
	for (int k = 0; k < 100; k++)
		rate = velocity_sample(&v, 50 * k, 1000000000u + (uint64_t)k * MS);
	assert_true(velocity_sample(&v, -999999, 1000000000u + 99 * MS) == rate);
	assert_true(velocity_sample(&v, -999999, 5) == rate);
}

static void a_gap_in_the_data_does_not_invent_a_velocity(void **state)
{
	struct velocity v = { 0 };

	(void)state;
	for (int k = 0; k < 100; k++)
		velocity_sample(&v, 50 * k, 1000000000u + (uint64_t)k * MS);
	assert_true(velocity_sample(&v, 10000000, 3000000000u) == 0);
}

static void nothing_makes_it_infinite(void **state)
{
	struct velocity v = { 0 };
	uint64_t t = 1;

	(void)state;
	for (int k = 0; k < 200000; k++) {
		int64_t count = (int64_t)((uniform() - 0.5) * (uniform() < 0.1 ? 1e18 : 10));

		t += (uint64_t)(uniform() * (uniform() < 0.1 ? 1e18 : 3)) % 400000000u;
		assert_true(isfinite(velocity_sample(&v, count, t)));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(low_speed_is_smooth),
		cmocka_unit_test(about_one_count_per_sample_is_smooth),
		cmocka_unit_test(jitter_of_the_stamps_is_averaged),
		cmocka_unit_test(acceleration_is_followed_within_a_few_samples),
		cmocka_unit_test(standing_still_is_zero),
		cmocka_unit_test(an_encoder_on_an_edge_stands),
		cmocka_unit_test(stop_is_seen_at_once_and_ends_at_zero),
		cmocka_unit_test(reversal_changes_the_sign),
		cmocka_unit_test(a_rebase_keeps_the_rate),
		cmocka_unit_test(old_and_repeated_samples_change_nothing),
		cmocka_unit_test(a_gap_in_the_data_does_not_invent_a_velocity),
		cmocka_unit_test(nothing_makes_it_infinite),
	};
	const char *given = getenv("POKEYS_SEED");

	seed = given ? (uint32_t)strtoul(given, NULL, 0) : 20240611;
	printf("POKEYS_SEED=%u\n", seed);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
