/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A long run with everything that goes wrong on a bad day: loss, jitter,
 * copies, reordering, damage, outages and stalls of the client (faults 18 and
 * 27). POKEYS_SOAK=N in the environment runs N requests instead of a million.
 */

#include <stdlib.h>
#include "tests/engine/world.h"

static struct world w;

static uint64_t requests_wanted(void)
{
	const char *given = getenv("POKEYS_SOAK");

	return given && *given ? strtoull(given, NULL, 0) : 1000000;
}

static struct world_options bad_day(void)
{
	struct world_options options = {
		.service_ns = 150 * US,
		.per_cycle = 3,
		.oneshot_every = 100,
		.cancel_every = 1009,
	};

	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++) {
		options.way[dir].loss = 0.005;
		options.way[dir].delay = (struct sim_delay){ SIM_DELAY_HEAVY_TAIL, 50 * US, 3 * MS,
							     1.8 };
		options.way[dir].truncate = 0.0005;
	}
	options.way[SIM_LINK_REPLY].corrupt = 0.0005;
	options.way[SIM_LINK_REPLY].duplicate = 0.01;
	options.way[SIM_LINK_REPLY].copies = 5;
	options.way[SIM_LINK_REPLY].copy_gap_ns = 3 * MS;
	options.way[SIM_LINK_REPLY].reorder = 0.005;
	options.way[SIM_LINK_REPLY].reorder_ns = 60 * MS;
	return options;
}

static void bad_days_publish_nothing_wrong_and_leak_nothing(void **state)
{
	const struct world_options options = bad_day();
	const uint64_t wanted = requests_wanted();
	const struct pokeys_statistics *s = &w.dev.statistics;

	(void)state;
	world_open(&w, &options, world_seed(41));
	while (w.requests < wanted) {
		const uint64_t before = w.requests;

		world_run(&w, sim_prng_below(&w.prng, 20 * S));
		if (sim_prng_chance(&w.prng, 0.3))
			world_stall(&w, sim_prng_below(&w.prng, 5 * S));
		if (sim_prng_chance(&w.prng, 0.3))
			sim_link_silence(&w.link, SIM_LINK_REPLY, w.now,
					 w.now + sim_prng_below(&w.prng, 300 * MS));
		if (sim_prng_chance(&w.prng, 0.1))
			pokeys_device_reset(&w.dev, w.now);
		assert_true(w.requests >= before);
	}
	world_drain(&w);
	print_message("%u requests in %u s: answered %u/1000, resent %u, timed out %u, unknown %u, "
		      "duplicates %u, strays %u, stale %u, no id %u\n",
		      (unsigned int)w.requests, (unsigned int)(w.now / S),
		      world_answered_permille(&w), (unsigned int)s->resent,
		      (unsigned int)s->timed_out, (unsigned int)s->unknown,
		      (unsigned int)s->duplicate, (unsigned int)s->not_in_flight,
		      (unsigned int)s->stale, (unsigned int)s->refused_id);
	assert_true(world_answered_permille(&w) >= 980);
	assert_int_equal(w.dev.open_count, 0);
	for (unsigned int id = 0; id < POKEYS_MAILBOX_SIZE; id++)
		assert_int_equal(pokeys_request_state(&w.dev, (uint8_t)id), POKEYS_REQUEST_FREE);
}

static void stall_of_five_seconds_costs_one_cycle_and_no_burst(void **state)
{
	struct world_options options = { .service_ns = 150 * US, .per_cycle = 3 };
	uint64_t sends, done;

	(void)state;
	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++)
		options.way[dir].delay = (struct sim_delay){ SIM_DELAY_CONSTANT, 80 * US, 0, 0 };
	world_open(&w, &options, world_seed(42));
	world_run(&w, 1 * S);
	for (unsigned int stall = 0; stall < 20; stall++) {
		world_run(&w, 10 * MS + stall * 100 * US);
		world_stall(&w, 5 * S);
		sends = w.sends;
		done = w.dev.statistics.done;
		world_run(&w, 10 * MS);
		assert_in_range(w.sends - sends, 27, 33);
		assert_true(w.dev.statistics.done - done >= 27);
	}
	/* what was in flight when the stall began was answered meanwhile, and taken */
	world_drain(&w);
	assert_int_equal(w.resends, 0);
	assert_int_equal(w.dev.statistics.done, w.requests);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bad_days_publish_nothing_wrong_and_leak_nothing),
		cmocka_unit_test(stall_of_five_seconds_costs_one_cycle_and_no_burst),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
