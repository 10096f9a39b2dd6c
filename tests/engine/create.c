/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Creating a request: what the packet looks like, which class it gets, what is
 * refused, and that nothing of it touches the network.
 */

#include "tests/engine/script.h"

static struct script s;

static void packet_is_built_as_the_protocol_says(void **state)
{
	const uint8_t params[4] = { 0x11, 0x22, 0x33, 0x44 };
	const uint8_t payload[3] = { 0xA1, 0xA2, 0xA3 };
	uint8_t expected[POKEYS_PACKET_SIZE] = {
		0xBB, 0x40, 0x11, 0x22, 0x33, 0x44, 0x05, 0xAA, 0xA1, 0xA2, 0xA3,
	};
	struct pokeys_options options = { .first_id = 5 };
	int id;

	(void)state;
	script_init(&s, &options);
	id = CreateRequestAsyncWithPayload(&s.dev, 0x40, params, 4, payload, 3, NULL, 0);
	assert_int_equal(id, 5);
	assert_int_equal(pokeys_request_send(&s.dev, 5, s.now), 0);
	assert_memory_equal(script_last(&s), expected, POKEYS_PACKET_SIZE);
}

static void general_form_fills_in_header_id_and_checksum(void **state)
{
	uint8_t packet[POKEYS_PACKET_SIZE] = { 0, 0x31, 0, 0, 0, 0, 0x77, 0x77, 9 };
	struct pokeys_options options = { .first_id = 3 };

	(void)state;
	script_init(&s, &options);
	assert_int_equal(pokeys_request_create(&s.dev, packet, POKEYS_CLASS_READ, NULL, NULL, NULL),
			 3);
	assert_int_equal(pokeys_request_send(&s.dev, 3, s.now), 0);
	packet[0] = 0xBB;
	packet[6] = 3;
	packet[7] = 0xBB + 0x31 + 3;
	assert_memory_equal(script_last(&s), packet, POKEYS_PACKET_SIZE);
}

static void creating_touches_no_network(void **state)
{
	(void)state;
	script_init(&s, NULL);
	for (int i = 0; i < 8; i++)
		assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), i);
	assert_int_equal(s.sends_tried, 0);
	assert_int_equal(script_after(&s, 60 * S), 0);
	assert_int_equal(s.sends_tried, 0);
	assert_int_equal(pokeys_request_state(&s.dev, 7), POKEYS_REQUEST_CREATED);
	assert_int_equal(pokeys_request_state(&s.dev, 8), POKEYS_REQUEST_FREE);
	assert_null(pokeys_request_get(&s.dev, 8));
	assert_int_equal(pokeys_device_next_deadline(&s.dev), UINT64_MAX);
}

static void too_many_parameters_or_too_much_payload_is_refused(void **state)
{
	const uint8_t bytes[64] = { 0 };

	(void)state;
	script_init(&s, NULL);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, bytes, 5, NULL, 0), -EINVAL);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 1, NULL, 0), -EINVAL);
	assert_int_equal(CreateRequestAsyncWithPayload(&s.dev, OP_READ, NULL, 0, bytes, 57, NULL,
						       0),
			 -EINVAL);
	assert_int_equal(pokeys_request_create(&s.dev, bytes, (enum pokeys_class)3, NULL, NULL,
					       NULL),
			 -EINVAL);
	assert_int_equal(s.dev.statistics.created, 0);
	assert_int_equal(CreateRequestAsyncWithPayload(&s.dev, OP_READ, NULL, 0, bytes, 56, NULL,
						       0),
			 0);
}

static void window_bounds_what_is_created_or_in_flight(void **state)
{
	struct pokeys_options options = { .window = 3 };

	(void)state;
	script_init(&s, &options);
	script_request(&s, OP_READ, 0, NULL, 0);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), 2);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), -EBUSY);
	assert_int_equal(s.dev.statistics.refused_window, 1);
	assert_int_equal(script_answer(&s, 0), 1);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), 3);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), -EBUSY);
	assert_int_equal(pokeys_request_cancel(&s.dev, 2, s.now), 0);
	assert_int_equal(CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0), 4);
	assert_int_equal(s.dev.statistics.in_flight_high, 2);
}

static int class_of(uint8_t op, uint8_t p1, uint8_t p2)
{
	const uint8_t params[2] = { p1, p2 };
	const int id = CreateRequestAsync(&s.dev, op, params, 2, NULL, 0);
	int request_class;

	assert_in_range(id, 0, 255);
	request_class = pokeys_request_get(&s.dev, (uint8_t)id)->request_class;
	assert_int_equal(pokeys_request_cancel(&s.dev, (uint8_t)id, s.now), 0);
	assert_int_equal(pokeys_request_free(&s.dev, (uint8_t)id), 0);
	return request_class;
}

static void class_is_that_of_this_very_request(void **state)
{
	(void)state;
	script_init(&s, NULL);
	assert_int_equal(class_of(OP_READ, 0, 0), POKEYS_CLASS_READ);
	assert_int_equal(class_of(OP_IO, 0, 0), POKEYS_CLASS_READ);
	assert_int_equal(class_of(OP_IO, 1, 0), POKEYS_CLASS_WRITE);
	assert_int_equal(class_of(OP_PULSE, SUB_STATUS, 0), POKEYS_CLASS_READ);
	assert_int_equal(class_of(OP_PULSE, SUB_MOVE, 0), POKEYS_CLASS_WRITE);
	assert_int_equal(class_of(OP_PULSE, SUB_HOME, 0), POKEYS_CLASS_ONESHOT);
	assert_int_equal(class_of(0xF3, 0, 0), POKEYS_CLASS_ONESHOT);
	/* not in the table, and one that no device answers */
	assert_int_equal(class_of(0xEE, 0, 0), POKEYS_CLASS_ONESHOT);
	assert_int_equal(class_of(0x4B, 0x10, 0), POKEYS_CLASS_ONESHOT);
}

static void status_without_check_byte_gets_one_and_another_each_time(void **state)
{
	const uint8_t given[2] = { SUB_STATUS, 0x33 };
	uint8_t first;
	int id;

	(void)state;
	script_init(&s, NULL);
	id = script_request(&s, OP_PULSE, SUB_STATUS, NULL, 0);
	first = script_last(&s)[3];
	assert_int_not_equal(first, 0);
	assert_int_equal(script_answer(&s, (uint8_t)id), 1);
	assert_int_equal(pokeys_request_free(&s.dev, (uint8_t)id), 0);
	s.dev.next_id = (uint8_t)id;
	script_after(&s, 1 * S);
	assert_int_equal(script_request(&s, OP_PULSE, SUB_STATUS, NULL, 0), id);
	assert_int_not_equal(script_last(&s)[3], 0);
	assert_int_not_equal(script_last(&s)[3], first);
	/* the caller's own is kept */
	id = CreateRequestAsync(&s.dev, OP_PULSE, given, 2, NULL, 0);
	assert_int_equal(pokeys_request_get(&s.dev, (uint8_t)id)->request_buffer[3], 0x33);
}

static void send_refuses_what_is_not_created(void **state)
{
	(void)state;
	script_init(&s, NULL);
	assert_int_equal(pokeys_request_send(&s.dev, 9, s.now), -ENOENT);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(pokeys_request_send(&s.dev, 0, s.now), -EALREADY);
	assert_int_equal(script_answer(&s, 0), 1);
	assert_int_equal(pokeys_request_send(&s.dev, 0, s.now), -EALREADY);
	assert_int_equal(s.sent, 1);
}

static void entry_is_given_back_only_after_its_end(void **state)
{
	(void)state;
	script_init(&s, NULL);
	assert_int_equal(pokeys_request_free(&s.dev, 0), -ENOENT);
	assert_int_equal(pokeys_request_cancel(&s.dev, 0, s.now), -ENOENT);
	script_request(&s, OP_READ, 0, NULL, 0);
	assert_int_equal(pokeys_request_free(&s.dev, 0), -EBUSY);
	assert_int_equal(script_answer(&s, 0), 1);
	assert_int_equal(pokeys_request_state(&s.dev, 0), POKEYS_REQUEST_DONE);
	assert_true(pokeys_request_get(&s.dev, 0)->response_ready);
	assert_int_equal(pokeys_request_cancel(&s.dev, 0, s.now), -ENOENT);
	assert_int_equal(pokeys_request_free(&s.dev, 0), 0);
	assert_int_equal(pokeys_request_free(&s.dev, 0), -ENOENT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(packet_is_built_as_the_protocol_says),
		cmocka_unit_test(general_form_fills_in_header_id_and_checksum),
		cmocka_unit_test(creating_touches_no_network),
		cmocka_unit_test(too_many_parameters_or_too_much_payload_is_refused),
		cmocka_unit_test(window_bounds_what_is_created_or_in_flight),
		cmocka_unit_test(class_is_that_of_this_very_request),
		cmocka_unit_test(status_without_check_byte_gets_one_and_another_each_time),
		cmocka_unit_test(send_refuses_what_is_not_created),
		cmocka_unit_test(entry_is_given_back_only_after_its_end),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
