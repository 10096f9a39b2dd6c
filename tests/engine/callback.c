/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Parsers: called exactly once for each end of a request, whichever it is, and
 * free to create, send, cancel and give back requests from inside.
 */

#include "tests/engine/script.h"

static struct script s;

/* What the parser of the tests saw and what it shall do. */
static struct {
	unsigned int calls[POKEYS_REQUEST_CANCELLED + 1];
	unsigned int create; /* create and send so many in each call */
	bool cancel_all;     /* cancel every other request */
	bool give_back;      /* free the entry itself */
	unsigned int refused;
	int last_created;
} seen;

static void parser(pokeys_device_t *dev, const mailbox_entry_t *entry, void *context,
		   uint64_t now_ns);

static int create(void)
{
	const uint8_t packet[POKEYS_PACKET_SIZE] = { 0xBB, OP_READ };

	return pokeys_request_create(&s.dev, packet, POKEYS_CLASS_READ, parser, NULL, &seen);
}

static void create_and_send(uint64_t now_ns)
{
	const int id = create();

	seen.last_created = id;
	if (id < 0)
		seen.refused++;
	else
		assert_int_equal(pokeys_request_send(&s.dev, (uint8_t)id, now_ns), 0);
}

static void parser(pokeys_device_t *dev, const mailbox_entry_t *entry, void *context,
		   uint64_t now_ns)
{
	const mailbox_entry_t before = *entry;

	assert_ptr_equal(dev, &s.dev);
	assert_ptr_equal(context, &seen);
	seen.calls[entry->state]++;
	if (seen.cancel_all) {
		for (unsigned int id = 0; id < 256; id++)
			pokeys_request_cancel(dev, (uint8_t)id, now_ns);
	}
	for (unsigned int i = 0; i < seen.create; i++)
		create_and_send(now_ns);
	assert_memory_equal(entry, &before, sizeof(before));
	if (seen.give_back)
		assert_int_equal(pokeys_request_free(dev, entry->request_id), 0);
}

static void start(const struct pokeys_options *options, unsigned int requests)
{
	script_init(&s, options);
	memset(&seen, 0, sizeof(seen));
	for (unsigned int i = 0; i < requests; i++)
		create_and_send(s.now);
}

static void assert_all_free(void)
{
	for (unsigned int id = 0; id < 256; id++)
		assert_int_equal(pokeys_request_state(&s.dev, (uint8_t)id), POKEYS_REQUEST_FREE);
	assert_int_equal(s.dev.in_flight_count, 0);
	assert_int_equal(s.dev.open_count, 0);
}

static void parser_sees_the_reply_and_the_entry_is_given_back(void **state)
{
	(void)state;
	start(NULL, 1);
	assert_int_equal(script_answer(&s, 0), 1);
	assert_int_equal(seen.calls[POKEYS_REQUEST_DONE], 1);
	assert_all_free();
}

static void parser_is_told_of_every_other_end(void **state)
{
	(void)state;
	start(NULL, 1);
	for (unsigned int i = 0; i < 10; i++)
		script_after(&s, 50 * MS);
	assert_int_equal(seen.calls[POKEYS_REQUEST_TIMED_OUT], 1);
	create_and_send(s.now);
	assert_int_equal(pokeys_request_cancel(&s.dev, (uint8_t)seen.last_created, s.now), 0);
	assert_int_equal(seen.calls[POKEYS_REQUEST_CANCELLED], 1);
	/* one that was never sent */
	assert_int_equal(pokeys_request_cancel(&s.dev, (uint8_t)create(), s.now), 0);
	assert_int_equal(seen.calls[POKEYS_REQUEST_CANCELLED], 2);
	assert_all_free();
}

static void parser_may_create_and_send_while_deadlines_are_checked(void **state)
{
	const struct pokeys_options options = { .window = 64, .retries = POKEYS_NO_RETRIES };

	(void)state;
	start(&options, 8);
	seen.create = 1;
	assert_int_equal(script_after(&s, 10 * MS), 8);
	assert_int_equal(seen.calls[POKEYS_REQUEST_TIMED_OUT], 8);
	assert_int_equal(s.dev.in_flight_count, 8);
	assert_int_equal(s.sent, 16);
	assert_int_equal(script_after(&s, 1), 0);
}

static void parser_may_fill_the_window(void **state)
{
	const struct pokeys_options options = { .window = 64, .retries = POKEYS_NO_RETRIES };

	(void)state;
	start(&options, 40);
	seen.create = 5;
	assert_int_equal(script_after(&s, 10 * MS), 40);
	assert_int_equal(s.dev.in_flight_count, 64);
	assert_true(seen.refused > 0);
	assert_int_equal(seen.calls[POKEYS_REQUEST_TIMED_OUT], 40);
}

/* Its request never left and is old: the only one whose id need not rest. */
static void parser_that_creates_does_not_get_the_entry_it_was_called_with(void **state)
{
	(void)state;
	start(NULL, 0);
	assert_int_equal(create(), 0);
	for (unsigned int i = 1; i < 256; i++) {
		const uint8_t id = script_request(&s, OP_READ, 0, NULL, 0);

		assert_int_equal(pokeys_request_cancel(&s.dev, id, s.now), 0);
	}
	seen.create = 1;
	assert_int_equal(pokeys_request_cancel(&s.dev, 0, s.now), 0);
	assert_int_equal(seen.calls[POKEYS_REQUEST_CANCELLED], 1);
	assert_int_equal(seen.refused, 1);
	assert_int_equal(create(), 0);
}

static void parser_may_cancel_the_others_while_deadlines_are_checked(void **state)
{
	const struct pokeys_options options = { .retries = POKEYS_NO_RETRIES };

	(void)state;
	start(&options, 8);
	seen.cancel_all = true;
	assert_int_equal(script_after(&s, 10 * MS), 1);
	assert_int_equal(seen.calls[POKEYS_REQUEST_TIMED_OUT], 1);
	assert_int_equal(seen.calls[POKEYS_REQUEST_CANCELLED], 7);
	assert_all_free();
}

static void parser_may_cancel_and_create_while_packets_are_received(void **state)
{
	uint8_t reply[POKEYS_PACKET_SIZE];

	(void)state;
	start(NULL, 8);
	for (unsigned int i = 0; i < 8; i++) {
		script_reply_to(s.packets[i], reply);
		script_post(&s, reply, sizeof(reply));
	}
	seen.cancel_all = true;
	seen.create = 1;
	assert_int_equal(pokeys_device_receive(&s.dev, s.now), 1);
	assert_int_equal(seen.calls[POKEYS_REQUEST_DONE], 1);
	/* the parsers of the cancelled ones created requests which were cancelled in turn */
	assert_true(seen.calls[POKEYS_REQUEST_CANCELLED] >= 7);
	assert_int_equal(s.dev.statistics.not_in_flight, 7);
	assert_int_equal(s.dev.open_count, s.dev.in_flight_count);
}

static void parser_that_gives_the_entry_back_itself_does_no_harm(void **state)
{
	(void)state;
	start(NULL, 3);
	seen.give_back = true;
	assert_int_equal(script_answer(&s, 1), 1);
	assert_int_equal(pokeys_request_cancel(&s.dev, 0, s.now), 0);
	assert_int_equal(s.dev.in_flight_count, 1);
	assert_int_equal(s.dev.open_count, 1);
	assert_int_equal(script_answer(&s, 2), 1);
	assert_all_free();
}

static void give_back_and_reuse(pokeys_device_t *dev, const mailbox_entry_t *entry, void *context,
				uint64_t now_ns)
{
	const uint8_t id = entry->request_id;

	(void)context;
	(void)now_ns;
	assert_int_equal(pokeys_request_free(dev, id), 0);
	dev->next_id = id;
	assert_int_equal(create(), id);
}

/* A request never sent leaves its id free: the parser may get the same entry again. */
static void request_made_in_the_parser_survives_in_the_same_entry(void **state)
{
	const uint8_t packet[POKEYS_PACKET_SIZE] = { 0xBB, OP_IO };

	(void)state;
	start(NULL, 0);
	assert_int_equal(pokeys_request_create(&s.dev, packet, POKEYS_CLASS_READ,
					       give_back_and_reuse, NULL, NULL),
			 0);
	assert_int_equal(pokeys_request_cancel(&s.dev, 0, s.now), 0);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_CREATED);
	assert_int_equal(s.dev.open_count, 1);
}

static void reset_ends_everything_open_once_and_spares_what_parsers_create(void **state)
{
	uint8_t first[POKEYS_PACKET_SIZE], reply[POKEYS_PACKET_SIZE];

	(void)state;
	start(NULL, 4);
	memcpy(first, s.packets[0], sizeof(first));
	assert_true(create() >= 0);
	seen.create = 1;
	pokeys_device_reset(&s.dev, s.now);
	assert_int_equal(seen.calls[POKEYS_REQUEST_CANCELLED], 5);
	assert_int_equal(s.dev.in_flight_count, 5);
	assert_int_equal(s.dev.statistics.cancelled, 5);
	/* the ids of before stay blocked: their answers may still come */
	script_reply_to(first, reply);
	assert_int_equal(script_deliver(&s, reply, sizeof(reply)), 0);
	assert_int_equal(s.dev.statistics.not_in_flight, 1);
	assert_true(s.dev.id_free_after[first[6]] >= s.now + 500 * MS);
}

/* A memory transport answers before its send function has returned. */
static int answer_at_once(void *context, const uint8_t *packet, size_t length)
{
	uint8_t reply[POKEYS_PACKET_SIZE];

	(void)context;
	assert_int_equal(length, POKEYS_PACKET_SIZE);
	script_reply_to(packet, reply);
	assert_int_equal(script_deliver(&s, reply, sizeof(reply)), 1);
	return 0;
}

static void answer_from_inside_send_completes_the_request(void **state)
{
	(void)state;
	start(NULL, 0);
	s.dev.io.send = answer_at_once;
	for (unsigned int i = 0; i < 10; i++)
		create_and_send(s.now);
	assert_int_equal(seen.calls[POKEYS_REQUEST_DONE], 10);
	assert_int_equal(s.dev.statistics.sent, 10);
	assert_all_free();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(parser_sees_the_reply_and_the_entry_is_given_back),
		cmocka_unit_test(parser_is_told_of_every_other_end),
		cmocka_unit_test(parser_may_create_and_send_while_deadlines_are_checked),
		cmocka_unit_test(parser_may_fill_the_window),
		cmocka_unit_test(parser_that_creates_does_not_get_the_entry_it_was_called_with),
		cmocka_unit_test(parser_may_cancel_the_others_while_deadlines_are_checked),
		cmocka_unit_test(parser_may_cancel_and_create_while_packets_are_received),
		cmocka_unit_test(parser_that_gives_the_entry_back_itself_does_no_harm),
		cmocka_unit_test(request_made_in_the_parser_survives_in_the_same_entry),
		cmocka_unit_test(reset_ends_everything_open_once_and_spares_what_parsers_create),
		cmocka_unit_test(answer_from_inside_send_completes_the_request),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
