/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs: a relay gives the mean power in pulses that are not too short, and is off at once when
 * it has to be; several heaters do not overload their supply; a fan runs when it may be hot.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <cmocka.h>
#include "daemon/loops/pid.h"
#include "daemon/loops/power.h"
#include "daemon/loops/switching.h"
#include "sim/prng.h"

#define MS UINT64_C(1000000)

static void a_relay_gives_the_mean_in_long_pulses(void **state)
{
	(void)state;
	for (int percent = 0; percent <= 100; percent += 5) {
		struct switching output = { .least_ns = 1000 * MS };
		uint64_t now = 1000 * MS, changed = 0, on = 0;
		bool before = false;

		for (int i = 0; i < 100000; i++, now += 100 * MS) {
			const bool is = switching_step(&output, percent / 100.0, false, now);

			if (is != before) {
				assert_true(!changed || now - changed >= 1000 * MS);
				changed = now;
				before = is;
			}
			on += is;
		}
		assert_true(fabs((double)on / 1000 - percent) < 0.2);
	}
}

/* One that is slower than a step changes at each step at most, and keeps the mean. */
static void a_fast_output_keeps_the_mean_too(void **state)
{
	(void)state;
	for (int least_ms = 0; least_ms <= 400; least_ms += 20)
		for (int percent = 10; percent < 100; percent += 20) {
			struct switching output = { .least_ns = (uint64_t)least_ms * MS };
			uint64_t now = 1000 * MS, on = 0;

			for (int i = 0; i < 10000; i++, now += 100 * MS)
				on += switching_step(&output, percent / 100.0, false, now);
			assert_true(fabs((double)on / 100 - percent) < 0.2);
		}
}

static void a_relay_is_off_at_once_and_owes_nothing(void **state)
{
	struct switching output = { .least_ns = 5000 * MS };
	uint64_t now = 1000 * MS;

	(void)state;
	while (!switching_step(&output, 1, false, now))
		now += 100 * MS;
	now += 100 * MS;
	assert_false(switching_step(&output, 1, true, now));
	assert_true(output.owed == 0);
	/* not for a moment, while the stop lasts */
	for (int i = 0; i < 1000; i++, now += 100 * MS)
		assert_false(switching_step(&output, 1, true, now));
}

static double seconds_on(struct switching *output, double power, uint64_t now)
{
	double on = 0;

	for (int i = 0; i < 3000; i++, now += 100 * MS)
		on += 0.1 * switching_step(output, power, false, now);
	return on;
}

/* Its controller has been at a limit, as one that switches is all the time. */
static void a_relay_follows_full_power_and_none_as_soon_as_it_may(void **state)
{
	const uint64_t least = 60000 * MS, began = 1000 * MS;
	struct switching output = { .least_ns = least };
	uint64_t now = began;

	(void)state;
	for (; now < began + 10 * least; now += 100 * MS)
		assert_true(switching_step(&output, 1, false, now));
	/* it has been on for longer than it has to */
	assert_false(switching_step(&output, 0, false, now));
	/* but no change is sooner than it may be */
	for (now += 100 * MS; now < began + 11 * least; now += 100 * MS)
		assert_false(switching_step(&output, 1, false, now));
	assert_true(switching_step(&output, 1, false, now));
	assert_true(fabs(seconds_on(&output, 0, now + 100 * MS) - 60) < 0.2);
}

/* A controller that comes from full power asks for a little less, now and then. */
static void a_relay_loses_nothing_near_full_power(void **state)
{
	const uint64_t least = 60000 * MS;
	struct switching output = { .least_ns = least };
	double on = 0, wanted = 0;
	struct sim_prng prng;
	uint64_t now = 1000 * MS;

	(void)state;
	sim_prng_init(&prng, 20055);
	for (int i = 0; i < 36000; i++, now += 100 * MS) {
		const double power = fmin(1, 0.97 + 0.06 * sim_prng_unit(&prng));

		wanted += power;
		on += switching_step(&output, power, false, now);
	}
	assert_true(on > 0.97 * wanted);
	/* and has soon got what it does not want any more */
	assert_true(seconds_on(&output, 0.5, now) < 160 + 60);
}

static void a_supply_is_not_overloaded(void **state)
{
	static const double watts[] = { 40, 250, 0 };
	double power[] = { 1, 1, 1 };

	(void)state;
	assert_true(power_limit(power, watts, 3, 300) == 1);
	assert_true(fabs(power_limit(power, watts, 3, 145) - 0.5) < 1e-12);
	assert_true(power_limit(power, watts, 3, 0) == 0);
	assert_true(power_limit(power, watts, 3, -1) == 0);
	assert_true(power_limit(power, watts, 3, NAN) == 0);
	/* one that asks for less than the others may have gets it; the others share the rest */
	power[0] = 0.4;
	assert_true(fabs(power_limit(power, watts, 3, 141) - 0.5) < 1e-12);
	power[1] = 0.2;
	assert_true(power_limit(power, watts, 3, 141) == 1);
	/* what is no power takes nothing from the others */
	power[1] = NAN;
	power[2] = -1;
	assert_true(power_limit(power, watts, 3, 20) == 1);
}

/* Whatever they ask for: no more than there is, and nothing is left while one does not get all. */
static void any_supply_is_used_and_not_overloaded(void **state)
{
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, 20055);
	for (int round = 0; round < 100000; round++) {
		double power[7], watts[7], given = 0, wanted = 0, limit;
		const double most = 1000 * sim_prng_unit(&prng);

		for (int i = 0; i < 7; i++) {
			power[i] = sim_prng_unit(&prng);
			watts[i] = 1 + 300 * sim_prng_unit(&prng);
			wanted += power[i] * watts[i];
		}
		limit = power_limit(power, watts, 7, most);
		for (int i = 0; i < 7; i++)
			given += fmin(power[i], limit) * watts[i];
		assert_true(fabs(given - fmin(wanted, most)) < 1e-6);
	}
}

static void a_fan_runs_when_it_may_be_hot(void **state)
{
	static const struct fan_config config = { .above = 50, .hysteresis = 5 };

	(void)state;
	assert_false(fan_step(&config, false, 49));
	assert_true(fan_step(&config, false, 51));
	assert_true(fan_step(&config, true, 46));
	assert_false(fan_step(&config, false, 46));
	assert_false(fan_step(&config, true, 44));
	assert_true(fan_step(&config, false, NAN));
}

static void an_integral_is_not_filled_at_a_limit(void **state)
{
	static const struct pid_gains gains = { .p = 0.1, .i = 0.1, .d = 0, .smooth = 1 };
	struct pid pid;
	double output = 0;

	(void)state;
	pid_reset(&pid);
	for (int i = 0; i < 10000; i++)
		output = pid_step(&pid, &gains, 100, 0, 0.1, 0, 1);
	assert_true(output == 1 && pid.integral <= 1);
	/* it comes from the limit as soon as the error is gone, and not minutes later */
	for (int i = 0; i < 20; i++)
		output = pid_step(&pid, &gains, 100, 105, 0.1, 0, 1);
	assert_true(output < 1);
	for (int i = 0; i < 10000; i++)
		output = pid_step(&pid, &gains, 100, 200, 0.1, 0, 1);
	assert_true(output == 0 && pid.integral >= 0);
	output = pid_step(&pid, &gains, 100, 95, 0.1, 0, 1);
	assert_true(output > 0);
}

static void a_new_target_makes_no_kick_of_the_derivative(void **state)
{
	static const struct pid_gains gains = { .p = 0, .i = 0, .d = 10, .smooth = 0 };
	struct pid pid;

	(void)state;
	pid_reset(&pid);
	for (int i = 0; i < 10; i++)
		assert_true(pid_step(&pid, &gains, i * 100, 20, 0.1, -1, 1) == 0);
	assert_true(pid_step(&pid, &gains, 0, 21, 0.1, -1000, 1000) == -100);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_relay_gives_the_mean_in_long_pulses),
		cmocka_unit_test(a_fast_output_keeps_the_mean_too),
		cmocka_unit_test(a_relay_is_off_at_once_and_owes_nothing),
		cmocka_unit_test(a_relay_follows_full_power_and_none_as_soon_as_it_may),
		cmocka_unit_test(a_relay_loses_nothing_near_full_power),
		cmocka_unit_test(a_supply_is_not_overloaded),
		cmocka_unit_test(any_supply_is_used_and_not_overloaded),
		cmocka_unit_test(a_fan_runs_when_it_may_be_hot),
		cmocka_unit_test(an_integral_is_not_filled_at_a_limit),
		cmocka_unit_test(a_new_target_makes_no_kick_of_the_derivative),
	};

	return cmocka_run_group_tests_name("output", tests, NULL, NULL);
}
