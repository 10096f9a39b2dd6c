// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The planner over thousands of random moves (protocol section 5.3): it ends
 * on the target, never beyond it, and brakes no harder than 1.125 times what
 * it was told. POKEYS_SEED repeats a run.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>
#include <math.h>

#include "sim/planner.h"
#include "sim/prng.h"

#define MOVES 3000
#define RETARGETED 1500
#define SLOTS_MOST 4000000

static struct sim_prng prng;

static double between(double low, double high)
{
	return low + sim_prng_unit(&prng) * (high - low);
}

static struct sim_planner_limits random_limits(void)
{
	double scale = sim_prng_chance(&prng, 0.5) ? 0.1 : 10;
	struct sim_planner_limits limits = {
		.speed = between(0.1, 125),
		.accel = between(0.001, scale),
		.decel = between(0.001, scale),
	};

	return limits;
}

static double random_target(void)
{
	return floor(between(-20000, 20000));
}

static void check_braking(double before, double after, const struct sim_planner_limits *limits)
{
	if (before * after >= 0 && fabs(after) < fabs(before))
		assert_true(fabs(before) - fabs(after) <= limits->decel * 1.125 + 1e-9);
}

static void moves_end_on_their_target_without_overshoot(void **state)
{
	(void)state;
	for (int i = 0; i < MOVES; i++) {
		struct sim_planner_limits limits = random_limits();
		struct sim_planner p = { .position = random_target() };
		double target = random_target();
		double way = target > p.position ? 1 : -1;
		int slots = 0;

		while ((p.position != target || p.speed != 0) && slots++ < SLOTS_MOST) {
			double before = p.speed;

			sim_planner_go(&p, target, &limits);
			assert_true((target - p.position) * way >= 0);
			assert_true(fabs(p.speed) <= limits.speed + 1e-9);
			check_braking(before, p.speed, &limits);
		}
		assert_true(slots < SLOTS_MOST);
	}
}

static void moves_retargeted_on_the_way_end_on_the_last_target(void **state)
{
	(void)state;
	for (int i = 0; i < RETARGETED; i++) {
		struct sim_planner_limits limits = random_limits();
		struct sim_planner p = { 0 };
		double target = random_target();
		int changes = 5;
		int slots = 0;

		while ((p.position != target || p.speed != 0 || changes) && slots++ < SLOTS_MOST) {
			double before = p.speed;

			if (changes && sim_prng_chance(&prng, 0.02)) {
				target = random_target();
				changes--;
			}
			sim_planner_go(&p, target, &limits);
			check_braking(before, p.speed, &limits);
		}
		assert_true(slots < SLOTS_MOST);
	}
}

static void a_change_of_direction_passes_through_rest(void **state)
{
	struct sim_planner_limits limits = { .speed = 10, .accel = 0.3, .decel = 0.7 };
	struct sim_planner p = { .speed = 5 };
	int rested = 0;

	(void)state;
	for (int i = 0; i < 100; i++) {
		double before = p.speed;

		sim_planner_run(&p, -10, &limits);
		if (before > 0)
			assert_true(p.speed >= 0 && before - p.speed <= 0.7 + 1e-9);
		else
			assert_true(before - p.speed <= 0.3 + 1e-9);
		rested |= p.speed == 0;
	}
	assert_true(rested);
	assert_true(p.speed == -10);
}

static void limits_of_zero_stand_still(void **state)
{
	struct sim_planner_limits limits = { 0 };
	struct sim_planner p = { 0 };

	(void)state;
	for (int i = 0; i < 100; i++) {
		sim_planner_go(&p, 1000, &limits);
		sim_planner_run(&p, 10, &limits);
	}
	assert_true(p.position == 0 && p.speed == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(moves_end_on_their_target_without_overshoot),
		cmocka_unit_test(moves_retargeted_on_the_way_end_on_the_last_target),
		cmocka_unit_test(a_change_of_direction_passes_through_rest),
		cmocka_unit_test(limits_of_zero_stand_still),
	};
	const char *text = getenv("POKEYS_SEED");
	uint64_t seed = text ? strtoull(text, NULL, 0) : 1;

	fprintf(stderr, "seed %llu\n", (unsigned long long)seed);
	sim_prng_init(&prng, seed);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
