/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Jitter up to ten times the deadline (fault 8): the deadline follows, stays
 * within its bounds and does not oscillate into a storm of resends.
 */

#include "tests/engine/world.h"

static struct world w;

struct figures {
	unsigned int resent_permille; /* resends per thousand requests */
	uint64_t deadline_low, deadline_high;
};

/* Ten seconds of polling over links like this, the first one not counted. */
static struct figures poll_over(const struct sim_delay *delay, double reorder, uint64_t service_ns,
				uint64_t seed)
{
	struct figures f = { .deadline_low = UINT64_MAX };
	struct world_options options = { .service_ns = service_ns, .per_cycle = 3 };
	uint64_t resends;
	uint64_t requests;

	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++) {
		options.way[dir].delay = *delay;
		options.way[dir].reorder = reorder;
		options.way[dir].reorder_ns = reorder > 0 ? 3 * MS : 0;
	}
	options.mailbox.window = 64;
	world_open(&w, &options, seed);
	world_run(&w, 1 * S);
	requests = w.requests;
	resends = w.resends;
	for (unsigned int ms = 0; ms < 10000; ms++) {
		struct pokeys_statistics s;

		world_run(&w, 1 * MS);
		pokeys_device_statistics(&w.dev, &s);
		if (s.deadline_ns < f.deadline_low)
			f.deadline_low = s.deadline_ns;
		if (s.deadline_ns > f.deadline_high)
			f.deadline_high = s.deadline_ns;
	}
	f.resent_permille = (unsigned int)((w.resends - resends) * 1000 / (w.requests - requests));
	world_drain(&w);
	print_message("resent %u/1000, answered %u/1000, deadline %u .. %u us\n", f.resent_permille,
		      world_answered_permille(&w), (unsigned int)(f.deadline_low / US),
		      (unsigned int)(f.deadline_high / US));
	assert_in_range(f.deadline_low, 300 * US, 50 * MS);
	assert_in_range(f.deadline_high, 300 * US, 50 * MS);
	assert_int_equal(w.dev.statistics.refused_id, 0);
	return f;
}

static void uniform_jitter_hardly_causes_a_resend(void **state)
{
	static const unsigned int high_us[] = { 200, 1000, 3000, 10000 };
	const uint64_t seed = world_seed(31);

	(void)state;
	for (unsigned int i = 0; i < 4; i++) {
		const struct sim_delay delay = { SIM_DELAY_UNIFORM, 100 * US, high_us[i] * US, 0 };

		assert_true(poll_over(&delay, 0, 100 * US, seed + i).resent_permille <= 2);
		assert_true(world_answered_permille(&w) >= 999);
	}
}

static void heavy_tail_to_ten_deadlines_causes_no_storm(void **state)
{
	static const double alpha[] = { 1.1, 1.5, 2.0 };
	const uint64_t seed = world_seed(32);

	(void)state;
	for (unsigned int i = 0; i < 3; i++) {
		const struct sim_delay delay = {
			SIM_DELAY_HEAVY_TAIL,
			100 * US,
			10 * MS,
			alpha[i],
		};

		assert_true(poll_over(&delay, 0, 100 * US, seed + i).resent_permille <= 50);
		assert_true(world_answered_permille(&w) >= 995);
	}
}

static void jitter_that_reorders_causes_no_storm(void **state)
{
	const struct sim_delay delay = { SIM_DELAY_HEAVY_TAIL, 100 * US, 3 * MS, 1.5 };

	(void)state;
	assert_true(poll_over(&delay, 0.02, 100 * US, world_seed(33)).resent_permille <= 50);
	assert_true(world_answered_permille(&w) >= 995);
}

/* Two of three requests a cycle is all this device serves: a queue, not a storm. */
static void device_that_is_slower_than_the_polling_is_not_flooded(void **state)
{
	const struct sim_delay delay = { SIM_DELAY_CONSTANT, 100 * US, 0, 0 };
	struct world_options options = { .service_ns = 500 * US, .per_cycle = 3 };

	(void)state;
	options.way[0].delay = options.way[1].delay = delay;
	world_open(&w, &options, world_seed(34));
	world_run(&w, 10 * S);
	world_drain(&w);
	/* the window of 8 holds the rest back; who is sent is answered, once */
	assert_true(w.dev.statistics.refused_window > 1000);
	assert_true(w.resends <= w.requests / 50);
	assert_true(world_answered_permille(&w) >= 995);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(uniform_jitter_hardly_causes_a_resend),
		cmocka_unit_test(heavy_tail_to_ten_deadlines_causes_no_storm),
		cmocka_unit_test(jitter_that_reorders_causes_no_storm),
		cmocka_unit_test(device_that_is_slower_than_the_polling_is_not_flooded),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
