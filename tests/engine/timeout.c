/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The timeout that a caller chooses: which requests it is for, what it is
 * counted from, and that the budgets and the adaptive deadline stay what they
 * are. In virtual time; specified.c has the same with a clock.
 */

#include "tests/engine/script.h"

static struct script s;

static uint64_t deadline(void)
{
	struct pokeys_statistics statistics;

	pokeys_device_statistics(&s.dev, &statistics);
	return statistics.deadline_ns;
}

static void try_waits_for_the_timeout_and_no_longer(void **state)
{
	(void)state;
	script_init(&s, NULL);
	pokeys_device_set_timeout(&s.dev, 3 * MS);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(pokeys_device_next_deadline(&s.dev), s.now + 3 * MS);
	for (unsigned int sent = 2; sent <= 4; sent++) {
		assert_int_equal(script_after(&s, 3 * MS - 1), 0);
		assert_int_equal(script_after(&s, 1), 1);
		assert_int_equal(s.sent, sent);
	}
	assert_int_equal(script_after(&s, 3 * MS - 1), 0);
	assert_int_equal(script_after(&s, 1), 1);
	assert_int_equal(s.sent, 4);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_TIMED_OUT);
}

static void timeout_is_for_requests_in_flight_as_well(void **state)
{
	(void)state;
	script_init(&s, NULL);
	script_request(&s, OP_READ, 0, NULL, 0);
	script_after(&s, 2 * MS);
	pokeys_device_set_timeout(&s.dev, 3 * MS);
	assert_int_equal(script_after(&s, 1 * MS - 1), 0);
	assert_int_equal(script_after(&s, 1), 1);
	/* longer again: counted from the second transmission */
	pokeys_device_set_timeout(&s.dev, 40 * MS);
	assert_int_equal(script_after(&s, 40 * MS - 1), 0);
	assert_int_equal(script_after(&s, 1), 1);
}

static void timeout_without_end_never_ends(void **state)
{
	(void)state;
	script_init(&s, NULL);
	pokeys_device_set_timeout(&s.dev, UINT64_MAX);
	script_request(&s, OP_READ, 0, NULL, 0);
	script_request(&s, OP_PULSE, SUB_HOME, NULL, 0);
	assert_int_equal(pokeys_device_next_deadline(&s.dev), UINT64_MAX);
	for (unsigned int day = 0; day < 1000; day++)
		assert_int_equal(script_after(&s, 86400 * S), 0);
	assert_int_equal(s.sent, 2);
	assert_int_equal(script_answer(&s, 0), 1);
}

static void without_timeout_the_deadline_adapts_again(void **state)
{
	uint64_t adaptive;

	(void)state;
	script_init(&s, NULL);
	adaptive = deadline();
	pokeys_device_set_timeout(&s.dev, 30 * MS);
	assert_int_equal(deadline(), 30 * MS);
	script_request(&s, OP_READ, 0, NULL, 0);
	pokeys_device_set_timeout(&s.dev, 0);
	assert_int_equal(deadline(), adaptive);
	assert_int_equal(pokeys_device_next_deadline(&s.dev), s.now + adaptive);
}

/* It was not the adaptive deadline that was missed. */
static void missed_timeout_does_not_double_the_deadline(void **state)
{
	uint64_t adaptive;

	(void)state;
	script_init(&s, NULL);
	adaptive = deadline();
	pokeys_device_set_timeout(&s.dev, 1 * MS);
	script_request(&s, OP_READ, 0, NULL, 0);
	for (unsigned int i = 0; i < 4; i++)
		assert_int_equal(script_after(&s, 1 * MS), 1);
	assert_int_equal(s.dev.statistics.timed_out, 1);
	pokeys_device_set_timeout(&s.dev, 0);
	assert_int_equal(deadline(), adaptive);
}

static void round_trip_is_measured_whatever_the_timeout(void **state)
{
	(void)state;
	script_init(&s, NULL);
	pokeys_device_set_timeout(&s.dev, 20 * MS);
	script_request(&s, OP_READ, 0, NULL, 0);
	s.now += 1 * MS;
	assert_int_equal(script_answer(&s, 0), 1);
	assert_int_equal(s.dev.statistics.rtt_last_ns, 1 * MS);
	assert_int_equal(deadline(), 20 * MS);
}

static void oneshot_waits_for_the_longer_of_timeout_and_ceiling(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	pokeys_device_set_timeout(&s.dev, 1 * MS);
	id = script_request(&s, OP_PULSE, SUB_HOME, NULL, 0);
	assert_int_equal(script_after(&s, 50 * MS - 1), 0);
	pokeys_device_set_timeout(&s.dev, 80 * MS);
	assert_int_equal(script_after(&s, 30 * MS), 0);
	assert_int_equal(script_after(&s, 1), 1);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_UNKNOWN);
	assert_int_equal(s.sent, 1);
}

static void deadline_of_a_requests_own_goes_before_the_timeout(void **state)
{
	int id;

	(void)state;
	script_init(&s, NULL);
	id = CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0);
	assert_int_equal(pokeys_request_set_deadline(&s.dev, (uint8_t)id, 2 * S), 0);
	assert_int_equal(pokeys_request_send(&s.dev, (uint8_t)id, s.now), 0);
	pokeys_device_set_timeout(&s.dev, 1 * MS);
	assert_int_equal(script_after(&s, 2 * S - 1), 0);
	assert_int_equal(script_after(&s, 1), 1);
}

/* A transport without room: the retries must not be gone before there is some. */
static void refused_transmission_waits_for_the_timeout_too(void **state)
{
	(void)state;
	script_init(&s, NULL);
	s.send_error = -ENOBUFS;
	script_request(&s, OP_READ, 0, NULL, 0);
	pokeys_device_set_timeout(&s.dev, 3 * MS);
	assert_int_equal(script_after(&s, 3 * MS - 1), 0);
	s.send_error = 0;
	assert_int_equal(script_after(&s, 1), 1);
	assert_int_equal(s.sent, 1);
	assert_int_equal(script_answer(&s, 0), 1);
}

static void shortest_timeout_keeps_to_the_budget_of_resends(void **state)
{
	const struct pokeys_options options = { .retries = 20, .window = 64 };

	(void)state;
	script_init(&s, &options);
	pokeys_device_set_timeout(&s.dev, 1);
	for (unsigned int i = 0; i < 64; i++)
		script_request(&s, OP_READ, 0, NULL, 0);
	for (unsigned int i = 0; i < 100; i++)
		script_after(&s, 10 * US);
	assert_int_equal(s.dev.in_flight_count, 0);
	assert_in_range(s.dev.statistics.resent, 10, 11);
}

static void timeout_outlasts_a_reset(void **state)
{
	(void)state;
	script_init(&s, NULL);
	pokeys_device_set_timeout(&s.dev, 7 * MS);
	pokeys_device_reset(&s.dev, s.now);
	assert_int_equal(deadline(), 7 * MS);
}

/* A device that takes its time: longer than an answer lives without a timeout. */
static void answer_within_a_long_timeout_is_taken(void **state)
{
	uint8_t id;

	(void)state;
	script_init(&s, NULL);
	pokeys_device_set_timeout(&s.dev, 5 * S);
	id = script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(script_after(&s, 4 * S), 0);
	assert_int_equal(script_answer(&s, id), 1);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_DONE);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(try_waits_for_the_timeout_and_no_longer),
		cmocka_unit_test(timeout_is_for_requests_in_flight_as_well),
		cmocka_unit_test(timeout_without_end_never_ends),
		cmocka_unit_test(without_timeout_the_deadline_adapts_again),
		cmocka_unit_test(missed_timeout_does_not_double_the_deadline),
		cmocka_unit_test(round_trip_is_measured_whatever_the_timeout),
		cmocka_unit_test(oneshot_waits_for_the_longer_of_timeout_and_ceiling),
		cmocka_unit_test(deadline_of_a_requests_own_goes_before_the_timeout),
		cmocka_unit_test(refused_transmission_waits_for_the_timeout_too),
		cmocka_unit_test(shortest_timeout_keeps_to_the_budget_of_resends),
		cmocka_unit_test(timeout_outlasts_a_reset),
		cmocka_unit_test(answer_within_a_long_timeout_is_taken),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
