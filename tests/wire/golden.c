/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every row of golden-packets.tsv in both directions, against values written
 * by hand in golden_*.c: our encoder must give the request byte for byte (with
 * the row's request id), our decoder must take it and the reply, and the
 * device's side must give the reply byte for byte.
 *
 * A row without an expectation fails, and so does an expectation without a
 * row: a packet added to the file cannot go untested by accident.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/wire/golden.h"
#include "wire/layout.h"

#define ROWS_MAX 512

struct row {
	char name[96];
	uint8_t req[WIRE_MULTI_BYTES];
	uint8_t rep[WIRE_PK];
	size_t req_len, rep_len;
	bool empty; /* request is the empty datagram */
	bool no_reply;
	const struct golden *expect;
};

static struct row rows[ROWS_MAX];
static size_t row_count;

static const struct golden *const tables[] = {
	golden_system, golden_io, golden_encoder, golden_pulse, golden_bus, golden_panel,
};
#define TABLES (sizeof(tables) / sizeof(tables[0]))

static const struct golden *expectation(const char *name)
{
	for (size_t t = 0; t < TABLES; t++) {
		for (const struct golden *g = tables[t]; g->name; g++) {
			if (!strcmp(g->name, name))
				return g;
		}
	}
	return NULL;
}

static const struct row *row_named(const char *name)
{
	for (size_t i = 0; i < row_count; i++) {
		if (!strcmp(rows[i].name, name))
			return &rows[i];
	}
	return NULL;
}

/* Returns the number of bytes, or aborts the run: the file is part of the test. */
static size_t unhex(const char *hex, uint8_t *out, size_t max, const char *name)
{
	const size_t len = strlen(hex) / 2;

	if (strlen(hex) % 2 || len > max) {
		fprintf(stderr, "%s: bad length of hex column\n", name);
		exit(1);
	}
	for (size_t i = 0; i < len; i++) {
		unsigned int byte;

		if (sscanf(hex + 2 * i, "%2x", &byte) != 1) {
			fprintf(stderr, "%s: not hex: %s\n", name, hex + 2 * i);
			exit(1);
		}
		out[i] = (uint8_t)byte;
	}
	return len;
}

static void load_row(char *line)
{
	struct row *row = &rows[row_count];
	char *save;
	const char *name = strtok_r(line, "\t", &save);
	const char *req = strtok_r(NULL, "\t", &save);
	const char *rep = strtok_r(NULL, "\t\r\n", &save);

	if (!name || !req || !rep || row_count == ROWS_MAX || strlen(name) >= sizeof(row->name)) {
		fprintf(stderr, "row %zu: expected three columns\n", row_count + 1);
		exit(1);
	}
	strcpy(row->name, name);
	row->empty = !strcmp(req, "empty");
	row->no_reply = !strcmp(rep, "-");
	if (!row->empty)
		row->req_len = unhex(req, row->req, sizeof(row->req), name);
	if (!row->no_reply)
		row->rep_len = unhex(rep, row->rep, sizeof(row->rep), name);
	row->expect = expectation(name);
	row_count++;
}

static void load(const char *path)
{
	static char line[4096];
	FILE *file = fopen(path, "r");

	if (!file) {
		perror(path);
		exit(1);
	}
	while (fgets(line, sizeof(line), file)) {
		if (line[0] != '#')
			load_row(line);
	}
	fclose(file);
}

static void same(const struct row *row, const char *what, const void *got, const void *want,
		 size_t len)
{
	const uint8_t *a = got, *b = want;

	for (size_t i = 0; i < len; i++) {
		if (a[i] != b[i])
			fail_msg("%s: %s: byte %zu is 0x%02x, expected 0x%02x", row->name, what, i,
				 a[i], b[i]);
	}
}

/* value decoded into a struct must equal the expected one. */
static void same_value(const struct row *row, const char *what, const struct wire_layout *layout,
		       const void *got, const void *want)
{
	static const uint8_t nothing[512];

	assert_true(layout->size <= sizeof(nothing));
	same(row, what, got, want ? want : nothing, layout->size);
}

static void every_row_has_an_expectation(void **state)
{
	(void)state;
	assert_int_equal(row_count, 181);
	for (size_t i = 0; i < row_count; i++) {
		if (!rows[i].expect)
			fail_msg("%s: no expectation in golden_*.c", rows[i].name);
	}
}

static void every_expectation_has_a_row(void **state)
{
	size_t count = 0;

	(void)state;
	for (size_t t = 0; t < TABLES; t++) {
		for (const struct golden *g = tables[t]; g->name; g++, count++) {
			if (!row_named(g->name))
				fail_msg("%s: no such row", g->name);
			if (expectation(g->name) != g)
				fail_msg("%s: expected twice", g->name);
		}
	}
	assert_int_equal(count, row_count);
}

static void packets_are_found_in_the_table(void **state)
{
	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];
		const struct wire_op_row *found;

		if (row->expect->kind == GOLDEN_DISCOVERY)
			continue;
		found = wire_op_find(row->req[WIRE_AT_OP], row->req[WIRE_AT_P1]);
		if (!found || found->op != row->expect->op)
			fail_msg("%s: found as %s, expected %s", row->name,
				 found ? found->name : "nothing", wire_op(row->expect->op)->name);
	}
}

static void requests_are_encoded_byte_for_byte(void **state)
{
	uint8_t p[WIRE_PK];

	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];

		if (row->expect->kind != GOLDEN_PACKET)
			continue;
		assert_int_equal(row->req_len, WIRE_PK);
		memset(p, 0xEE, sizeof(p));
		wire_encode_req(row->expect->op, p, row->expect->req);
		wire_finish(p, row->req[WIRE_AT_ID]);
		same(row, "request", p, row->req, WIRE_PK);
	}
}

static void requests_decode_to_the_values(void **state)
{
	uint8_t value[512];

	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];
		const struct wire_layout *layout = wire_op(row->expect->op)->req;

		if (row->expect->kind != GOLDEN_PACKET)
			continue;
		assert_int_equal(wire_check_request(row->req, row->req_len), WIRE_OK);
		memset(value, 0xEE, sizeof(value));
		wire_decode_req(row->expect->op, row->req, value);
		same_value(row, "request value", layout, value, row->expect->req);
	}
}

/* The part of a request a reply is matched against. */
static const uint8_t *last_part(const struct row *row)
{
	return row->req + row->req_len - WIRE_PK;
}

static void replies_are_accepted(void **state)
{
	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];
		const struct wire_op_row *op = wire_op(row->expect->op);
		enum wire_reason reason;

		if (row->expect->kind == GOLDEN_DISCOVERY)
			continue;
		if (row->no_reply != !!(op->flags & WIRE_NO_REPLY))
			fail_msg("%s: table and row differ on whether there is a reply", row->name);
		if (row->no_reply)
			continue;
		reason = wire_check_reply(row->rep, row->rep_len);
		if (reason == WIRE_OK)
			reason = wire_match_reply(op, last_part(row), row->rep);
		if (reason != WIRE_OK)
			fail_msg("%s: %s", row->name, wire_reason_name(reason));
	}
}

static void replies_decode_to_the_values(void **state)
{
	uint8_t value[512];

	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];
		const struct wire_layout *layout = wire_op(row->expect->op)->rep;

		if (row->expect->kind == GOLDEN_DISCOVERY || row->no_reply)
			continue;
		memset(value, 0xEE, sizeof(value));
		wire_decode_rep(row->expect->op, row->rep, value);
		same_value(row, "reply value", layout, value, row->expect->rep);
	}
}

static void replies_are_encoded_byte_for_byte(void **state)
{
	uint8_t p[WIRE_PK];

	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];

		if (row->expect->kind == GOLDEN_DISCOVERY || row->no_reply)
			continue;
		memset(p, 0xEE, sizeof(p));
		wire_encode_rep(row->expect->op, p, row->expect->rep);
		wire_finish(p, row->rep[WIRE_AT_ID]);
		same(row, "reply", p, row->rep, WIRE_PK);
	}
}

static void count_up(uint8_t *data, size_t len)
{
	for (size_t i = 0; i < len; i++)
		data[i] = (uint8_t)i;
}

static void multi_part_fills_are_built_byte_for_byte(void **state)
{
	uint8_t p[WIRE_MULTI_BYTES], data[WIRE_MULTI_DATA];
	unsigned int seen = 0;

	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];
		const struct golden_multi *want = row->expect->req;

		if (row->expect->kind != GOLDEN_MULTI)
			continue;
		assert_int_equal(row->req_len, WIRE_MULTI_BYTES);
		count_up(data, want->len);
		assert_true(wire_multi_build(p, row->req[WIRE_AT_ID], &want->fill, data,
					     want->len));
		same(row, "datagram", p, row->req, sizeof(p));
		assert_int_equal(wire_multi_reply_id(row->req[WIRE_AT_ID]), row->rep[WIRE_AT_ID]);
		seen++;
	}
	assert_int_equal(seen, 2);
}

static void multi_part_fills_are_parsed(void **state)
{
	uint8_t want_data[WIRE_MULTI_DATA] = { 0 }, data[WIRE_MULTI_DATA];
	struct wire_multi fill;

	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];
		const struct golden_multi *want = row->expect->req;

		if (row->expect->kind != GOLDEN_MULTI)
			continue;
		memset(want_data, 0, sizeof(want_data));
		count_up(want_data, want->len);
		assert_true(wire_multi_parse(row->req, &fill, data));
		assert_int_equal(fill.width, want->fill.width);
		assert_int_equal(fill.slots, want->fill.slots);
		assert_int_equal(fill.axes, want->fill.axes);
		same(row, "slots", data, want_data, sizeof(data));
	}
}

static void discovery_replies_work_both_ways(void **state)
{
	uint8_t p[WIRE_DISCOVERY_LEN];
	struct wire_discovery d;
	unsigned int seen = 0;

	(void)state;
	for (size_t i = 0; i < row_count; i++) {
		const struct row *row = &rows[i];

		if (row->expect->kind != GOLDEN_DISCOVERY)
			continue;
		assert_true(row->empty);
		memset(&d, 0xEE, sizeof(d));
		assert_int_equal(wire_discovery_decode(row->rep, row->rep_len, &d), WIRE_OK);
		same(row, "value", &d, row->expect->rep, sizeof(d));
		assert_int_equal(wire_discovery_encode(p, row->expect->rep), row->rep_len);
		same(row, "reply", p, row->rep, row->rep_len);
		seen++;
	}
	assert_int_equal(seen, 2);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_row_has_an_expectation),
		cmocka_unit_test(every_expectation_has_a_row),
		cmocka_unit_test(packets_are_found_in_the_table),
		cmocka_unit_test(requests_are_encoded_byte_for_byte),
		cmocka_unit_test(requests_decode_to_the_values),
		cmocka_unit_test(replies_are_accepted),
		cmocka_unit_test(replies_decode_to_the_values),
		cmocka_unit_test(replies_are_encoded_byte_for_byte),
		cmocka_unit_test(multi_part_fills_are_built_byte_for_byte),
		cmocka_unit_test(multi_part_fills_are_parsed),
		cmocka_unit_test(discovery_replies_work_both_ways),
	};

	if (argc != 2) {
		fprintf(stderr, "usage: %s golden-packets.tsv\n", argv[0]);
		return 1;
	}
	load(argv[1]);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
