/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How long a request waits for its answer: floor, ceiling, what the deadline
 * learns from and what it does not, and when it doubles.
 */

#include "tests/engine/script.h"

static struct script s;

static uint64_t deadline(void)
{
	struct pokeys_statistics statistics;

	pokeys_device_statistics(&s.dev, &statistics);
	return statistics.deadline_ns;
}

/* A request that is answered after this time, and given back. */
static void round_trip_of(uint8_t op, uint8_t p1, uint64_t rtt)
{
	const uint8_t id = script_request(&s, op, p1, NULL, 0);

	s.now += rtt;
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(pokeys_request_free(&s.dev, id), 0);
	s.now += 500 * US;
}

static void round_trips(unsigned int count, uint64_t rtt)
{
	while (count--)
		round_trip_of(OP_READ, 0, rtt);
}

static void first_deadline_is_the_initial_one(void **state)
{
	struct pokeys_options options = { .deadline_initial_ns = 7 * MS };

	(void)state;
	script_init(&s, NULL);
	assert_int_equal(deadline(), 10 * MS);
	script_init(&s, &options);
	assert_int_equal(deadline(), 7 * MS);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(pokeys_device_next_deadline(&s.dev), s.now + 7 * MS);
}

static void deadline_follows_the_round_trip(void **state)
{
	(void)state;
	script_init(&s, NULL);
	round_trip_of(OP_READ, 0, 1 * MS);
	assert_int_equal(s.dev.statistics.rtt_smoothed_ns, 1 * MS);
	assert_int_equal(s.dev.statistics.rtt_variation_ns, 500 * US);
	assert_int_equal(deadline(), 3 * MS);
	round_trips(2000, 1 * MS);
	assert_in_range(deadline(), 1500 * US, 1501 * US);
	round_trips(100, 4 * MS);
	assert_in_range(deadline(), 5900 * US, 20 * MS);
	assert_int_equal(s.dev.statistics.rtt_min_ns, 1 * MS);
	assert_int_equal(s.dev.statistics.rtt_max_ns, 4 * MS);
	assert_int_equal(s.dev.statistics.rtt_last_ns, 4 * MS);
}

static void quiet_link_keeps_half_a_round_trip_of_margin(void **state)
{
	(void)state;
	script_init(&s, NULL);
	round_trips(5000, 2 * MS);
	assert_in_range(deadline(), 2999 * US, 3001 * US);
}

/* A slow answer among a thousand a second must not be forgotten in milliseconds. */
static void slow_answer_is_remembered_for_a_while(void **state)
{
	uint64_t quiet;

	(void)state;
	script_init(&s, NULL);
	round_trips(2000, 400 * US);
	quiet = deadline();
	round_trip_of(OP_READ, 0, quiet - 1);
	round_trips(20, 400 * US);
	assert_true(deadline() > quiet);
	round_trips(1000, 400 * US);
	assert_true(deadline() <= quiet + 1000);
}

static void floor_and_ceiling_hold(void **state)
{
	struct pokeys_options options = {
		.deadline_floor_ns = 500 * US,
		.deadline_ceiling_ns = 5 * MS,
	};

	(void)state;
	script_init(&s, &options);
	assert_int_equal(deadline(), 5 * MS);
	round_trips(100, 10 * US);
	assert_int_equal(deadline(), 500 * US);
	round_trips(100, 4900 * US);
	assert_int_equal(deadline(), 5 * MS);
}

/* Karn: which try was answered is unknown. */
static void answer_after_a_resend_teaches_nothing(void **state)
{
	uint64_t before;
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	round_trips(10, 400 * US);
	before = s.dev.statistics.rtt_smoothed_ns;
	id = script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(script_after(&s, 10 * MS), 1);
	s.now += 5 * US;
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(s.dev.statistics.accepted_earlier_try, 1);
	assert_int_equal(s.dev.statistics.rtt_smoothed_ns, before);
	assert_int_equal(s.dev.statistics.rtt_last_ns, 400 * US);
	assert_int_equal(s.dev.statistics.rtt_min_ns, 400 * US);
}

static void deadline_doubles_until_a_first_try_is_answered(void **state)
{
	uint64_t base;
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	round_trips(200, 400 * US);
	base = deadline();
	id = script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(script_after(&s, base), 1);
	assert_int_equal(deadline(), 2 * base);
	assert_int_equal(script_after(&s, 2 * base), 1);
	assert_int_equal(deadline(), 4 * base);
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(deadline(), 4 * base);
	round_trip_of(OP_READ, 0, 400 * US);
	assert_in_range(deadline(), base - 10 * US, base);
}

static void requests_lost_together_double_the_deadline_once(void **state)
{
	uint64_t base;

	(void)state;
	script_init(&s, NULL);
	round_trips(200, 400 * US);
	base = deadline();
	for (unsigned int i = 0; i < 8; i++)
		script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(script_after(&s, base), 8);
	assert_int_equal(deadline(), 2 * base);
}

static void doubling_ends_at_the_ceiling(void **state)
{
	const struct pokeys_options options = { .retries = 20 };

	(void)state;
	script_init(&s, &options);
	round_trips(10, 400 * US);
	script_request(&s, OP_READ, 0, NULL, 0);
	for (unsigned int i = 0; i < 20; i++)
		script_after(&s, 60 * MS);
	assert_int_equal(s.dev.statistics.resent, 20);
	assert_int_equal(deadline(), 50 * MS);
}

/* The round trip became twenty times as long: no sample could come from the old deadline. */
static void deadline_grows_past_a_round_trip_that_became_longer(void **state)
{
	unsigned int failed = 0;

	(void)state;
	script_init(&s, NULL);
	round_trips(200, 400 * US);
	for (unsigned int i = 0; i < 10; i++) {
		const uint8_t id = script_request(&s, OP_READ, 0, NULL, 0);
		const uint64_t answer_at = s.now + 8 * MS;

		while (s.now < answer_at)
			script_after(&s, 100 * US);
		failed += !script_answer(&s, id);
		pokeys_request_free(&s.dev, id);
	}
	assert_true(failed <= 2);
	assert_true(deadline() > 8 * MS);
}

static void oneshot_waits_for_the_ceiling_and_teaches_nothing(void **state)
{
	uint64_t before;
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	round_trips(10, 400 * US);
	before = deadline();
	id = script_request(&s, OP_PULSE, SUB_HOME, NULL, 0);
	assert_int_equal(pokeys_request_get(&s.dev, id)->deadline, s.now + 50 * MS);
	s.now += 40 * MS;
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(deadline(), before);
	script_request(&s, OP_PULSE, SUB_HOME, NULL, 0);
	assert_int_equal(script_after(&s, 50 * MS), 1);
	assert_int_equal(deadline(), before);
}

static void deadline_of_a_requests_own_is_kept_and_teaches_nothing(void **state)
{
	uint64_t before;
	int id;

	(void)state;
	script_init(&s, NULL);
	round_trips(10, 400 * US);
	before = deadline();
	id = CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0);
	assert_int_equal(pokeys_request_set_deadline(&s.dev, (uint8_t)id, 0), -EINVAL);
	assert_int_equal(pokeys_request_set_deadline(&s.dev, (uint8_t)id, 61 * S), -EINVAL);
	assert_int_equal(pokeys_request_set_deadline(&s.dev, (uint8_t)id, 2 * S), 0);
	assert_int_equal(pokeys_request_send(&s.dev, (uint8_t)id, s.now), 0);
	assert_int_equal(pokeys_request_set_deadline(&s.dev, (uint8_t)id, 1 * S), -EALREADY);
	assert_int_equal(pokeys_request_set_deadline(&s.dev, 99, 1 * S), -ENOENT);
	assert_int_equal(script_after(&s, 2 * S - 1), 0);
	assert_int_equal(script_after(&s, 1), 1);
	assert_int_equal(deadline(), before);
	/* an answer older than replies get elsewhere: it was waited for */
	s.now += 1900 * MS;
	assert_int_equal(script_answer(&s, (uint8_t)id), 1);
	assert_int_equal(deadline(), before);
}

static void reset_forgets_the_round_trip_and_keeps_the_counters(void **state)
{
	(void)state;
	script_init(&s, NULL);
	round_trips(10, 400 * US);
	pokeys_device_reset(&s.dev, s.now);
	assert_int_equal(deadline(), 10 * MS);
	assert_int_equal(s.dev.statistics.rtt_smoothed_ns, 0);
	assert_int_equal(s.dev.statistics.rtt_max_ns, 0);
	assert_int_equal(s.dev.statistics.done, 10);
}

static void clock_that_steps_back_stands_still(void **state)
{
	(void)state;
	script_init(&s, NULL);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(pokeys_device_check(&s.dev, 5), 0);
	assert_int_equal(script_request(&s, OP_READ, 0, NULL, 0), 1);
	s.now = 7;
	assert_int_equal(script_answer(&s, 1), 1);
	assert_int_equal(pokeys_request_get(&s.dev, 1)->timestamp_received, S);
	assert_int_equal(s.dev.statistics.rtt_last_ns, 1);
}

static void options_out_of_range_are_refused(void **state)
{
	static const struct pokeys_options bad[] = {
		{ .deadline_floor_ns = 49 * US },
		{ .deadline_floor_ns = 1 * S + 1 },
		{ .deadline_ceiling_ns = 5 * S + 1 },
		{ .deadline_floor_ns = 2 * MS, .deadline_ceiling_ns = 1 * MS },
		{ .deadline_initial_ns = 299 * US },
		{ .deadline_initial_ns = 51 * MS },
		{ .reply_lifetime_ns = MS - 1 },
		{ .reply_lifetime_ns = 60 * S + 1 },
		{ .id_rest_ns = 501 * MS },
		{ .retries = 21 },
		{ .window = 65 },
		{ .retry_budget = 100001 },
		{ .send_budget = 1000001 },
	};
	struct pokeys_io io = { 0 };
	static pokeys_device_t dev;

	(void)state;
	assert_int_equal(pokeys_device_init(&dev, &io, NULL), -EINVAL);
	script_init(&s, NULL);
	io = s.dev.io;
	for (unsigned int i = 0; i < sizeof(bad) / sizeof(*bad); i++)
		assert_int_equal(pokeys_device_init(&dev, &io, &bad[i]), -EINVAL);
	io.receive = NULL;
	assert_int_equal(pokeys_device_init(&dev, &io, NULL), 0);
	assert_int_equal(pokeys_device_receive(&dev, 1), 0);
}

static void options_left_at_zero_have_their_defaults(void **state)
{
	(void)state;
	script_init(&s, NULL);
	assert_int_equal(s.dev.options.deadline_floor_ns, 300 * US);
	assert_int_equal(s.dev.options.deadline_ceiling_ns, 50 * MS);
	assert_int_equal(s.dev.options.reply_lifetime_ns, 500 * MS);
	assert_int_equal(s.dev.options.id_rest_ns, 20 * MS);
	assert_int_equal(s.dev.options.retries, 3);
	assert_int_equal(s.dev.options.window, 8);
	assert_int_equal(s.dev.options.retry_budget, 200);
	assert_int_equal(s.dev.options.send_budget, 8000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(first_deadline_is_the_initial_one),
		cmocka_unit_test(deadline_follows_the_round_trip),
		cmocka_unit_test(quiet_link_keeps_half_a_round_trip_of_margin),
		cmocka_unit_test(slow_answer_is_remembered_for_a_while),
		cmocka_unit_test(floor_and_ceiling_hold),
		cmocka_unit_test(answer_after_a_resend_teaches_nothing),
		cmocka_unit_test(deadline_doubles_until_a_first_try_is_answered),
		cmocka_unit_test(requests_lost_together_double_the_deadline_once),
		cmocka_unit_test(doubling_ends_at_the_ceiling),
		cmocka_unit_test(deadline_grows_past_a_round_trip_that_became_longer),
		cmocka_unit_test(oneshot_waits_for_the_ceiling_and_teaches_nothing),
		cmocka_unit_test(deadline_of_a_requests_own_is_kept_and_teaches_nothing),
		cmocka_unit_test(reset_forgets_the_round_trip_and_keeps_the_counters),
		cmocka_unit_test(clock_that_steps_back_stands_still),
		cmocka_unit_test(options_out_of_range_are_refused),
		cmocka_unit_test(options_left_at_zero_have_their_defaults),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
