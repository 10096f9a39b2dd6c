/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The header rules (protocol sections 1.2 and 1.3), and exactly what they do
 * not catch: the checksum covers seven bytes and is a plain sum, so damage to
 * the payload and some pairs of flipped bits get through. Which ones is
 * asserted, so that nobody relies on more.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "wire/io.h"
#include "wire/pulse.h"

#define HEADER_BITS (8 * 8)

static void make_reply(uint8_t p[WIRE_PK], uint8_t id)
{
	const struct wire_io_rep rep = { .inputs = 0x12345678, .ultra = 99 };

	wire_io_encode_rep(p, &rep);
	wire_finish(p, id);
}

static void flip(uint8_t *p, unsigned int bit)
{
	p[bit / 8] ^= (uint8_t)(1u << (bit % 8));
}

static void checksum_covers_the_first_seven_bytes(void **state)
{
	/* row DigitalIOSet of the golden packets: the sum leaves the payload out */
	uint8_t p[WIRE_PK] = { 0xBB, 0xCC, 0x01, 0x00, 0x00, 0x00, 0x18, 0xA0, 0x55, 0x55 };

	(void)state;
	assert_int_equal(wire_checksum(p), 0xA0);
	p[63] = 0xFF;
	assert_int_equal(wire_check_request(p, WIRE_PK), WIRE_OK);
	memset(p, 0xFF, sizeof(p));
	assert_int_equal(wire_checksum(p), (7 * 0xFF) & 0xFF);
}

static void zero_is_a_legal_checksum(void **state)
{
	uint8_t p[WIRE_PK] = { 0xBB, 0x85, 0x21, 0x03, 0, 0, 0x9C, 0 };

	(void)state;
	assert_int_equal(wire_check_request(p, WIRE_PK), WIRE_OK);
}

static void finish_sets_id_and_checksum_only(void **state)
{
	uint8_t p[WIRE_PK], before[WIRE_PK];

	(void)state;
	make_reply(p, 0);
	memcpy(before, p, sizeof(p));
	wire_finish(p, 0xC3);
	assert_int_equal(p[WIRE_AT_ID], 0xC3);
	assert_int_equal(p[WIRE_AT_SUM], wire_checksum(p));
	assert_memory_equal(p, before, WIRE_AT_ID);
	assert_memory_equal(p + WIRE_PAYLOAD_AT, before + WIRE_PAYLOAD_AT, WIRE_PAYLOAD_LEN);
}

static void every_other_length_is_refused(void **state)
{
	uint8_t p[8 * WIRE_PK] = { 0 };

	(void)state;
	make_reply(p, 1);
	for (size_t len = 0; len <= sizeof(p); len++) {
		const enum wire_reason want = len == WIRE_PK ? WIRE_OK : WIRE_LENGTH;

		assert_int_equal(wire_check_reply(p, len), want);
	}
}

static void a_truncated_packet_is_not_read(void **state)
{
	/* the allocation ends where the packet ends: the sanitizer sees any read beyond */
	(void)state;
	for (size_t len = 0; len < WIRE_PK; len++) {
		uint8_t *p = malloc(len ? len : 1);

		assert_non_null(p);
		memset(p, WIRE_REPLY, len ? len : 1);
		assert_int_equal(wire_check_reply(p, len), WIRE_LENGTH);
		assert_int_equal(wire_check_request(p, len), WIRE_LENGTH);
		free(p);
	}
}

static void requests_and_replies_are_not_mistaken(void **state)
{
	uint8_t p[WIRE_PK];

	(void)state;
	make_reply(p, 7);
	assert_int_equal(wire_check_reply(p, WIRE_PK), WIRE_OK);
	assert_int_equal(wire_check_request(p, WIRE_PK), WIRE_MAGIC);
	p[0] = WIRE_REQUEST;
	assert_int_equal(wire_check_reply(p, WIRE_PK), WIRE_MAGIC);
	assert_int_equal(wire_check_request(p, WIRE_PK), WIRE_CHECKSUM);
}

/* As a client takes a reply: header rules, then whether it fits the request. */
static enum wire_reason accept(const uint8_t *req, const uint8_t *rep)
{
	const struct wire_op_row *row = wire_op_find(req[WIRE_AT_OP], req[WIRE_AT_P1]);
	const enum wire_reason reason = wire_check_reply(rep, WIRE_PK);

	return reason ? reason : wire_match_reply(row, req, rep);
}

static void every_single_flipped_header_bit_is_refused(void **state)
{
	const struct wire_io_req req = { .write = 1 };
	uint8_t request[WIRE_PK], p[WIRE_PK];

	(void)state;
	wire_io_encode_req(request, &req);
	for (unsigned int id = 0; id < 256; id++) {
		wire_finish(request, (uint8_t)id);
		make_reply(p, (uint8_t)id);
		assert_int_equal(accept(request, p), WIRE_OK);
		for (unsigned int bit = 0; bit < HEADER_BITS; bit++) {
			flip(p, bit);
			assert_int_not_equal(accept(request, p), WIRE_OK);
			flip(p, bit);
		}
	}
}

/*
 * Whether flipping both bits leaves sum and checksum equal: same weight, and
 * in opposite directions within the sum, or in the same one when one of them
 * is in the checksum itself; the top bit always, for 128 + 128 is 0.
 */
static bool pair_cancels(const uint8_t *p, unsigned int a, unsigned int b)
{
	const bool bit_a = p[a / 8] >> (a % 8) & 1, bit_b = p[b / 8] >> (b % 8) & 1;
	const bool in_sum = a / 8 == WIRE_AT_SUM || b / 8 == WIRE_AT_SUM;

	if (a % 8 != b % 8 || a / 8 == b / 8)
		return false;
	return a % 8 == 7 || (in_sum ? bit_a == bit_b : bit_a != bit_b);
}

/* Only p1..p4, which this operation does not echo, and the checksum are not compared. */
static bool pair_is_unseen(unsigned int a, unsigned int b)
{
	const unsigned int bytes[] = { a / 8, b / 8 };

	for (unsigned int i = 0; i < 2; i++) {
		if (bytes[i] == WIRE_AT_MAGIC || bytes[i] == WIRE_AT_OP || bytes[i] == WIRE_AT_ID)
			return false;
	}
	return true;
}

static void flipped_header_pairs_collide_exactly_where_the_sum_cancels(void **state)
{
	const struct wire_io_req req = { .write = 1 };
	uint8_t request[WIRE_PK], p[WIRE_PK];
	unsigned int header = 0, taken = 0;

	(void)state;
	wire_io_encode_req(request, &req);
	wire_finish(request, 0x5C);
	make_reply(p, 0x5C);
	for (unsigned int a = 0; a < HEADER_BITS; a++) {
		for (unsigned int b = a + 1; b < HEADER_BITS; b++) {
			const bool cancels = pair_cancels(p, a, b);
			const bool unseen = pair_is_unseen(a, b);

			flip(p, a);
			flip(p, b);
			assert_int_equal(wire_check_reply(p, WIRE_PK) == WIRE_OK,
					 cancels && a / 8 && b / 8);
			assert_int_equal(accept(request, p) == WIRE_OK, cancels && unseen);
			header += wire_check_reply(p, WIRE_PK) == WIRE_OK;
			taken += accept(request, p) == WIRE_OK;
			flip(p, a);
			flip(p, b);
		}
	}
	print_message("of %d pairs %u pass the header rules, %u are taken as the reply\n",
		      HEADER_BITS * (HEADER_BITS - 1) / 2, header, taken);
	assert_in_range(taken, 1, header);
}

static void payload_damage_is_seen_in_the_status_check_byte_only(void **state)
{
	const struct wire_pulse_status_req req = { .check = 0x8B };
	const struct wire_pulse_status_rep rep = { .check = (0x8B + WIRE_CHECK_BASE) & 0xFF };
	uint8_t request[WIRE_PK], p[WIRE_PK];
	unsigned int seen = 0;

	(void)state;
	wire_pulse_status_encode_req(request, &req);
	wire_finish(request, 3);
	wire_pulse_status_encode_rep(p, &rep);
	wire_finish(p, 3);
	assert_int_equal(accept(request, p), WIRE_OK);
	for (unsigned int bit = HEADER_BITS; bit < 8 * WIRE_PK; bit++) {
		flip(p, bit);
		if (accept(request, p) != WIRE_OK) {
			assert_int_equal(accept(request, p), WIRE_CHECK_BYTE);
			assert_int_equal(bit / 8, WIRE_AT_CHECK);
			seen++;
		}
		flip(p, bit);
	}
	assert_int_equal(seen, 8);
}

static void byte_access_works_at_every_alignment(void **state)
{
	uint8_t p[16];

	(void)state;
	for (unsigned int at = 0; at < 8; at++) {
		memset(p, 0xEE, sizeof(p));
		wire_put_u16(p + at, 0x1234);
		assert_int_equal(p[at], 0x34);
		assert_int_equal(wire_get_u16(p + at), 0x1234);
		assert_int_equal(wire_get_u16be(p + at), 0x3412);
		wire_put_u16be(p + at, 0x1234);
		assert_int_equal(p[at], 0x12);
		wire_put_i32(p + at, -5000);
		assert_int_equal(p[at], 0x78);
		assert_int_equal(wire_get_i32(p + at), -5000);
		wire_put_f32(p + at, 0.1f);
		assert_int_equal(wire_get_u32(p + at), 0x3DCCCCCD);
		assert_true(wire_get_f32(p + at) == 0.1f);
		wire_put_u56(p + at, UINT64_C(0xFF40000000000001));
		assert_int_equal(p[at + 6], 0x40);
		assert_int_equal(p[at + 7], 0xEE);
		assert_true(wire_get_u56(p + at) == UINT64_C(0x40000000000001));
	}
}

static void every_reason_has_a_name(void **state)
{
	(void)state;
	for (int a = 0; a < WIRE_REASONS; a++) {
		assert_non_null(wire_reason_name((enum wire_reason)a));
		for (int b = 0; b < a; b++)
			assert_string_not_equal(wire_reason_name((enum wire_reason)a),
						wire_reason_name((enum wire_reason)b));
	}
	assert_string_equal(wire_reason_name(WIRE_REASONS), "unknown");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(checksum_covers_the_first_seven_bytes),
		cmocka_unit_test(zero_is_a_legal_checksum),
		cmocka_unit_test(finish_sets_id_and_checksum_only),
		cmocka_unit_test(every_other_length_is_refused),
		cmocka_unit_test(a_truncated_packet_is_not_read),
		cmocka_unit_test(requests_and_replies_are_not_mistaken),
		cmocka_unit_test(every_single_flipped_header_bit_is_refused),
		cmocka_unit_test(flipped_header_pairs_collide_exactly_where_the_sum_cancels),
		cmocka_unit_test(payload_damage_is_seen_in_the_status_check_byte_only),
		cmocka_unit_test(byte_access_works_at_every_alignment),
		cmocka_unit_test(every_reason_has_a_name),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
