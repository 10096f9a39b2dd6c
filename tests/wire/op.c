/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The operation table: every packet belongs to at most one row, every
 * operation a CNC driver needs is there, and the class of a request is what
 * protocol sections 2 and 3 make of it. A wrong class is a lost or a doubled
 * movement, so the expected ones are written out here a second time.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "wire/op.h"

static bool row_takes(const struct wire_op_row *row, unsigned int id, unsigned int p1)
{
	return row->id == id && (!row->sub.where || (p1 >= row->sub.first && p1 <= row->sub.last));
}

static void every_packet_belongs_to_at_most_one_row(void **state)
{
	(void)state;
	for (unsigned int id = 0; id < 256; id++) {
		for (unsigned int p1 = 0; p1 < 256; p1++) {
			const struct wire_op_row *found = wire_op_find((uint8_t)id, (uint8_t)p1);
			unsigned int takers = 0;

			for (unsigned int op = 0; op < WIRE_OP_COUNT; op++)
				takers += row_takes(wire_op((enum wire_op)op), id, p1);
			assert_in_range(takers, 0, 1);
			assert_int_equal(!!found, takers);
			if (found)
				assert_true(row_takes(found, id, p1));
		}
	}
}

static void rows_are_complete(void **state)
{
	(void)state;
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const struct wire_op_row *row = wire_op((enum wire_op)op);

		assert_non_null(row);
		assert_int_equal(row->op, op);
		assert_non_null(row->name);
		assert_non_null(row->req);
		assert_non_null(row->rep);
		assert_in_range(row->class, WIRE_READ, WIRE_ONE_SHOT);
		assert_in_range(row->rule.at, 0, WIRE_PK - 1);
		assert_true(row->sub.first <= row->sub.last);
		assert_true(row->sub.where == 0 || row->sub.where == WIRE_AT_P1);
		/* a read is a read by class; rules tell the others from reads */
		if (row->class == WIRE_READ)
			assert_int_equal(row->rule.kind, WIRE_RULE_ALWAYS);
		/* what a reply does not carry cannot be demanded of it */
		if (row->flags & (WIRE_BARE | WIRE_NO_REPLY))
			assert_false(row->flags & (WIRE_P1 | WIRE_P2 | WIRE_CHECK));
	}
	assert_null(wire_op(WIRE_OP_COUNT));
}

static void names_are_unique(void **state)
{
	(void)state;
	for (unsigned int a = 0; a < WIRE_OP_COUNT; a++) {
		for (unsigned int b = 0; b < a; b++)
			assert_string_not_equal(wire_op((enum wire_op)a)->name,
						wire_op((enum wire_op)b)->name);
	}
}

/* Operations of protocol sections 1.10 to 3.24, as id << 8 | sub. */
static const uint16_t needed[] = {
	0x0000, 0x0200, 0x0300, 0x0400, 0x0500, 0x0600, 0x0700, 0x0800, 0x0A00, 0x0B00, 0x1000,
	0x1100, 0x1500, 0x1600, 0x1900, 0x1A00, 0x1B00, 0x1C00, 0x1D00, 0x1E00, 0x1F00, 0x3000,
	0x3100, 0x3200, 0x3500, 0x3600, 0x3700, 0x3800, 0x3900, 0x3A00, 0x4000, 0x4100, 0x4200,
	0x4300, 0x50AA, 0x51AA, 0x52AA, 0x7600, 0x7700, 0x8100, 0x8300, 0x8310, 0x8400, 0x8410,
	0x8500, 0x8501, 0x8502, 0x8503, 0x8504, 0x8505, 0x8506, 0x8508, 0x850A, 0x850B, 0x8510,
	0x8511, 0x8518, 0x8519, 0x8520, 0x8521, 0x8522, 0x8523, 0x8524, 0x8525, 0x8530, 0x8531,
	0x8532, 0x8533, 0x8534, 0x8535, 0x8536, 0x8537, 0x8540, 0x8541, 0x8550, 0x8551, 0x8552,
	0x8553, 0x8554, 0x8590, 0x8591, 0x8592, 0x8595, 0x8596, 0x85F0, 0x85FE, 0x85FF, 0x8601,
	0x8610, 0x8620, 0x8630, 0x8631, 0x8632, 0x8F00, 0xB008, 0xB017, 0xC000, 0xC100, 0xC200,
	0xC300, 0xC400, 0xC500, 0xC600, 0xC700, 0xCA01, 0xCA02, 0xCA09, 0xCA0A, 0xCA0C, 0xCA13,
	0xCA14, 0xCA16, 0xCA1D, 0xCA20, 0xCA27, 0xCA32, 0xCB00, 0xCC00, 0xCC01, 0xCD00, 0xCD01,
	0xCD0A, 0xCD0B, 0xCE02, 0xCF00, 0xD000, 0xD100, 0xD110, 0xD120, 0xD130, 0xD131, 0xD140,
	0xD150, 0xD160, 0xD161, 0xD162, 0xD180, 0xD185, 0xD500, 0xD600, 0xD701, 0xD70B, 0xD800,
	0xD900, 0xDA00, 0xDB00, 0xDB10, 0xDB11, 0xDB20, 0xDB21, 0xDB30, 0xDB31, 0xDC00, 0xDC10,
	0xDC11, 0xDC20, 0xDC21, 0xDC22, 0xDC23, 0xDD00, 0xDD10, 0xDD11, 0xDD15, 0xDD20, 0xDD21,
	0xDD25, 0xDD30, 0xDD40, 0xDD50, 0xDD55, 0xDD60, 0xDD70, 0xDE10, 0xDE20, 0xDE30, 0xE000,
	0xE00A, 0xE100, 0xE200, 0xE300, 0xE501, 0xE510, 0xE520, 0xE600, 0xE601, 0xE602, 0xF300,
};

static void every_needed_operation_is_there(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof(needed) / sizeof(needed[0]); i++) {
		if (!wire_op_find((uint8_t)(needed[i] >> 8), (uint8_t)needed[i]))
			fail_msg("operation 0x%02x/%02x is not in the table", needed[i] >> 8,
				 needed[i] & 0xFF);
	}
}

/* Bootloader, raw pulse engine data, reserved ids: nothing must send these. */
static void dangerous_operations_are_not_there(void **state)
{
	static const uint16_t absent[] = { 0x0100, 0x85E0, 0xDDF0, 0xF000, 0xF100,
					   0xF200, 0xF500, 0xFA00, 0xFB00, 0xFD01 };

	(void)state;
	for (size_t i = 0; i < sizeof(absent) / sizeof(absent[0]); i++)
		assert_null(wire_op_find((uint8_t)(absent[i] >> 8), (uint8_t)absent[i]));
}

/* Bytes @1..@5 of a request and the class it must have. */
static const struct {
	uint8_t op, p1, p2, p3, p4;
	enum wire_class class;
} classes[] = {
	{ 0x00, 0, 0, 0, 0, WIRE_READ },
	{ 0x06, 0, 0, 0, 0, WIRE_READ },
	{ 0x06, 1, 1, 0, 0, WIRE_WRITE },
	{ 0x07, 10, 0, 0, 0, WIRE_READ },
	{ 0x07, 0xE0, 0, 0, 0, WIRE_WRITE },
	{ 0x1A, 3, 0, 0, 0, WIRE_ONE_SHOT },
	/* ultra-fast encoder: read, set, set and arm the index reset */
	{ 0x1C, 0xFF, 0, 0, 0, WIRE_READ },
	{ 0x1C, 1, 4, 0, 0, WIRE_WRITE },
	{ 0x1C, 1, 4, 1, 0, WIRE_ONE_SHOT },
	{ 0x1D, 0, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0x3A, 1, 0, 0, 0, WIRE_READ },
	{ 0x40, 16, 1, 0, 0, WIRE_WRITE },
	{ 0x50, 0xAA, 0x55, 0, 0, WIRE_ONE_SHOT },
	{ 0x76, 0, 1, 0, 0, WIRE_READ },
	{ 0x76, 0, 1, 1, 0, WIRE_WRITE },
	{ 0x81, 0, 0, 0, 0, WIRE_READ },
	{ 0x81, 1, 5, 0x0F, 0, WIRE_WRITE },
	{ 0x83, 0, 0, 0, 0, WIRE_READ },
	{ 0x83, 0x10, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0x84, 0x10, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0x85, 0x00, 0x8B, 0, 0, WIRE_READ },
	{ 0x85, 0x01, 0, 0, 0, WIRE_WRITE },
	/* stopping may be repeated at will, starting not */
	{ 0x85, 0x02, 0, 0, 0, WIRE_WRITE },
	{ 0x85, 0x02, 0, 1, 7, WIRE_WRITE },
	{ 0x85, 0x02, 3, 0, 7, WIRE_ONE_SHOT },
	{ 0x85, 0x02, 10, 0, 7, WIRE_ONE_SHOT },
	{ 0x85, 0x03, 1, 0, 0, WIRE_ONE_SHOT },
	{ 0x85, 0x04, 0, 0, 1, WIRE_READ },
	{ 0x85, 0x04, 1, 0x88, 0, WIRE_WRITE },
	{ 0x85, 0x05, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0x85, 0x06, 0, 0, 1, WIRE_READ },
	{ 0x85, 0x06, 1, 0, 0, WIRE_WRITE },
	{ 0x85, 0x0A, 2, 0, 0, WIRE_READ },
	{ 0x85, 0x0A, 0, 0, 0, WIRE_WRITE },
	{ 0x85, 0x10, 1, 0, 0, WIRE_READ },
	{ 0x85, 0x11, 1, 0, 0, WIRE_WRITE },
	{ 0x85, 0x20, 0, 0, 0, WIRE_WRITE },
	{ 0x85, 0x25, 0xFF, 0, 0, WIRE_WRITE },
	{ 0x85, 0x21, 1, 0, 0, WIRE_ONE_SHOT },
	{ 0x85, 0x22, 0, 1, 0, WIRE_ONE_SHOT },
	{ 0x85, 0x23, 4, 0, 0, WIRE_ONE_SHOT },
	{ 0x85, 0x24, 0, 0, 0, WIRE_WRITE },
	{ 0x85, 0x32, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0x85, 0x34, 0, 0, 0, WIRE_WRITE },
	{ 0x85, 0x50, 0x10, 1, 0, WIRE_ONE_SHOT },
	{ 0x85, 0xF0, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0x85, 0xFE, 9, 3, 0, WIRE_ONE_SHOT },
	{ 0x85, 0xFF, 18, 3, 0, WIRE_ONE_SHOT },
	{ 0x86, 0x31, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0xB0, 0x08, 0xFF, 149, 3, WIRE_ONE_SHOT },
	{ 0xC0, 0, 0, 0, 0, WIRE_READ },
	{ 0xC0, 0, 1, 0, 0, WIRE_READ },
	{ 0xC0, 1, 0, 0, 0, WIRE_WRITE },
	{ 0xC0, 0, 2, 0, 0, WIRE_WRITE },
	{ 0xC4, 0, 0, 0, 0, WIRE_READ },
	{ 0xC4, 1, 0, 0, 0, WIRE_WRITE },
	{ 0xCA, 10, 0, 0, 0, WIRE_READ },
	{ 0xCA, 1, 0, 0, 0, WIRE_WRITE },
	{ 0xCA, 20, 0, 0, 0, WIRE_READ },
	{ 0xCB, 0, 0, 0, 0, WIRE_READ },
	{ 0xCB, 1, 1, 0, 0, WIRE_WRITE },
	{ 0xCC, 0, 0, 0, 0, WIRE_READ },
	{ 0xCC, 1, 0, 0, 0, WIRE_WRITE },
	{ 0xCD, 0, 0, 0, 0, WIRE_READ },
	{ 0xCD, 1, 0, 0, 0, WIRE_READ },
	{ 0xCD, 10, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0xCD, 11, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0xCE, 2, 0, 0, 0, WIRE_READ },
	{ 0xCE, 0, 0, 0, 0, WIRE_WRITE },
	{ 0xD0, 1, 0, 0, 0, WIRE_READ },
	{ 0xD0, 0, 2, 4, 20, WIRE_WRITE },
	{ 0xD1, 0x30, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0xD1, 0x85, 1, 0, 0, WIRE_WRITE },
	{ 0xD5, 0, 1, 0x88, 0, WIRE_WRITE },
	{ 0xD5, 1, 0, 0, 0, WIRE_READ },
	{ 0xD8, 0, 0, 0, 0, WIRE_READ },
	{ 0xDA, 1, 0, 0, 0, WIRE_WRITE },
	{ 0xDA, 2, 0, 0, 0, WIRE_READ },
	{ 0xDB, 0x10, 0x48, 1, 0, WIRE_ONE_SHOT },
	{ 0xDD, 0x50, 0x30, 0, 0, WIRE_READ },
	{ 0xDD, 0x55, 0, 0, 0, WIRE_WRITE },
	{ 0xDE, 0x30, 1, 0, 0, WIRE_ONE_SHOT },
	{ 0xE0, 0, 0, 0, 0, WIRE_READ },
	{ 0xE0, 10, 0, 0, 0, WIRE_ONE_SHOT },
	{ 0xF3, 0, 0, 0, 0, WIRE_ONE_SHOT },
};

static void requests_are_of_the_class_they_should_be(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof(classes) / sizeof(classes[0]); i++) {
		uint8_t p[WIRE_PK] = { WIRE_REQUEST,  classes[i].op, classes[i].p1,
				       classes[i].p2, classes[i].p3, classes[i].p4 };
		const struct wire_op_row *row = wire_op_find(p[1], p[2]);

		assert_non_null(row);
		if (wire_request_class(row, p) != classes[i].class)
			fail_msg("%s %02x %02x %02x %02x: class %d, expected %d", row->name, p[2],
				 p[3], p[4], p[5], wire_request_class(row, p), classes[i].class);
	}
}

/* A request and a fitting reply of an operation whose fields are all zero. */
static const struct wire_op_row *pair(enum wire_op op, uint8_t req[WIRE_PK], uint8_t rep[WIRE_PK])
{
	static const uint8_t zeros[512];

	wire_encode_req(op, req, zeros);
	wire_encode_rep(op, rep, zeros);
	wire_finish(req, 0x42);
	wire_finish(rep, 0x42);
	if (wire_op(op)->flags & WIRE_CHECK)
		rep[WIRE_AT_CHECK] = WIRE_CHECK_BASE;
	return wire_op(op);
}

static void the_reply_of_every_operation_matches(void **state)
{
	uint8_t req[WIRE_PK], rep[WIRE_PK];

	(void)state;
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const struct wire_op_row *row = pair((enum wire_op)op, req, rep);

		if (wire_match_reply(row, req, rep) != WIRE_OK)
			fail_msg("%s: own reply does not match", row->name);
	}
}

static void replies_to_something_else_do_not_match(void **state)
{
	uint8_t req[WIRE_PK], rep[WIRE_PK];

	(void)state;
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const struct wire_op_row *row = pair((enum wire_op)op, req, rep);

		rep[WIRE_AT_ID]++;
		assert_int_equal(wire_match_reply(row, req, rep), WIRE_ID);
		rep[WIRE_AT_ID]--;
		rep[WIRE_AT_OP]++;
		assert_int_equal(wire_match_reply(row, req, rep), WIRE_OPERATION);
		rep[WIRE_AT_OP]--;
		rep[WIRE_AT_P1]++;
		assert_int_equal(wire_match_reply(row, req, rep),
				 row->flags & WIRE_P1 ? WIRE_ECHO : WIRE_OK);
		rep[WIRE_AT_P1]--;
		rep[WIRE_AT_P2]++;
		assert_int_equal(wire_match_reply(row, req, rep),
				 row->flags & WIRE_P2 ? WIRE_ECHO : WIRE_OK);
		rep[WIRE_AT_P2]--;
		rep[WIRE_AT_CHECK]++;
		assert_int_equal(wire_match_reply(row, req, rep),
				 row->flags & WIRE_CHECK ? WIRE_CHECK_BYTE : WIRE_OK);
	}
}

static void the_check_byte_wraps(void **state)
{
	uint8_t req[WIRE_PK], rep[WIRE_PK];
	const struct wire_op_row *row = pair(WIRE_OP_PULSE_STATUS, req, rep);

	(void)state;
	for (unsigned int check = 0; check < 256; check++) {
		req[WIRE_AT_P2] = (uint8_t)check;
		rep[WIRE_AT_CHECK] = (uint8_t)(0x5A + check);
		assert_int_equal(wire_match_reply(row, req, rep), WIRE_OK);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_packet_belongs_to_at_most_one_row),
		cmocka_unit_test(rows_are_complete),
		cmocka_unit_test(names_are_unique),
		cmocka_unit_test(every_needed_operation_is_there),
		cmocka_unit_test(dangerous_operations_are_not_there),
		cmocka_unit_test(requests_are_of_the_class_they_should_be),
		cmocka_unit_test(the_reply_of_every_operation_matches),
		cmocka_unit_test(replies_to_something_else_do_not_match),
		cmocka_unit_test(the_check_byte_wraps),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
