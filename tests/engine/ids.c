/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Request ids: cyclic, never used while an answer to an earlier use could
 * still come, and as far apart as eight bits allow (fault 4).
 */

#include "tests/engine/script.h"

static struct script s;

/* One request, answered at once and freed; its id. */
static uint8_t clean(uint8_t op, uint8_t p1)
{
	const uint8_t id = script_request(&s, op, p1, NULL, 0);

	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(pokeys_request_free(&s.dev, id), 0);
	return id;
}

static void cancel(uint8_t id)
{
	assert_int_equal(pokeys_request_cancel(&s.dev, id, s.now), 0);
	assert_int_equal(pokeys_request_free(&s.dev, id), 0);
}

/* Until this id is handed out again, with 1 ms between requests. How long it took. */
static uint64_t time_until_reused(uint8_t id)
{
	const uint64_t start = s.now;

	for (unsigned int i = 0; i < 4000; i++) {
		script_after(&s, 1 * MS);
		if (clean(OP_READ, 0) == id)
			return s.now - start;
	}
	fail_msg("id %u never came again", id);
	return 0;
}

static void ids_go_round_from_the_first_one(void **state)
{
	struct pokeys_options options = { .first_id = 250 };

	(void)state;
	script_init(&s, &options);
	for (unsigned int i = 0; i < 3 * 256; i++) {
		assert_int_equal(clean(OP_READ, 0), (250 + i) % 256);
		script_after(&s, 1 * MS);
	}
}

/* The id that a request of yet another operation gets when it is id 0's turn. */
static uint8_t next_from_zero(uint8_t op)
{
	s.dev.next_id = 0;
	return clean(op, 0);
}

static void id_of_an_answered_request_rests_a_little(void **state)
{
	(void)state;
	script_init(&s, NULL);
	clean(OP_READ, 0);
	assert_int_equal(next_from_zero(OP_IO), 1);
	script_after(&s, 20 * MS - 1);
	assert_int_equal(next_from_zero(OP_IO), 2);
	script_after(&s, 1);
	assert_int_equal(next_from_zero(OP_IO), 0);
}

static void each_copy_of_the_answer_makes_the_id_rest_again(void **state)
{
	(void)state;
	script_init(&s, NULL);
	clean(OP_READ, 0);
	for (unsigned int i = 0; i < 10; i++) {
		script_after(&s, 15 * MS);
		assert_int_equal(script_answer(&s, 0), 0);
		assert_int_not_equal(next_from_zero(OP_IO), 0);
	}
	assert_int_equal(s.dev.statistics.duplicate, 10);
	script_after(&s, 20 * MS);
	assert_int_equal(next_from_zero(OP_IO), 0);
}

static void id_of_an_unanswered_request_rests_for_the_lifetime_of_a_reply(void **state)
{
	(void)state;
	script_init(&s, NULL);
	for (unsigned int i = 0; i < 4; i++)
		cancel(script_request(&s, OP_READ, 0, NULL, 0));
	script_after(&s, 500 * MS - 1);
	assert_int_equal(next_from_zero(OP_IO), 4);
	/* the lifetime is over, but the next turns pass over it as well */
	script_after(&s, 1);
	assert_true(time_until_reused(0) >= 500 * MS);
}

static void id_of_a_timed_out_request_rests(void **state)
{
	const struct pokeys_options options = { .retries = POKEYS_NO_RETRIES };

	(void)state;
	script_init(&s, &options);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(script_after(&s, 10 * MS), 1);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_TIMED_OUT);
	assert_int_equal(pokeys_request_free(&s.dev, 0), 0);
	assert_true(time_until_reused(0) >= 500 * MS);
}

/* The other try may be answered as well, later. */
static void id_of_a_request_answered_after_a_resend_rests(void **state)
{
	(void)state;
	script_init(&s, NULL);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(script_after(&s, 10 * MS), 1);
	assert_int_equal(script_answer(&s, 0), 1);
	assert_int_equal(pokeys_request_free(&s.dev, 0), 0);
	assert_true(time_until_reused(0) >= 500 * MS);
}

static void reset_does_not_free_ids_that_may_still_be_answered(void **state)
{
	(void)state;
	script_init(&s, NULL);
	cancel(script_request(&s, OP_READ, 0, NULL, 0));
	pokeys_device_reset(&s.dev, s.now);
	assert_true(time_until_reused(0) >= 500 * MS);
}

/* At ten requests a second a lifetime is over long before the id comes round. */
static void doubtful_id_is_passed_over_for_two_turns_however_slow_they_are(void **state)
{
	unsigned int requests = 0;

	(void)state;
	script_init(&s, NULL);
	cancel(script_request(&s, OP_READ, 0, NULL, 0));
	do {
		script_after(&s, 100 * MS);
		requests++;
	} while (clean(OP_READ, 0) != 0);
	assert_in_range(requests, 512, 512 + 256);
}

static void id_that_never_left_is_free_at_once(void **state)
{
	(void)state;
	script_init(&s, NULL);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), 0);
	cancel(0);
	assert_int_equal(next_from_zero(OP_IO), 0);
}

static void no_free_id_refuses_and_nothing_is_reused(void **state)
{
	(void)state;
	script_init(&s, NULL);
	for (unsigned int i = 0; i < 256; i++) {
		cancel(script_request(&s, OP_READ, 0, NULL, 0));
		script_after(&s, 1 * MS);
	}
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), -EAGAIN);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), -EAGAIN);
	assert_int_equal(s.dev.statistics.refused_id, 2);
	assert_int_equal(s.dev.statistics.created, 256);
	/* 256 ms have passed; the first id is free at 500 ms */
	script_after(&s, 244 * MS - 1);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), -EAGAIN);
	script_after(&s, 1);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), 0);
}

static void entry_that_is_not_given_back_is_not_taken(void **state)
{
	(void)state;
	script_init(&s, NULL);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(script_answer(&s, 0), 1);
	for (unsigned int i = 0; i < 600; i++) {
		script_after(&s, 1 * MS);
		assert_int_not_equal(clean(OP_READ, 0), 0);
	}
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_DONE);
}

/* A caller that knows only create, send, receive and check gives nothing back. */
static void mailbox_whose_entries_are_never_given_back_goes_on(void **state)
{
	(void)state;
	script_init(&s, NULL);
	for (unsigned int i = 0; i < 4 * 256; i++) {
		const uint8_t id = script_request(&s, OP_READ, 0, NULL, 0);

		assert_int_equal(id, i % 256);
		assert_int_equal(script_answer(&s, id), 1);
		script_after(&s, 1 * MS);
	}
	assert_int_equal(s.dev.statistics.refused_id, 0);
}

static void ended_entry_is_kept_for_128_requests_though_no_id_is_free(void **state)
{
	(void)state;
	script_init(&s, NULL);
	for (unsigned int i = 0; i < 129; i++)
		cancel(script_request(&s, OP_READ, 0, NULL, 0));
	for (unsigned int i = 0; i < 127; i++) {
		script_request(&s, OP_READ, 0, NULL, 0);
		assert_int_equal(script_answer(&s, (uint8_t)(129 + i)), 1);
		script_after(&s, 1 * MS);
	}
	script_after(&s, 20 * MS);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), -EAGAIN);
	assert_int_equal(pokeys_request_state(&s.dev, 129), POKEYS_REQUEST_DONE);
	script_after(&s, 353 * MS);
	/* the lifetime of an answer is over: the first 129 are free, and one more is made */
	assert_int_equal(script_request(&s, OP_READ, 0, NULL, 0), 0);
	assert_int_equal(pokeys_request_state(&s.dev, 129), POKEYS_REQUEST_DONE);
}

static void left_entry_rests_like_one_that_was_given_back(void **state)
{
	const struct pokeys_options options = { .retries = POKEYS_NO_RETRIES };

	(void)state;
	script_init(&s, &options);
	for (unsigned int i = 0; i < 256; i++) {
		script_request(&s, OP_READ, 0, NULL, 0);
		assert_int_equal(pokeys_request_cancel(&s.dev, (uint8_t)i, s.now), 0);
		script_after(&s, 1 * MS);
	}
	script_after(&s, 244 * MS - 1);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), -EAGAIN);
	script_after(&s, 1);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), 0);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), -EAGAIN);
}

/* Two or more operations taking turns: the same one comes back to an id after two turns. */
static void id_comes_back_to_the_same_operation_after_two_turns(void **state)
{
	static const uint8_t ops[] = { OP_IO, OP_READ, 0x3A, 0x05 };
	unsigned int last[256][256], request = 1, shortest;

	(void)state;
	for (unsigned int n = 2; n <= 4; n++) {
		script_init(&s, NULL);
		memset(last, 0, sizeof(last));
		shortest = UINT32_MAX;
		for (request = 1; request < 8000; request++) {
			const uint8_t op = ops[request % n];
			const uint8_t id = clean(op, 0);
			const unsigned int distance = request - last[op][id];

			if (last[op][id] && distance < shortest)
				shortest = distance;
			last[op][id] = request;
			script_after(&s, 500 * US);
		}
		assert_true(shortest >= 500);
	}
}

static void status_and_its_check_byte_repeat_only_after_255_turns(void **state)
{
	unsigned int last[256][256] = { { 0 } };

	(void)state;
	script_init(&s, NULL);
	for (unsigned int request = 1; request < 300 * 256; request++) {
		const uint8_t id = clean(OP_PULSE, SUB_STATUS);
		unsigned int *used = &last[id][script_last(&s)[3]];

		assert_true(!*used || request - *used >= 255 * 256);
		*used = request;
		script_after(&s, 500 * US);
	}
}

static void three_thousand_requests_a_second_find_ids(void **state)
{
	(void)state;
	script_init(&s, NULL);
	for (unsigned int i = 0; i < 30000; i++) {
		clean(OP_IO, 1);
		script_after(&s, 333 * US);
	}
	assert_int_equal(s.dev.statistics.refused_id, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(ids_go_round_from_the_first_one),
		cmocka_unit_test(id_of_an_answered_request_rests_a_little),
		cmocka_unit_test(each_copy_of_the_answer_makes_the_id_rest_again),
		cmocka_unit_test(id_of_an_unanswered_request_rests_for_the_lifetime_of_a_reply),
		cmocka_unit_test(id_of_a_timed_out_request_rests),
		cmocka_unit_test(id_of_a_request_answered_after_a_resend_rests),
		cmocka_unit_test(reset_does_not_free_ids_that_may_still_be_answered),
		cmocka_unit_test(doubtful_id_is_passed_over_for_two_turns_however_slow_they_are),
		cmocka_unit_test(id_that_never_left_is_free_at_once),
		cmocka_unit_test(no_free_id_refuses_and_nothing_is_reused),
		cmocka_unit_test(entry_that_is_not_given_back_is_not_taken),
		cmocka_unit_test(mailbox_whose_entries_are_never_given_back_goes_on),
		cmocka_unit_test(ended_entry_is_kept_for_128_requests_though_no_id_is_free),
		cmocka_unit_test(left_entry_rests_like_one_that_was_given_back),
		cmocka_unit_test(id_comes_back_to_the_same_operation_after_two_turns),
		cmocka_unit_test(status_and_its_check_byte_repeat_only_after_255_turns),
		cmocka_unit_test(three_thousand_requests_a_second_find_ids),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
