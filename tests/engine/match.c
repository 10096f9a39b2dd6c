/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Which datagrams complete a request, and which counter each other one gets
 * (faults 5 to 7): nothing is published from a reply that was not validated.
 */

#include "tests/engine/script.h"

static struct script s;
static uint8_t reply[POKEYS_PACKET_SIZE];
static uint8_t target[POKEYS_PAYLOAD_SIZE];

/* One request of this kind in flight, its good reply in `reply`. */
static uint8_t in_flight(uint8_t op, uint8_t p1)
{
	uint8_t id;

	script_init(&s, NULL);
	memset(target, 0xEE, sizeof(target));
	id = script_request(&s, op, p1, target, sizeof(target));
	script_reply_to(script_last(&s), reply);
	return id;
}

static void make_sum_good(uint8_t *packet)
{
	packet[7] = 0;
	for (unsigned int i = 0; i < 7; i++)
		packet[7] = (uint8_t)(packet[7] + packet[i]);
}

/* The counter that goes with a verdict. */
static const uint64_t *counter_of(unsigned int verdict)
{
	const uint64_t *const counter[POKEYS_VERDICTS] = {
		[POKEYS_VERDICT_BAD_SOURCE] = &s.dev.statistics.bad_source,
		[POKEYS_VERDICT_BAD_LENGTH] = &s.dev.statistics.bad_length,
		[POKEYS_VERDICT_BAD_MAGIC] = &s.dev.statistics.bad_magic,
		[POKEYS_VERDICT_BAD_CHECKSUM] = &s.dev.statistics.bad_checksum,
		[POKEYS_VERDICT_NOT_IN_FLIGHT] = &s.dev.statistics.not_in_flight,
		[POKEYS_VERDICT_DUPLICATE] = &s.dev.statistics.duplicate,
		[POKEYS_VERDICT_BAD_OPERATION] = &s.dev.statistics.bad_operation,
		[POKEYS_VERDICT_BAD_CHECK] = &s.dev.statistics.bad_check,
		[POKEYS_VERDICT_STALE] = &s.dev.statistics.stale,
	};

	return verdict < POKEYS_VERDICTS ? counter[verdict] : NULL;
}

/* Refused, counted there and nowhere else, said so, and nothing was written. */
static void assert_refused(const uint8_t *bytes, size_t length, const uint64_t *counter)
{
	const uint64_t before = *counter, accepted = s.dev.statistics.accepted;

	assert_int_equal(script_deliver(&s, bytes, length), 0);
	assert_int_equal(*counter, before + 1);
	assert_ptr_equal(counter_of(s.dev.verdict), counter);
	assert_int_equal(s.dev.statistics.accepted, accepted);
	for (unsigned int i = 0; i < sizeof(target); i++)
		assert_int_equal(target[i], 0xEE);
}

static void good_reply_completes_and_fills_the_target(void **state)
{
	const uint8_t id = in_flight(OP_READ, 0);

	(void)state;
	assert_int_equal(script_deliver(&s, reply, sizeof(reply)), 1);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_DONE);
	assert_memory_equal(target, reply + 8, 56);
	assert_memory_equal(pokeys_request_get(&s.dev, id)->response_buffer, reply, 64);
	assert_int_equal(pokeys_request_get(&s.dev, id)->timestamp_received, s.now);
	assert_int_equal(s.dev.statistics.accepted, 1);
	assert_int_equal(s.dev.statistics.done, 1);
	assert_int_equal(s.dev.verdict, POKEYS_VERDICT_ACCEPTED);
	assert_int_equal(s.dev.in_flight_count, 0);
}

static void copy_is_never_longer_than_target_size_nor_than_the_payload(void **state)
{
	static const size_t sizes[] = { 0, 1, 8, 55, 56, 57, 64, 1000, SIZE_MAX };
	uint8_t room[128];

	(void)state;
	for (unsigned int i = 0; i < sizeof(sizes) / sizeof(*sizes); i++) {
		const size_t copied = sizes[i] < 56 ? sizes[i] : 56;

		script_init(&s, NULL);
		memset(room, 0xEE, sizeof(room));
		script_request(&s, OP_READ, 0, room, sizes[i]);
		script_reply_to(script_last(&s), reply);
		assert_int_equal(script_deliver(&s, reply, sizeof(reply)), 1);
		assert_memory_equal(room, reply + 8, copied);
		for (size_t n = copied; n < sizeof(room); n++)
			assert_int_equal(room[n], 0xEE);
	}
}

/* The header sum sees each flip in @0..@7; flips of the payload it cannot see. */
static void every_flipped_header_bit_is_refused(void **state)
{
	static const uint8_t ops[][2] = {
		{ OP_READ, 0 },
		{ OP_IO, 1 },
		{ OP_PULSE, SUB_STATUS },
		{ OP_PULSE, SUB_MOVE },
	};

	(void)state;
	for (unsigned int op = 0; op < 4; op++) {
		in_flight(ops[op][0], ops[op][1]);
		for (unsigned int bit = 0; bit < 64; bit++) {
			reply[bit / 8] ^= (uint8_t)(1u << bit % 8);
			assert_refused(reply, 64,
				       bit < 8 ? &s.dev.statistics.bad_magic :
						 &s.dev.statistics.bad_checksum);
			reply[bit / 8] ^= (uint8_t)(1u << bit % 8);
		}
		assert_int_equal(script_deliver(&s, reply, 64), 1);
	}
}

static void every_flipped_bit_of_the_check_byte_is_refused(void **state)
{
	(void)state;
	in_flight(OP_PULSE, SUB_STATUS);
	for (unsigned int bit = 0; bit < 8; bit++) {
		reply[63] ^= (uint8_t)(1u << bit);
		assert_refused(reply, 64, &s.dev.statistics.bad_check);
		reply[63] ^= (uint8_t)(1u << bit);
	}
	assert_int_equal(script_deliver(&s, reply, 64), 1);
}

static void every_other_length_is_refused(void **state)
{
	uint8_t big[SCRIPT_BYTES] = { 0 };

	(void)state;
	in_flight(OP_READ, 0);
	memcpy(big, reply, sizeof(reply));
	for (size_t length = 0; length <= sizeof(big); length++) {
		if (length != POKEYS_PACKET_SIZE)
			assert_refused(big, length, &s.dev.statistics.bad_length);
	}
	assert_int_equal(script_deliver(&s, big, 64), 1);
}

/* As it comes out of a socket: only 72 bytes of it are ever stored. */
static void oversize_and_empty_datagrams_from_the_transport_are_counted(void **state)
{
	uint8_t big[512] = { 0 };

	(void)state;
	in_flight(OP_READ, 0);
	memcpy(big, reply, sizeof(reply));
	script_post(&s, big, sizeof(big));
	script_post(&s, big, 0);
	script_post(&s, big, 65);
	script_post(&s, big, 64);
	assert_int_equal(pokeys_device_receive(&s.dev, s.now), 1);
	assert_int_equal(s.dev.statistics.bad_length, 3);
	assert_int_equal(s.dev.statistics.received, 4);
}

static void zeros_and_our_own_request_are_refused(void **state)
{
	const uint8_t zeros[POKEYS_PACKET_SIZE] = { 0 };

	(void)state;
	in_flight(OP_READ, 0);
	assert_refused(zeros, 64, &s.dev.statistics.bad_magic);
	assert_refused(script_last(&s), 64, &s.dev.statistics.bad_magic);
}

static void reply_of_every_other_id_is_a_stray(void **state)
{
	const uint8_t id = in_flight(OP_READ, 0);

	(void)state;
	for (unsigned int other = 0; other < 256; other++) {
		reply[6] = (uint8_t)other;
		make_sum_good(reply);
		if (other != id)
			assert_refused(reply, 64, &s.dev.statistics.not_in_flight);
	}
}

static void reply_of_every_other_operation_is_refused(void **state)
{
	(void)state;
	in_flight(OP_READ, 0);
	for (unsigned int other = 0; other < 256; other++) {
		reply[1] = (uint8_t)other;
		make_sum_good(reply);
		if (other != OP_READ)
			assert_refused(reply, 64, &s.dev.statistics.bad_operation);
	}
}

static void reply_of_another_sub_operation_is_refused(void **state)
{
	(void)state;
	in_flight(OP_PULSE, SUB_MOVE);
	for (unsigned int other = 0; other < 256; other++) {
		reply[2] = (uint8_t)other;
		make_sum_good(reply);
		if (other != SUB_MOVE)
			assert_refused(reply, 64, &s.dev.statistics.bad_operation);
	}
}

static void parameter_that_is_not_echoed_is_a_bad_check(void **state)
{
	(void)state;
	in_flight(0x81, 0);
	reply[2] = 1;
	make_sum_good(reply);
	assert_refused(reply, 64, &s.dev.statistics.bad_check);
}

static void operation_outside_the_table_matches_by_id_and_operation(void **state)
{
	(void)state;
	in_flight(0xEE, 7);
	reply[1] = 0xEF;
	make_sum_good(reply);
	assert_refused(reply, 64, &s.dev.statistics.bad_operation);
	reply[1] = 0xEE;
	make_sum_good(reply);
	assert_int_equal(script_deliver(&s, reply, 64), 1);
}

static void reply_from_elsewhere_is_refused(void **state)
{
	struct pokeys_rx rx = { 0, 0x7F000002, 20055, 0 };

	(void)state;
	in_flight(OP_READ, 0);
	pokeys_device_set_peer(&s.dev, 0x7F000001, 20055);
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now), 0);
	rx.address = 0x7F000001;
	rx.port = 20056;
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now), 0);
	assert_int_equal(s.dev.statistics.bad_source, 2);
	rx.port = 20055;
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now), 1);
}

static void unknown_source_is_not_held_against_the_reply(void **state)
{
	const struct pokeys_rx rx = { 0 };

	(void)state;
	in_flight(OP_READ, 0);
	pokeys_device_set_peer(&s.dev, 0x7F000001, 20055);
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now), 1);
}

static void request_that_has_not_left_cannot_be_answered(void **state)
{
	int id;

	(void)state;
	script_init(&s, NULL);
	id = CreateRequestAsync(&s.dev, OP_READ, NULL, 0, NULL, 0);
	assert_int_equal(script_answer(&s, (uint8_t)id), 0);
	s.send_error = -EAGAIN;
	assert_int_equal(pokeys_request_send(&s.dev, (uint8_t)id, s.now), 0);
	assert_int_equal(script_answer(&s, (uint8_t)id), 0);
	assert_int_equal(s.dev.statistics.not_in_flight, 2);
}

static void second_answer_is_counted_as_duplicate_and_changes_nothing(void **state)
{
	const uint8_t id = in_flight(OP_READ, 0);
	uint8_t kept[POKEYS_PACKET_SIZE];

	(void)state;
	assert_int_equal(script_deliver(&s, reply, 64), 1);
	memcpy(kept, pokeys_request_get(&s.dev, id)->response_buffer, 64);
	reply[8] ^= 0xFF;
	for (unsigned int copy = 1; copy <= 50; copy++) {
		assert_int_equal(script_deliver(&s, reply, 64), 0);
		assert_int_equal(s.dev.statistics.duplicate, copy);
	}
	assert_memory_equal(pokeys_request_get(&s.dev, id)->response_buffer, kept, 64);
	assert_int_equal(pokeys_request_free(&s.dev, id), 0);
	assert_int_equal(script_deliver(&s, reply, 64), 0);
	assert_int_equal(s.dev.statistics.duplicate, 51);
	assert_int_equal(s.dev.statistics.accepted, 1);
	assert_int_equal(s.sent, 1);
}

static void answer_to_a_request_that_ended_without_one_is_a_stray(void **state)
{
	const uint8_t id = in_flight(OP_READ, 0);

	(void)state;
	assert_int_equal(pokeys_request_cancel(&s.dev, id, s.now), 0);
	assert_refused(reply, 64, &s.dev.statistics.not_in_flight);
	assert_int_equal(pokeys_request_state(&s.dev, id), POKEYS_REQUEST_CANCELLED);
}

static void reply_older_than_its_request_is_stale(void **state)
{
	struct pokeys_rx rx = { S - 1, 0, 0, 0 };

	(void)state;
	in_flight(OP_READ, 0);
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now + MS), 0);
	assert_int_equal(s.dev.statistics.stale, 1);
	rx.t_ns = S + 200 * US;
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now + MS), 1);
	assert_int_equal(s.dev.statistics.rtt_last_ns, 200 * US);
}

static void reply_that_waited_in_the_socket_is_judged_by_its_stamp(void **state)
{
	struct pokeys_rx rx = { 0 };
	uint8_t id;

	(void)state;
	id = in_flight(OP_READ, 0);
	/* without a stamp it may be five seconds old */
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now + 5 * S), 0);
	assert_int_equal(s.dev.statistics.stale, 1);
	rx.t_ns = s.now + 300 * US;
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now + 5 * S), 1);
	assert_int_equal(pokeys_request_get(&s.dev, id)->timestamp_received, s.now + 300 * US);
}

/* CLOCK_REALTIME stepped by an hour somewhere below the transport (fault 17). */
static void unbelievable_stamp_counts_as_none(void **state)
{
	struct pokeys_rx rx = { 1, 0, 0, 0 };
	uint8_t id;

	(void)state;
	id = in_flight(OP_READ, 0);
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now + MS), 1);
	assert_int_equal(pokeys_request_get(&s.dev, id)->timestamp_received, s.now + MS);
	id = in_flight(OP_READ, 0);
	rx.t_ns = s.now + 3600 * S;
	assert_int_equal(pokeys_device_deliver(&s.dev, reply, 64, &rx, s.now + MS), 1);
	assert_int_equal(pokeys_request_get(&s.dev, id)->timestamp_received, s.now + MS);
}

static void receiving_stops_after_a_bounded_number_of_packets(void **state)
{
	uint8_t junk[3] = { 0 };

	(void)state;
	in_flight(OP_READ, 0);
	for (unsigned int i = 0; i < 300; i++)
		script_post(&s, junk, sizeof(junk));
	assert_int_equal(pokeys_device_receive(&s.dev, s.now), 0);
	assert_int_equal(s.dev.statistics.received, 256);
	assert_int_equal(pokeys_device_receive(&s.dev, s.now), 0);
	assert_int_equal(s.dev.statistics.received, 300);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(good_reply_completes_and_fills_the_target),
		cmocka_unit_test(copy_is_never_longer_than_target_size_nor_than_the_payload),
		cmocka_unit_test(every_flipped_header_bit_is_refused),
		cmocka_unit_test(every_flipped_bit_of_the_check_byte_is_refused),
		cmocka_unit_test(every_other_length_is_refused),
		cmocka_unit_test(oversize_and_empty_datagrams_from_the_transport_are_counted),
		cmocka_unit_test(zeros_and_our_own_request_are_refused),
		cmocka_unit_test(reply_of_every_other_id_is_a_stray),
		cmocka_unit_test(reply_of_every_other_operation_is_refused),
		cmocka_unit_test(reply_of_another_sub_operation_is_refused),
		cmocka_unit_test(parameter_that_is_not_echoed_is_a_bad_check),
		cmocka_unit_test(operation_outside_the_table_matches_by_id_and_operation),
		cmocka_unit_test(reply_from_elsewhere_is_refused),
		cmocka_unit_test(unknown_source_is_not_held_against_the_reply),
		cmocka_unit_test(request_that_has_not_left_cannot_be_answered),
		cmocka_unit_test(second_answer_is_counted_as_duplicate_and_changes_nothing),
		cmocka_unit_test(answer_to_a_request_that_ended_without_one_is_a_stray),
		cmocka_unit_test(reply_older_than_its_request_is_stale),
		cmocka_unit_test(reply_that_waited_in_the_socket_is_judged_by_its_stamp),
		cmocka_unit_test(unbelievable_stamp_counts_as_none),
		cmocka_unit_test(receiving_stops_after_a_bounded_number_of_packets),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
