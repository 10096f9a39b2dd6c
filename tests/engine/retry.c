/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is sent again and what never is: retries by class, the newest value of
 * a write, a transport that refuses, budgets, and the time after a stall
 * (faults 18 and 21, invariants I3 to I5).
 */

#include "tests/engine/script.h"

static struct script s;

static void lost_request_is_sent_again_unchanged_and_answered(void **state)
{
	uint8_t first[POKEYS_PACKET_SIZE];
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	id = script_request(&s, OP_READ, 0, NULL, 0);
	memcpy(first, script_last(&s), sizeof(first));
	assert_int_equal(script_after(&s, 10 * MS - 1), 0);
	assert_int_equal(script_after(&s, 1), 1);
	assert_int_equal(s.sent, 2);
	assert_memory_equal(script_last(&s), first, sizeof(first));
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(pokeys_request_get(&s.dev, id)->tries, 2);
	assert_int_equal(s.dev.statistics.sent, 2);
	assert_int_equal(s.dev.statistics.resent, 1);
}

static void request_without_answer_ends_after_its_retries(void **state)
{
	(void)state;
	script_init(&s, NULL);
	script_request(&s, OP_READ, 0, NULL, 0);
	for (unsigned int retry = 1; retry <= 3; retry++) {
		assert_int_equal(script_after(&s, 50 * MS), 1);
		assert_int_equal(s.sent, 1 + retry);
		assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_IN_FLIGHT);
	}
	assert_int_equal(script_after(&s, 50 * MS), 1);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_TIMED_OUT);
	assert_int_equal(script_after(&s, 1 * S), 0);
	assert_int_equal(s.sent, 4);
	assert_int_equal(s.dev.statistics.timed_out, 1);
	assert_false(pokeys_request_get(&s.dev, 0)->response_ready);
}

static void check_missed(uint64_t missed, uint64_t late, uint64_t lost)
{
	assert_true(s.dev.statistics.missed == missed);
	assert_true(s.dev.statistics.late == late);
	assert_true(s.dev.statistics.lost == lost);
}

/* An id whose request missed its deadline is passed over for so many requests. */
enum { PASSED_OVER = 512, ALL_IDS = 256 };

static void answered_requests(unsigned int count)
{
	for (unsigned int i = 0; i < count; i++) {
		const uint8_t id = script_request(&s, OP_READ, 0, NULL, 0);

		assert_int_equal(script_answer(&s, id), 1);
		assert_int_equal(pokeys_request_free(&s.dev, id), 0);
		script_after(&s, 5 * MS);
	}
}

static void answer_after_its_deadline_is_late_and_not_lost(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	id = script_request(&s, OP_READ, 0, NULL, 0);
	script_after(&s, 10 * MS);
	check_missed(1, 0, 0);
	/* Two tries, one answer: the other may still come. */
	assert_int_equal(script_answer(&s, id), 1);
	check_missed(1, 0, 0);
	assert_int_equal(script_answer(&s, id), 0);
	check_missed(1, 1, 0);
	/* A third answer to two tries is a copy that the network made. */
	assert_int_equal(script_answer(&s, id), 0);
	check_missed(1, 1, 0);
	assert_true(s.dev.statistics.duplicate == 2);
	assert_int_equal(pokeys_request_free(&s.dev, id), 0);
	answered_requests(PASSED_OVER + ALL_IDS);
	check_missed(1, 1, 0);
}

static void request_never_answered_is_lost_once_its_id_is_used_again(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	id = script_request(&s, OP_READ, 0, NULL, 0);
	script_after(&s, 10 * MS);
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(pokeys_request_free(&s.dev, id), 0);
	answered_requests(PASSED_OVER - 1);
	check_missed(1, 0, 0);
	answered_requests(ALL_IDS);
	check_missed(1, 0, 1);
}

static void every_try_of_a_request_that_timed_out_is_late_or_lost(void **state)
{
	(void)state;
	script_init(&s, NULL);
	script_request(&s, OP_READ, 0, NULL, 0);
	for (unsigned int i = 0; i < 4; i++)
		script_after(&s, 50 * MS);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_TIMED_OUT);
	check_missed(4, 0, 0);
	assert_int_equal(pokeys_request_free(&s.dev, 0), 0);
	script_answer(&s, 0);
	check_missed(4, 1, 0);
	answered_requests(PASSED_OVER + ALL_IDS);
	check_missed(4, 1, 3);
}

static void answer_to_the_only_try_is_late_though_no_resend_was_taken(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	id = script_request(&s, OP_READ, 0, NULL, 0);
	/* The transport takes no resend: the only try has missed its deadline once. */
	s.send_error = -ENOBUFS;
	script_after(&s, 10 * MS);
	script_after(&s, 10 * MS);
	check_missed(1, 0, 0);
	assert_int_equal(script_answer(&s, id), 1);
	check_missed(1, 1, 0);
}

static void oneshot_is_sent_once_and_its_end_is_unknown(void **state)
{
	(void)state;
	script_init(&s, NULL);
	script_request(&s, OP_PULSE, SUB_HOME, NULL, 0);
	assert_int_equal(pokeys_request_get(&s.dev, 0)->retries_left, 0);
	for (unsigned int i = 0; i < 100; i++)
		script_after(&s, 50 * MS);
	assert_int_equal(s.sent, 1);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_UNKNOWN);
	assert_int_equal(s.dev.statistics.unknown, 1);
}

static void oneshot_that_the_transport_refused_may_be_sent_later(void **state)
{
	const uint8_t sub = SUB_HOME;
	int id;

	(void)state;
	script_init(&s, NULL);
	id = CreateRequestAsync(&s.dev, OP_PULSE, &sub, 1, NULL, 0);
	s.send_error = -ENOBUFS;
	assert_int_equal(pokeys_request_send(&s.dev, (uint8_t)id, s.now), -ENOBUFS);
	assert_int_equal(pokeys_request_state(&s.dev, (uint8_t)id), POKEYS_REQUEST_CREATED);
	assert_int_equal(s.dev.in_flight_count, 0);
	assert_int_equal(script_after(&s, 1 * S), 0);
	s.send_error = 0;
	assert_int_equal(pokeys_request_send(&s.dev, (uint8_t)id, s.now), 0);
	assert_int_equal(s.sent, 1);
	assert_int_equal(script_answer(&s, (uint8_t)id), 1);
	assert_int_equal(s.dev.statistics.send_failed, 1);
	assert_int_equal(s.dev.statistics.resent, 0);
}

static uint8_t newest;

static void put_newest(pokeys_device_t *dev, mailbox_entry_t *entry, void *context)
{
	(void)dev;
	assert_ptr_equal(context, &newest);
	entry->request_buffer[8] = newest;
	/* a careless callback may spoil the header: it is completed afterwards */
	memset(entry->request_buffer, 0, 2);
	entry->request_buffer[6] = 0xFF;
}

static void write_is_sent_again_with_the_newest_value(void **state)
{
	uint8_t packet[POKEYS_PACKET_SIZE] = { 0xBB, OP_IO, 1 };
	uint8_t expected[POKEYS_PACKET_SIZE] = { 0xBB, OP_IO, 1 };
	int id;

	(void)state;
	script_init(&s, NULL);
	packet[8] = 1;
	id = pokeys_request_create(&s.dev, packet, POKEYS_CLASS_WRITE, NULL, put_newest, &newest);
	assert_int_equal(pokeys_request_send(&s.dev, (uint8_t)id, s.now), 0);
	assert_int_equal(script_last(&s)[8], 1);
	newest = 42;
	assert_int_equal(script_after(&s, 10 * MS), 1);
	expected[6] = (uint8_t)id;
	expected[7] = (uint8_t)(0xBB + OP_IO + 1 + id);
	expected[8] = 42;
	assert_memory_equal(script_last(&s), expected, sizeof(expected));
}

static void write_that_cannot_wait_is_sent_again_at_once(void **state)
{
	uint8_t packet[POKEYS_PACKET_SIZE] = { 0xBB, OP_IO, 1 };
	const struct pokeys_options options = { .retry_budget = 1 };
	uint8_t id;

	(void)state;
	script_init(&s, &options);
	id = (uint8_t)pokeys_request_create(&s.dev, packet, POKEYS_CLASS_WRITE, NULL, put_newest,
					    &newest);
	assert_int_equal(pokeys_request_resend(&s.dev, id, s.now), -EALREADY);
	assert_int_equal(pokeys_request_send(&s.dev, id, s.now), 0);
	s.now += 4 * MS;
	for (newest = 50; newest < 55; newest++) {
		assert_int_equal(pokeys_request_resend(&s.dev, id, s.now), 0);
		assert_int_equal(script_last(&s)[8], newest);
	}
	assert_int_equal(s.sent, 6);
	assert_int_equal(s.dev.statistics.resent, 5);
	assert_int_equal(s.dev.in_flight_count, 1);
	/* the deadline counts from then, and no retry is used up */
	assert_int_equal(script_after(&s, 10 * MS - 1), 0);
	for (unsigned int retry = 0; retry < 3; retry++)
		script_after(&s, 50 * MS);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_IN_FLIGHT);
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(pokeys_request_resend(&s.dev, id, s.now), -EALREADY);
	assert_int_equal(pokeys_request_free(&s.dev, id), 0);
	assert_int_equal(pokeys_request_resend(&s.dev, id, s.now), -ENOENT);
}

static void only_what_may_be_repeated_is_sent_again_at_once(void **state)
{
	const struct pokeys_options options = { .send_budget = 2 };
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	id = script_request(&s, OP_PULSE, SUB_HOME, NULL, 0);
	assert_int_equal(pokeys_request_resend(&s.dev, id, s.now), -EINVAL);
	assert_int_equal(s.sent, 1);
	script_init(&s, &options);
	id = script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(pokeys_request_resend(&s.dev, id, s.now), -EAGAIN);
	assert_int_equal(s.sent, 1);
	assert_int_equal(s.dev.statistics.refused_budget, 1);
}

static void cancel_in_refresh(pokeys_device_t *dev, mailbox_entry_t *entry, void *context)
{
	(void)context;
	assert_int_equal(pokeys_request_cancel(dev, entry->request_id, s.now), 0);
}

static void write_cancelled_while_refreshed_is_not_sent(void **state)
{
	const uint8_t packet[POKEYS_PACKET_SIZE] = { 0xBB, OP_IO, 1 };

	(void)state;
	script_init(&s, NULL);
	pokeys_request_create(&s.dev, packet, POKEYS_CLASS_WRITE, NULL, cancel_in_refresh, NULL);
	assert_int_equal(pokeys_request_send(&s.dev, 0, s.now), 0);
	assert_int_equal(script_after(&s, 10 * MS), 1);
	assert_int_equal(s.sent, 1);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_CANCELLED);
	assert_int_equal(s.dev.in_flight_count, 0);
	pokeys_request_create(&s.dev, packet, POKEYS_CLASS_WRITE, NULL, cancel_in_refresh, NULL);
	assert_int_equal(pokeys_request_send(&s.dev, 1, s.now), 0);
	assert_int_equal(pokeys_request_resend(&s.dev, 1, s.now), -ECANCELED);
	assert_int_equal(s.sent, 2);
	assert_int_equal(s.dev.in_flight_count, 0);
}

/* Each request of a series, with the n-th call of send failing, for every n. */
static void sweep_failing_send(int error)
{
	for (unsigned int n = 1; n <= 40; n++) {
		unsigned int done = 0;

		script_init(&s, NULL);
		s.send_error = error;
		s.fail_send = n;
		for (unsigned int i = 0; i < 40; i++) {
			const uint8_t id = script_request(&s, OP_READ, 0, NULL, 0);

			if (s.dev.mailbox[id].tries == 0) {
				assert_int_equal(script_answer(&s, id), 0);
				assert_int_equal(script_after(&s, 50 * MS), 1);
			}
			s.now += 400 * US;
			done += (unsigned int)script_answer(&s, id);
			assert_int_equal(pokeys_request_free(&s.dev, id), 0);
		}
		assert_int_equal(done, 40);
		assert_int_equal(s.sent, 40);
		assert_int_equal(s.dev.statistics.sent, 40);
		assert_int_equal(s.dev.statistics.resent, 0);
		assert_int_equal(s.dev.statistics.send_failed, 1);
		/* the packet did not leave: the answer is unambiguous, the link is not slow */
		assert_int_equal(s.dev.statistics.accepted_earlier_try, 0);
		assert_int_equal(s.dev.statistics.rtt_max_ns, 400 * US);
		assert_int_equal(s.dev.backoff, 0);
	}
}

static void every_nth_send_that_fails_is_made_good(void **state)
{
	(void)state;
	sweep_failing_send(-EAGAIN);
	sweep_failing_send(-ENOBUFS);
	sweep_failing_send(-ENETUNREACH);
}

static void round_trip_is_not_counted_from_a_resend_that_was_refused(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	id = script_request(&s, OP_READ, 0, NULL, 0);
	s.send_error = -EAGAIN;
	assert_int_equal(script_after(&s, 10 * MS), 1);
	s.now += 1 * MS;
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(s.dev.statistics.rtt_last_ns, 11 * MS);
	assert_int_equal(s.dev.statistics.accepted_earlier_try, 0);
}

static void send_that_always_fails_still_ends_the_request(void **state)
{
	(void)state;
	script_init(&s, NULL);
	s.send_error = -ENOBUFS;
	script_request(&s, OP_READ, 0, NULL, 0);
	for (unsigned int i = 0; i < 4; i++)
		assert_int_equal(script_after(&s, 50 * MS), 1);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_TIMED_OUT);
	assert_int_equal(s.dev.statistics.send_failed, 4);
	assert_int_equal(s.dev.statistics.sent, 0);
}

/* The most transmissions in any second, the times of each being given. */
static unsigned int busiest_second(const uint64_t *times, unsigned int count)
{
	unsigned int most = 0, first = 0;

	for (unsigned int i = 0; i < count; i++) {
		while (times[i] - times[first] >= S)
			first++;
		if (i - first + 1 > most)
			most = i - first + 1;
	}
	return most;
}

static void no_second_sees_more_resends_than_their_budget(void **state)
{
	static const uint32_t budgets[] = { 1, 2, 7, 20, 50, 200 };
	static uint64_t times[100000];

	(void)state;
	for (unsigned int b = 0; b < 6; b++) {
		const struct pokeys_options options = {
			.retry_budget = budgets[b],
			.window = 64,
			.reply_lifetime_ns = 10 * MS,
			.deadline_ceiling_ns = 2 * MS,
		};
		unsigned int count = 0;

		script_init(&s, &options);
		for (unsigned int ms = 0; ms < 5000; ms++) {
			uint64_t before;
			int id;

			while ((id = CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0)) >= 0)
				pokeys_request_send(&s.dev, (uint8_t)id, s.now);
			before = s.dev.statistics.resent;
			script_after(&s, 1 * MS);
			for (; before < s.dev.statistics.resent; before++)
				times[count++] = s.now;
			for (id = 0; id < 256; id++)
				pokeys_request_free(&s.dev, (uint8_t)id);
		}
		assert_true(count >= 4 * budgets[b]);
		assert_true(busiest_second(times, count) <= budgets[b]);
		assert_true(s.dev.statistics.refused_budget > 0);
	}
}

static void no_second_sees_more_transmissions_than_their_budget(void **state)
{
	static uint64_t times[100000];
	const struct pokeys_options options = {
		.send_budget = 1000,
		.retry_budget = 100000,
		.window = 64,
		.reply_lifetime_ns = 5 * MS,
		.deadline_ceiling_ns = 1 * MS,
	};

	(void)state;
	script_init(&s, &options);
	s.times = times;
	for (unsigned int step = 0; step < 20000; step++) {
		int id = CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0);

		if (id >= 0 && pokeys_request_send(&s.dev, (uint8_t)id, s.now) == -EAGAIN)
			assert_int_equal(pokeys_request_state(&s.dev, (uint8_t)id),
					 POKEYS_REQUEST_CREATED);
		script_after(&s, 200 * US);
		for (id = 0; id < 256; id++) {
			if (pokeys_request_state(&s.dev, (uint8_t)id) == POKEYS_REQUEST_CREATED)
				pokeys_request_cancel(&s.dev, (uint8_t)id, s.now);
			pokeys_request_free(&s.dev, (uint8_t)id);
		}
	}
	assert_true(s.sent >= 3800);
	assert_true(busiest_second(times, s.sent) <= 1000);
	assert_true(s.dev.statistics.resent > 0);
}

static void request_whose_resend_the_budget_refuses_still_ends(void **state)
{
	const struct pokeys_options options = { .retry_budget = 1, .window = 64 };
	unsigned int open = 64;

	(void)state;
	script_init(&s, &options);
	for (unsigned int i = 0; i < 64; i++)
		script_request(&s, OP_READ, 0, NULL, 0);
	for (unsigned int ms = 0; ms < 250 && open; ms += 10) {
		script_after(&s, 10 * MS);
		open = s.dev.in_flight_count;
	}
	assert_int_equal(open, 0);
	assert_int_equal(s.dev.statistics.timed_out, 64);
	assert_int_equal(s.dev.statistics.resent, 1);
}

static void stall_of_five_seconds_is_followed_by_no_burst(void **state)
{
	const struct pokeys_options options = { .window = 64 };
	unsigned int before, most = 0;

	(void)state;
	script_init(&s, &options);
	for (unsigned int i = 0; i < 64; i++)
		script_request(&s, OP_READ, 0, NULL, 0);
	s.now += 5 * S;
	for (unsigned int cycle = 0; cycle < 100; cycle++) {
		before = s.sent;
		script_after(&s, 1 * MS);
		if (s.sent - before > most)
			most = s.sent - before;
	}
	/* a twentieth of a second's budget of 200, then no faster than the budget */
	assert_true(most <= 10);
	assert_true(s.sent - 64 <= 10 + 20);
	/* the next deadlines count from the end of the stall */
	assert_true(pokeys_device_next_deadline(&s.dev) > s.now);
}

static void answers_from_during_a_stall_come_before_any_resend(void **state)
{
	uint8_t reply[POKEYS_PACKET_SIZE];

	(void)state;
	script_init(&s, NULL);
	for (unsigned int i = 0; i < 8; i++) {
		script_request(&s, OP_READ, 0, NULL, 0);
		script_reply_to(script_last(&s), reply);
		script_post(&s, reply, sizeof(reply));
		s.inbox[i].rx.t_ns = s.now + 300 * US;
	}
	s.now += 5 * S;
	assert_int_equal(pokeys_device_receive(&s.dev, s.now), 8);
	assert_int_equal(script_after(&s, 0), 0);
	assert_int_equal(s.sent, 8);
	assert_int_equal(s.dev.statistics.rtt_max_ns, 300 * US);
}

static void counters_go_on_past_32_bits(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	s.dev.statistics.created = s.dev.statistics.sent = s.dev.statistics.accepted = UINT32_MAX;
	s.dev.serial = UINT32_MAX;
	s.now = (1ull << 32) - 100;
	id = script_request(&s, OP_READ, 0, NULL, 0);
	s.now += 200;
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(s.dev.statistics.rtt_last_ns, 200);
	assert_true(s.dev.statistics.created == 1ull << 32);
	assert_true(s.dev.statistics.sent == 1ull << 32);
	assert_true(s.dev.statistics.accepted == 1ull << 32);
	assert_true(pokeys_request_get(&s.dev, id)->serial == 1ull << 32);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(lost_request_is_sent_again_unchanged_and_answered),
		cmocka_unit_test(request_without_answer_ends_after_its_retries),
		cmocka_unit_test(answer_after_its_deadline_is_late_and_not_lost),
		cmocka_unit_test(request_never_answered_is_lost_once_its_id_is_used_again),
		cmocka_unit_test(every_try_of_a_request_that_timed_out_is_late_or_lost),
		cmocka_unit_test(answer_to_the_only_try_is_late_though_no_resend_was_taken),
		cmocka_unit_test(oneshot_is_sent_once_and_its_end_is_unknown),
		cmocka_unit_test(oneshot_that_the_transport_refused_may_be_sent_later),
		cmocka_unit_test(write_is_sent_again_with_the_newest_value),
		cmocka_unit_test(write_that_cannot_wait_is_sent_again_at_once),
		cmocka_unit_test(only_what_may_be_repeated_is_sent_again_at_once),
		cmocka_unit_test(write_cancelled_while_refreshed_is_not_sent),
		cmocka_unit_test(every_nth_send_that_fails_is_made_good),
		cmocka_unit_test(round_trip_is_not_counted_from_a_resend_that_was_refused),
		cmocka_unit_test(send_that_always_fails_still_ends_the_request),
		cmocka_unit_test(no_second_sees_more_resends_than_their_budget),
		cmocka_unit_test(no_second_sees_more_transmissions_than_their_budget),
		cmocka_unit_test(request_whose_resend_the_budget_refuses_still_ends),
		cmocka_unit_test(stall_of_five_seconds_is_followed_by_no_burst),
		cmocka_unit_test(answers_from_during_a_stall_come_before_any_resend),
		cmocka_unit_test(counters_go_on_past_32_bits),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
