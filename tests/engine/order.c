/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Replies out of order, late by up to 300 requests, copied up to fifty times,
 * stray, damaged or misaddressed (faults 4 to 7). Nothing wrong is published,
 * no request fails because of them, and nothing more is sent.
 */

#include "tests/engine/world.h"

static struct world w;

static struct world_options polling(void)
{
	return (struct world_options){
		.way = { { .delay = { SIM_DELAY_UNIFORM, 50 * US, 100 * US, 0 } },
			 { .delay = { SIM_DELAY_UNIFORM, 50 * US, 100 * US, 0 } } },
		.service_ns = 50 * US,
		.per_cycle = 2,
	};
}

/* The reply to one request, or a copy of it, comes `late` requests later. */
static void one_late_reply(uint32_t late, bool copy)
{
	w.hold_request = w.requests + w.requests % 2 + late % 2;
	w.hold_for = late;
	w.hold_copy = copy;
	while (w.hold_for)
		world_tick(&w);
	world_run(&w, 5 * MS);
}

static void reply_late_by_1_to_300_requests_is_not_published(uint64_t period_ns, bool copy,
							     uint64_t seed)
{
	struct world_options options = polling();

	options.period_ns = period_ns;
	world_open(&w, &options, seed);
	world_run(&w, 300 * period_ns);
	for (uint32_t late = 1; late <= 300; late++)
		one_late_reply(late, copy);
	world_drain(&w);
	assert_int_equal(w.dev.statistics.done, w.requests);
	assert_true(w.dev.statistics.not_in_flight + w.dev.statistics.duplicate +
			    w.dev.statistics.bad_operation >=
		    280);
}

static void late_reply_at_2000_requests_a_second_is_not_published(void **state)
{
	(void)state;
	reply_late_by_1_to_300_requests_is_not_published(1 * MS, false, world_seed(11));
}

/* Much slower than a reply can live, so that time alone would not protect. */
static void late_reply_at_40_requests_a_second_is_not_published(void **state)
{
	(void)state;
	reply_late_by_1_to_300_requests_is_not_published(50 * MS, false, world_seed(12));
}

static void late_copy_at_2000_requests_a_second_is_not_published(void **state)
{
	(void)state;
	reply_late_by_1_to_300_requests_is_not_published(1 * MS, true, world_seed(13));
}

static void late_copy_at_40_requests_a_second_is_not_published(void **state)
{
	(void)state;
	reply_late_by_1_to_300_requests_is_not_published(50 * MS, true, world_seed(14));
}

/* So many in flight that ids wrap within a lost reply's life; 30 % of replies are late. */
static void reordering_across_the_wrap_of_ids_publishes_nothing_wrong(void **state)
{
	static const unsigned int late_ms[] = { 1, 10, 50, 100, 150, 400 };
	const uint64_t seed = world_seed(15);

	(void)state;
	for (unsigned int i = 0; i < 6; i++) {
		struct world_options options = polling();

		options.per_cycle = 3;
		options.oneshot_every = 20;
		options.mailbox.window = 16;
		options.way[SIM_LINK_REPLY].reorder = 0.3;
		options.way[SIM_LINK_REPLY].reorder_ns = late_ms[i] * MS;
		world_open(&w, &options, seed + i);
		world_run(&w, 10 * S);
		world_drain(&w);
		assert_true(w.link.way[SIM_LINK_REPLY].stats.reordered > 1000);
	}
}

static void copies_of_replies_cost_nothing(void **state)
{
	static const unsigned int copies[] = { 1, 2, 5, 20, 50 };
	const uint64_t seed = world_seed(16);

	(void)state;
	for (unsigned int i = 0; i < 5; i++) {
		struct world_options options = polling();

		options.way[SIM_LINK_REPLY].duplicate = copies[i] > 5 ? 0.1 : 1;
		options.way[SIM_LINK_REPLY].copies = copies[i];
		options.way[SIM_LINK_REPLY].copy_gap_ns = 500 * US;
		world_open(&w, &options, seed + i);
		world_run(&w, 5 * S);
		world_drain(&w);
		assert_int_equal(w.dev.statistics.done, w.requests);
		assert_int_equal(w.sends, w.requests);
		assert_true(w.dev.statistics.duplicate > w.requests / 2 * copies[i] / 10);
		assert_int_equal(w.dev.statistics.refused_id, 0);
	}
}

/* The network doubles requests: the device answers each copy. */
static void copies_of_requests_publish_nothing_wrong(void **state)
{
	struct world_options options = polling();

	(void)state;
	options.way[SIM_LINK_REQUEST].duplicate = 0.2;
	options.way[SIM_LINK_REQUEST].copies = 2;
	options.way[SIM_LINK_REQUEST].copy_gap_ns = 3 * MS;
	options.oneshot_every = 10;
	world_open(&w, &options, world_seed(17));
	world_run(&w, 10 * S);
	world_drain(&w);
	assert_true(w.dev.statistics.duplicate > 1000);
	assert_true(world_answered_permille(&w) >= 999);
}

static void two_hundred_stray_replies_cost_nothing(void **state)
{
	struct world_options options = polling();
	uint64_t sends;

	(void)state;
	options.per_cycle = 3;
	world_open(&w, &options, world_seed(18));
	world_run(&w, 1 * S);
	for (unsigned int round = 0; round < 20; round++) {
		uint64_t created;

		/* right after a cycle's requests have left */
		while (w.next_cycle_ns != w.now + w.options.period_ns)
			world_tick(&w);
		for (unsigned int i = 0; i < 200; i++)
			sim_link_inject(&w.link, SIM_LINK_REPLY, w.now, 0,
					w.last_replies[(w.replies - 1 - i) % 256],
					POKEYS_PACKET_SIZE);
		sends = w.sends;
		created = w.requests;
		world_run(&w, 7 * MS);
		assert_int_equal(w.sends - sends, w.requests - created);
	}
	world_drain(&w);
	assert_int_equal(w.dev.statistics.done, w.requests);
	assert_int_equal(w.sends, w.requests);
	assert_int_equal(w.dev.statistics.duplicate + w.dev.statistics.not_in_flight +
				 w.dev.statistics.bad_operation + w.dev.statistics.bad_check,
			 20 * 200);
}

/* One way at a time: two flips can make stamp and complement agree again. */
static void damage(enum sim_link_dir dir, uint64_t seed)
{
	struct world_options options = polling();

	options.way[dir].corrupt = 0.05;
	options.way[dir].truncate = 0.02;
	options.mailbox.retry_budget = 2000;
	options.oneshot_every = 20;
	world_open(&w, &options, seed);
	world_run(&w, 20 * S);
	world_drain(&w);
	/* payload bytes have no sum: flips in them are seen here, not by the mailbox */
	assert_true(w.corrupt_payloads > 100);
	assert_true(world_answered_permille(&w) >= 970);
}

static void damaged_replies_are_refused_except_what_no_check_covers(void **state)
{
	const struct pokeys_statistics *s = &w.dev.statistics;

	(void)state;
	damage(SIM_LINK_REPLY, world_seed(19));
	assert_true(s->bad_length > 100 && s->bad_checksum > 100 && s->bad_magic > 10);
	assert_true(s->bad_check > 1);
}

static void damaged_requests_are_made_good(void **state)
{
	(void)state;
	damage(SIM_LINK_REQUEST, world_seed(22));
	assert_true(w.resends > 100);
}

static void wrong_id_or_operation_is_refused(void **state)
{
	struct world_options options = polling();
	const struct pokeys_statistics *s = &w.dev.statistics;

	(void)state;
	options.way[SIM_LINK_REPLY].wrong_id = 0.05;
	options.way[SIM_LINK_REPLY].wrong_op = 0.05;
	options.mailbox.retry_budget = 2000;
	options.mailbox.window = 1;
	world_open(&w, &options, world_seed(20));
	world_run(&w, 20 * S);
	world_drain(&w);
	assert_true(s->bad_operation > 300);
	assert_true(s->not_in_flight + s->duplicate > 300);
	assert_true(world_answered_permille(&w) >= 990);
}

/* The id of another request of the same operation that is in flight: only the check byte tells. */
static void check_byte_sees_through_an_id_of_another_request_in_flight(void **state)
{
	struct world_options options = polling();

	(void)state;
	options.status_only = true;
	options.mailbox.window = 16;
	options.mailbox.retry_budget = 2000;
	options.service_ns = 300 * US;
	options.per_cycle = 3;
	options.way[SIM_LINK_REPLY].delay.low_ns = 2 * MS;
	options.way[SIM_LINK_REPLY].delay.high_ns = 3 * MS;
	/* few: each costs an id for half a second, and turns must not become short */
	options.way[SIM_LINK_REPLY].wrong_id = 0.02;
	world_open(&w, &options, world_seed(21));
	world_run(&w, 60 * S);
	world_drain(&w);
	assert_true(w.dev.statistics.bad_check > 30);
	assert_int_equal(w.dev.statistics.bad_operation, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(late_reply_at_2000_requests_a_second_is_not_published),
		cmocka_unit_test(late_reply_at_40_requests_a_second_is_not_published),
		cmocka_unit_test(late_copy_at_2000_requests_a_second_is_not_published),
		cmocka_unit_test(late_copy_at_40_requests_a_second_is_not_published),
		cmocka_unit_test(reordering_across_the_wrap_of_ids_publishes_nothing_wrong),
		cmocka_unit_test(copies_of_replies_cost_nothing),
		cmocka_unit_test(copies_of_requests_publish_nothing_wrong),
		cmocka_unit_test(two_hundred_stray_replies_cost_nothing),
		cmocka_unit_test(damaged_replies_are_refused_except_what_no_check_covers),
		cmocka_unit_test(damaged_requests_are_made_good),
		cmocka_unit_test(wrong_id_or_operation_is_refused),
		cmocka_unit_test(check_byte_sees_through_an_id_of_another_request_in_flight),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
