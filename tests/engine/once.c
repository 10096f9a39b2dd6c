/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Requests that a newer one replaces: missed at their deadline and sent once more if none has,
 * answered late, or ended by a newer one or at the ceiling.
 */

#include "tests/engine/script.h"

static struct script s;

static uint8_t once(uint8_t op)
{
	const int id = CreateRequestAsync(&s.dev, op, NULL, 0, NULL, 0);

	assert_in_range(id, 0, 255);
	assert_int_equal(pokeys_request_set_once(&s.dev, (uint8_t)id), 0);
	assert_int_equal(pokeys_request_send(&s.dev, (uint8_t)id, s.now), 0);
	return (uint8_t)id;
}

static void the_newest_is_sent_once_more(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	id = once(OP_READ);
	assert_int_equal(script_after(&s, 10 * MS - 1), 0);
	assert_int_equal(script_after(&s, 1), 1);
	assert_int_equal(s.sent, 2);
	assert_int_equal(s.dev.statistics.resent, 1);
	script_after(&s, 20 * MS);
	assert_int_equal(s.sent, 2);
	assert_int_equal(s.dev.statistics.missed, 2);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_IN_FLIGHT);
	assert_int_equal(script_answer(&s, id), 1);
}

static void one_that_was_replaced_is_not_sent_again(void **state)
{
	uint8_t older, newer;

	(void)state;
	script_init(&s, NULL);
	older = once(OP_READ);
	script_after(&s, 1 * MS);
	newer = once(OP_READ);
	script_after(&s, 9 * MS);
	assert_int_equal(s.dev.statistics.missed, 1);
	assert_int_equal(s.sent, 2);
	script_after(&s, 50 * MS);
	assert_int_equal(s.sent, 3);
	assert_int_equal(script_last(&s)[6], newer);
	assert_int_equal(pokeys_request_state(&s.dev, older), POKEYS_REQUEST_CANCELLED);
}

/* Of another operation, nothing is replaced. */
static void each_operation_is_a_kind_of_its_own(void **state)
{
	(void)state;
	script_init(&s, NULL);
	once(OP_READ);
	script_after(&s, 1 * MS);
	once(OP_IO);
	script_after(&s, 50 * MS);
	assert_int_equal(s.sent, 4);
}

static void a_late_answer_is_taken_and_teaches(void **state)
{
	uint8_t older, newer;

	(void)state;
	script_init(&s, NULL);
	older = once(OP_READ);
	script_after(&s, 1 * MS);
	newer = once(OP_READ);
	script_after(&s, 29 * MS);
	assert_int_equal(script_answer(&s, older), 1);
	assert_int_equal(s.dev.statistics.late, 1);
	assert_int_equal(s.dev.statistics.rtt_last_ns, 30 * MS);
	assert_int_equal(pokeys_request_state(&s.dev, newer), POKEYS_REQUEST_IN_FLIGHT);
}

static void an_answer_ends_older_ones_that_are_late(void **state)
{
	uint8_t late, on_time, newer;

	(void)state;
	script_init(&s, NULL);
	late = once(OP_READ);
	script_after(&s, 15 * MS);
	on_time = once(OP_READ);
	newer = once(OP_READ);
	assert_int_equal(script_answer(&s, newer), 1);
	assert_int_equal(pokeys_request_state(&s.dev, late), POKEYS_REQUEST_CANCELLED);
	assert_int_equal(pokeys_request_state(&s.dev, on_time), POKEYS_REQUEST_IN_FLIGHT);
	/* it is the newest in flight, but what it asks is known */
	assert_int_equal(script_after(&s, 5 * MS), 0);
	assert_int_equal(script_after(&s, 15 * MS), 0);
	assert_int_equal(script_answer(&s, on_time), 1);
	/* too late to be taken, but known to have arrived */
	assert_int_equal(script_answer(&s, late), 0);
	assert_int_equal(s.dev.statistics.late, 2);
}

static void late_ones_do_not_fill_the_window(void **state)
{
	const struct pokeys_options options = {
		.retries = POKEYS_NO_RETRIES,
		.deadline_ceiling_ns = 1 * S,
		.window = 32,
	};

	(void)state;
	script_init(&s, &options);
	for (unsigned int i = 0; i < 20; i++) {
		once(OP_READ);
		script_after(&s, 600 * MS);
	}
	assert_in_range(s.dev.open_count, 1, 2);
}

static void in_a_full_window_the_oldest_gives_its_place(void **state)
{
	const struct pokeys_options options = { .window = 4 };
	uint8_t oldest;

	(void)state;
	script_init(&s, &options);
	script_request(&s, OP_IO, 0, NULL, 0);
	oldest = once(OP_READ);
	once(OP_READ);
	script_request(&s, OP_IO, 0, NULL, 0);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_IO, NULL, 0, NULL, 0), -EBUSY);
	once(OP_READ);
	assert_int_equal(pokeys_request_state(&s.dev, oldest), POKEYS_REQUEST_CANCELLED);
	assert_int_equal(s.dev.open_count, 4);
}

static void it_ends_at_the_ceiling(void **state)
{
	const struct pokeys_options options = { .retries = POKEYS_NO_RETRIES };
	uint8_t id;

	(void)state;
	script_init(&s, &options);
	id = once(OP_READ);
	script_after(&s, 10 * MS);
	script_after(&s, 40 * MS - 1);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_IN_FLIGHT);
	assert_int_equal(pokeys_device_next_deadline(&s.dev), s.now + 1);
	assert_int_equal(script_after(&s, 1), 1);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_CANCELLED);
	assert_int_equal(s.dev.statistics.cancelled, 1);
	assert_int_equal(s.dev.statistics.timed_out, 0);
	assert_int_equal(s.sent, 1);
	/* an answer that comes even later */
	assert_int_equal(script_answer(&s, id), 0);
	assert_int_equal(s.dev.statistics.late, 1);
}

static void one_that_never_left_ends_at_its_deadline(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	s.send_error = -ENOBUFS;
	id = once(OP_READ);
	assert_int_equal(script_after(&s, 10 * MS), 1);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_CANCELLED);
	assert_int_equal(s.dev.statistics.missed, 1);
	assert_int_equal(s.dev.statistics.lost, 1);
}

/* A part is always lost on a bad link; four in a row say that the deadline is too short. */
static void several_in_a_row_double_the_deadline(void **state)
{
	const struct pokeys_options options = { .retries = POKEYS_NO_RETRIES };

	(void)state;
	script_init(&s, &options);
	for (unsigned int i = 0; i < 12; i++) {
		once(OP_READ);
		script_after(&s, 10 * MS);
		assert_int_equal(s.dev.backoff, 0);
		if (i % 3 == 2) {
			const uint8_t id = script_request(&s, OP_READ, 0, NULL, 0);

			assert_int_equal(script_answer(&s, id), 1);
		}
	}
	for (unsigned int i = 0; i < 4; i++) {
		assert_int_equal(s.dev.backoff, 0);
		once(OP_READ);
		script_after(&s, 10 * MS);
	}
	assert_int_equal(s.dev.backoff, 1);
	/* no more than that, until it is a silence: a stop may have to be sent again meanwhile */
	for (unsigned int i = 4; i < 23; i++) {
		once(OP_READ);
		script_after(&s, 10 * MS);
		assert_int_equal(s.dev.backoff, 1);
	}
	for (unsigned int i = 0; i < 4; i++) {
		once(OP_READ);
		script_after(&s, 100 * MS);
	}
	assert_true(s.dev.backoff > 1);
}

static void it_can_only_be_said_before_it_is_sent(void **state)
{
	const uint8_t home = SUB_HOME;
	uint8_t id;
	int one_shot;

	(void)state;
	script_init(&s, NULL);
	assert_int_equal(pokeys_request_set_once(&s.dev, 7), -ENOENT);
	id = script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(pokeys_request_set_once(&s.dev, id), -EALREADY);
	one_shot = CreateRequestAsync(&s.dev, OP_PULSE, &home, 1, NULL, 0);
	assert_in_range(one_shot, 0, 255);
	assert_int_equal(pokeys_request_set_once(&s.dev, (uint8_t)one_shot), -EINVAL);
}

/* A bad link: a request every 300 us, of which none is answered. */
static void ids_of_unanswered_ones_do_not_run_out(void **state)
{
	uint64_t used[256] = { 0 };

	(void)state;
	script_init(&s, NULL);
	for (unsigned int i = 0; i < 2000; i++) {
		const uint8_t id = once(OP_READ);

		assert_true(!used[id] || s.now - used[id] >= 100 * MS);
		used[id] = s.now;
		script_after(&s, 400 * US);
		assert_int_equal(pokeys_request_cancel(&s.dev, id, s.now), 0);
		assert_int_equal(pokeys_request_free(&s.dev, id), 0);
	}
	assert_int_equal(s.dev.statistics.refused_id, 0);
}

/* At a lower rate they rest as long as others do. */
static void ids_rest_longer_as_long_as_there_are_others(void **state)
{
	unsigned int requests = 0;
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	id = once(OP_READ);
	pokeys_request_cancel(&s.dev, id, s.now);
	pokeys_request_free(&s.dev, id);
	do {
		const uint8_t other = script_request(&s, OP_READ, 0, NULL, 0);

		assert_int_equal(script_answer(&s, other), 1);
		pokeys_request_free(&s.dev, other);
		requests += other == id ? 10001 : 1;
		script_after(&s, 1 * MS);
	} while (requests < 10000);
	assert_in_range(requests, 10512, 10512 + 256);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_newest_is_sent_once_more),
		cmocka_unit_test(one_that_was_replaced_is_not_sent_again),
		cmocka_unit_test(each_operation_is_a_kind_of_its_own),
		cmocka_unit_test(a_late_answer_is_taken_and_teaches),
		cmocka_unit_test(an_answer_ends_older_ones_that_are_late),
		cmocka_unit_test(late_ones_do_not_fill_the_window),
		cmocka_unit_test(in_a_full_window_the_oldest_gives_its_place),
		cmocka_unit_test(it_ends_at_the_ceiling),
		cmocka_unit_test(one_that_never_left_ends_at_its_deadline),
		cmocka_unit_test(several_in_a_row_double_the_deadline),
		cmocka_unit_test(it_can_only_be_said_before_it_is_sent),
		cmocka_unit_test(ids_of_unanswered_ones_do_not_run_out),
		cmocka_unit_test(ids_rest_longer_as_long_as_there_are_others),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
