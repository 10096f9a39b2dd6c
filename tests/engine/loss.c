/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Lost packets: at every rate, in either direction, in bursts, one by one
 * (faults 1 to 3). The world checks the invariants; here stands what a loss
 * may cost.
 */

#include "tests/engine/world.h"

static struct world w;

static struct world_options polling(void)
{
	return (struct world_options){
		.way = { { .delay = { SIM_DELAY_UNIFORM, 50 * US, 150 * US, 0 } },
			 { .delay = { SIM_DELAY_UNIFORM, 50 * US, 150 * US, 0 } } },
		.service_ns = 100 * US,
		.per_cycle = 3,
		.oneshot_every = 50,
		.cancel_every = 997,
	};
}

static void run_with_loss(double requests, double replies, uint64_t seed)
{
	struct world_options options = polling();

	options.way[SIM_LINK_REQUEST].loss = requests;
	options.way[SIM_LINK_REPLY].loss = replies;
	world_open(&w, &options, seed);
	world_run(&w, 10 * S);
	world_drain(&w);
	print_message("loss %5.2f %% / %5.2f %%: %u requests, answered %u/1000, resent %u, "
		      "refused id %u budget %u window %u\n",
		      100 * requests, 100 * replies, (unsigned int)w.requests,
		      world_answered_permille(&w), (unsigned int)w.resends,
		      (unsigned int)w.dev.statistics.refused_id,
		      (unsigned int)w.dev.statistics.refused_budget,
		      (unsigned int)w.dev.statistics.refused_window);
}

static void every_request_ends_once_at_every_rate_of_loss(void **state)
{
	static const double rates[] = { 0.0001, 0.001, 0.01, 0.05, 0.10, 0.33 };
	/* what is cancelled and the one-shots that got no answer are not answered */
	static const unsigned int answered[] = { 995, 995, 990, 940, 700, 200 };
	const uint64_t seed = world_seed(1);

	(void)state;
	for (unsigned int i = 0; i < 6; i++) {
		run_with_loss(rates[i], rates[i], seed + i);
		assert_true(world_answered_permille(&w) >= answered[i]);
	}
}

static void loss_of_requests_only_or_replies_only_breaks_nothing(void **state)
{
	static const double rates[] = { 0.01, 0.10, 0.33, 1.0 };
	const uint64_t seed = world_seed(2);

	(void)state;
	for (unsigned int i = 0; i < 4; i++) {
		run_with_loss(rates[i], 0, seed + i);
		run_with_loss(0, rates[i], seed + i);
	}
}

/* Nothing lost: nothing is sent twice, nothing refused. */
static void perfect_link_needs_no_resend(void **state)
{
	struct world_options options = polling();

	(void)state;
	options.cancel_every = 0;
	world_open(&w, &options, world_seed(3));
	world_run(&w, 20 * S);
	world_drain(&w);
	assert_int_equal(w.resends, 0);
	assert_int_equal(w.dev.statistics.accepted, w.requests);
	assert_int_equal(w.dev.statistics.refused_id, 0);
	assert_int_equal(w.dev.statistics.refused_window, 0);
	assert_int_equal(w.dev.statistics.refused_budget, 0);
}

/* A network that is slow at times loses nothing, and one that loses is not slow. */
static void slow_network_counts_late_and_lossy_one_counts_lost(void **state)
{
	struct world_options options = polling();
	const struct pokeys_statistics *counted = &w.dev.statistics;

	(void)state;
	options.oneshot_every = 0;
	options.cancel_every = 0;
	options.way[SIM_LINK_REPLY].delay = (struct sim_delay){ SIM_DELAY_HEAVY_TAIL, 50 * US,
								30 * MS, 1.1 };
	world_open(&w, &options, world_seed(7));
	world_run(&w, 10 * S);
	assert_true(counted->missed > 100);
	assert_true(counted->late <= counted->missed);
	assert_true(counted->late > counted->missed - 256);
	assert_true(counted->lost == 0);

	options = polling();
	options.oneshot_every = 0;
	options.cancel_every = 0;
	options.way[SIM_LINK_REPLY].loss = 0.05;
	world_open(&w, &options, world_seed(8));
	world_run(&w, 10 * S);
	assert_true(counted->missed > 100);
	assert_true(counted->late == 0);
	assert_true(counted->lost <= counted->missed);
	assert_true(counted->lost > counted->missed - 256);
}

/* The packets of one tick are lost, the rest of the world goes on. */
static uint64_t cost_of_one_loss(enum sim_link_dir dir, unsigned int at)
{
	uint64_t deadline, took;
	struct pokeys_statistics s;
	uint64_t first;

	world_run(&w, 50 * MS + at * 100 * US);
	while (w.now + w.options.tick_ns < w.next_cycle_ns)
		world_tick(&w);
	pokeys_device_statistics(&w.dev, &s);
	deadline = s.deadline_ns;
	first = w.requests;
	sim_link_silence(&w.link, dir, w.now, w.now + 300 * US);
	world_run(&w, 200 * MS);
	assert_int_equal(world_request(&w, first)->state, POKEYS_REQUEST_DONE);
	assert_int_equal(world_request(&w, first)->sends, 2);
	took = world_request(&w, first)->ended_ns - world_request(&w, first)->created_ns;
	/* a round trip here: two delays, its service and that of the next cycle's request */
	assert_true(took <= deadline + 500 * US + 5 * w.options.tick_ns);
	return took;
}

static void lost_packet_costs_its_deadline_and_one_round_trip(void **state)
{
	struct world_options options = polling();
	uint64_t worst = 0;

	(void)state;
	options.oneshot_every = 0;
	options.cancel_every = 0;
	options.tick_ns = 10 * US;
	options.per_cycle = 1;
	world_open(&w, &options, world_seed(4));
	world_run(&w, 1 * S);
	for (unsigned int at = 0; at < 20; at++) {
		for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++) {
			const uint64_t took = cost_of_one_loss((enum sim_link_dir)dir, at);

			worst = took > worst ? took : worst;
		}
	}
	print_message("a lost packet cost at most %u us\n", (unsigned int)(worst / US));
	world_drain(&w);
}

static void answers_flow_again_within_100_ms_of_any_outage(void **state)
{
	static const unsigned int lengths[] = { 1, 2, 5, 10, 20, 50, 100, 200, 1000 };
	struct world_options options = polling();
	uint64_t worst = 0;

	(void)state;
	world_open(&w, &options, world_seed(5));
	world_run(&w, 1 * S);
	for (unsigned int n = 0; n < 90; n++) {
		const uint64_t length = lengths[n % 9] * MS;
		uint64_t end;

		for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++)
			sim_link_silence(&w.link, (enum sim_link_dir)dir, w.now, w.now + length);
		world_run(&w, length);
		end = w.now;
		do {
			world_tick(&w);
		} while (w.last_done_ns <= end && w.now < end + S);
		worst = w.now - end > worst ? w.now - end : worst;
		world_run(&w, 700 * MS);
	}
	print_message("first answer at most %u us after an outage\n", (unsigned int)(worst / US));
	assert_true(worst <= 100 * MS);
	world_drain(&w);
}

static void bursts_of_loss_break_nothing(void **state)
{
	static const unsigned int lengths[] = { 1, 10, 50, 200 };
	const uint64_t seed = world_seed(6);

	(void)state;
	for (unsigned int i = 0; i < 4; i++) {
		struct world_options options = polling();

		for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++) {
			options.way[dir].burst_every_ns = 10 * lengths[i] * MS;
			options.way[dir].burst_length_ns = lengths[i] * MS;
			options.way[dir].burst_loss = 0.9;
		}
		world_open(&w, &options, seed + i);
		world_run(&w, 10 * S);
		world_drain(&w);
		assert_true(w.link.way[0].stats.lost_burst > 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_request_ends_once_at_every_rate_of_loss),
		cmocka_unit_test(loss_of_requests_only_or_replies_only_breaks_nothing),
		cmocka_unit_test(perfect_link_needs_no_resend),
		cmocka_unit_test(slow_network_counts_late_and_lossy_one_counts_lost),
		cmocka_unit_test(lost_packet_costs_its_deadline_and_one_round_trip),
		cmocka_unit_test(answers_flow_again_within_100_ms_of_any_outage),
		cmocka_unit_test(bursts_of_loss_break_nothing),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
