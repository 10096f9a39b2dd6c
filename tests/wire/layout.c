/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Properties every layout must have, whatever it describes: inside the packet
 * and the struct, no two fields over each other, the header left alone, and
 * nothing read or written beyond 64 bytes even at the edge of a mapping.
 *
 * Where each field stands is not checked here but in golden.c and vectors.c.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "wire/bus.h"
#include "wire/layout.h"
#include "wire/panel.h"
#include "wire/pulse.h"
#include "wire/system.h"

#define STRUCT_MAX 512

static size_t member_bytes(const struct wire_field *f)
{
	return f->kind == WIRE_KIND_U56 ? 8u : wire_kind_size(f->kind);
}

/* Marks what a layout covers in packet and struct; fails on a second mark. */
static void mark(const char *name, const struct wire_layout *layout, uint8_t packet[WIRE_PK],
		 uint8_t object[STRUCT_MAX])
{
	for (unsigned int i = 0; i < layout->count; i++) {
		const struct wire_field *f = &layout->fields[i];
		const size_t wide = (size_t)f->count * wire_kind_size(f->kind);
		const size_t size = f->count * member_bytes(f);

		assert_true(f->reps >= 1 && f->count >= 1 && wide >= 1);
		for (unsigned int rep = 0; rep < f->reps; rep++) {
			const size_t at = f->at + (size_t)rep * f->stride;
			const size_t offset = f->offset + (size_t)rep * f->step;

			if (at + wide > WIRE_PK || offset + size > layout->size)
				fail_msg("%s: field %u is outside", name, i);
			for (size_t b = 0; b < wide; b++) {
				if (packet[at + b]++)
					fail_msg("%s: byte @%zu twice", name, at + b);
			}
			for (size_t b = 0; b < size; b++) {
				if (object[offset + b]++)
					fail_msg("%s: struct byte %zu twice", name, offset + b);
			}
		}
	}
}

static void fields_lie_inside_and_do_not_overlap(void **state)
{
	(void)state;
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const struct wire_op_row *row = wire_op((enum wire_op)op);
		const struct wire_layout *both[] = { row->req, row->rep };

		for (unsigned int i = 0; i < 2; i++) {
			uint8_t packet[WIRE_PK] = { 0 }, object[STRUCT_MAX] = { 0 };

			assert_in_range(both[i]->size, 1, STRUCT_MAX);
			mark(row->name, both[i], packet, object);
			assert_int_equal(packet[WIRE_AT_MAGIC], 0);
			assert_int_equal(packet[WIRE_AT_OP], 0);
			assert_int_equal(packet[WIRE_AT_ID], 0);
			assert_int_equal(packet[WIRE_AT_SUM], 0);
		}
	}
}

/* A request with a fixed sub-id must not let a field overwrite it. */
static void a_fixed_sub_id_is_not_a_field(void **state)
{
	(void)state;
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const struct wire_op_row *row = wire_op((enum wire_op)op);
		uint8_t packet[WIRE_PK] = { 0 }, object[STRUCT_MAX] = { 0 };

		if (!row->sub.where)
			continue;
		mark(row->name, row->req, packet, object);
		assert_int_equal(packet[row->sub.where], row->sub.first != row->sub.last);
	}
}

static uint64_t seed;

static uint8_t random_byte(void)
{
	seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
	return (uint8_t)(seed >> 56);
}

static int seed_setup(void **state)
{
	const char *given = getenv("POKEYS_SEED");

	(void)state;
	seed = given ? strtoull(given, NULL, 0) : (uint64_t)time(NULL);
	print_message("POKEYS_SEED=%llu\n", (unsigned long long)seed);
	return 0;
}

/* Decode, encode, decode: the same value; encode again: the same bytes. */
static void random_packets_survive_a_round_trip(void **state)
{
	uint8_t p[WIRE_PK], q[WIRE_PK], r[WIRE_PK], a[STRUCT_MAX], b[STRUCT_MAX];

	(void)state;
	for (unsigned int round = 0; round < 200 * WIRE_OP_COUNT; round++) {
		const enum wire_op op = (enum wire_op)(round % WIRE_OP_COUNT);
		const struct wire_op_row *row = wire_op(op);

		for (unsigned int i = 0; i < WIRE_PK; i++)
			p[i] = random_byte();
		wire_decode_req(op, p, a);
		wire_encode_req(op, q, a);
		wire_decode_req(op, q, b);
		wire_encode_req(op, r, b);
		assert_memory_equal(a, b, row->req->size);
		assert_memory_equal(q, r, WIRE_PK);
		wire_decode_rep(op, p, a);
		wire_encode_rep(op, q, a);
		wire_decode_rep(op, q, b);
		wire_encode_rep(op, r, b);
		assert_memory_equal(a, b, row->rep->size);
		assert_memory_equal(q, r, WIRE_PK);
	}
}

/* What a layout covers goes through unchanged, the rest of a request is zero. */
static void encoding_carries_every_covered_byte(void **state)
{
	uint8_t p[WIRE_PK], q[WIRE_PK], value[STRUCT_MAX];

	(void)state;
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const struct wire_op_row *row = wire_op((enum wire_op)op);
		uint8_t packet[WIRE_PK] = { 0 }, object[STRUCT_MAX] = { 0 };

		mark(row->name, row->req, packet, object);
		memset(p, 1, sizeof(p)); /* within the limit of every count */
		wire_decode_req((enum wire_op)op, p, value);
		wire_encode_req((enum wire_op)op, q, value);
		for (unsigned int i = WIRE_PAYLOAD_AT; i < WIRE_PK; i++)
			assert_int_equal(q[i], packet[i] ? 1 : 0);
	}
}

static void decoding_clears_the_whole_struct_and_no_more(void **state)
{
	uint8_t value[STRUCT_MAX + 1], p[WIRE_PK] = { 0 };

	(void)state;
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const size_t size = wire_op((enum wire_op)op)->rep->size;

		memset(value, 0xEE, sizeof(value));
		wire_decode_rep((enum wire_op)op, p, value);
		for (size_t i = 0; i < sizeof(value); i++)
			assert_int_equal(value[i], i < size ? 0 : 0xEE);
	}
}

/* Two pages, of which only the first may be touched. */
static uint8_t *guarded_page(size_t page)
{
	uint8_t *map = mmap(NULL, 2 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1,
			    0);

	assert_true(map != MAP_FAILED);
	assert_int_equal(mprotect(map + page, page, PROT_NONE), 0);
	return map;
}

static void nothing_is_touched_beyond_the_packet(void **state)
{
	const size_t page = (size_t)sysconf(_SC_PAGESIZE);
	uint8_t *map = guarded_page(page), *p = map + page - WIRE_PK, value[STRUCT_MAX];

	(void)state;
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		memset(map, 0xFF, page);
		wire_decode_req((enum wire_op)op, p, value);
		wire_encode_req((enum wire_op)op, p, value);
		memset(p, 0xFF, WIRE_PK);
		wire_decode_rep((enum wire_op)op, p, value);
		wire_encode_rep((enum wire_op)op, p, value);
		assert_int_equal(p[-1], 0xFF);
	}
	munmap(map, 2 * page);
}

#define LIMITED(name, dir, tag, member, max) do { \
	struct wire_##tag v; \
	uint8_t p[WIRE_PK]; \
	memset(p, 0xFF, sizeof(p)); \
	wire_##name##_decode_##dir(p, &v); \
	assert_int_equal(v.member, (max)); \
	memset(&v, 0xFF, sizeof(v)); \
	wire_##name##_encode_##dir(p, &v); \
	wire_##name##_decode_##dir(p, &v); \
	assert_int_equal(v.member, (max)); \
} while (0)

static void counts_never_exceed_their_arrays(void **state)
{
	(void)state;
	LIMITED(system_log, rep, system_log_rep, count, 27);
	LIMITED(sensor_setup, req, sensor_setup_req, count, 4);
	LIMITED(sensor_setup, rep, sensor_setup_rep, count, 4);
	LIMITED(sensor_values, req, sensor_values_req, count, 13);
	LIMITED(sensor_values, rep, sensor_values_rep, count, 13);
	LIMITED(can_send, req, can_send_req, message[0].length, 8);
	LIMITED(can_queue, rep, can_queue_rep, message[0].length, 8);
	LIMITED(can_queue, rep, can_queue_rep, message[2].length, 8);
	LIMITED(can_read, rep, can_read_rep, message[0].length, 8);
	LIMITED(i2c_write, req, i2c_write_req, write_length, 32);
	LIMITED(i2c_write, req, i2c_write_req, read_length, 32);
	LIMITED(i2c_read, req, i2c_read_req, length, 32);
	LIMITED(i2c_read_result, rep, i2c_read_result_rep, length, 32);
	LIMITED(onewire_start, req, onewire_start_req, write_length, 16);
	LIMITED(onewire_start, req, onewire_start_req, read_length, 16);
	LIMITED(onewire_result, rep, onewire_result_rep, length, 16);
	LIMITED(uart_send, req, uart_send_req, count, 55);
	LIMITED(uart_read, rep, uart_read_rep, count, 55);
	LIMITED(spi_write, req, spi_write_req, length, 55);
	LIMITED(spi_read, req, spi_read_req, length, 55);
	LIMITED(strip_data, req, strip_data_req, count, 18);
}

static void text_always_ends(void **state)
{
	struct wire_device_data_rep data;
	struct wire_device_name_rep name;
	struct wire_lcd_row_req row;
	uint8_t p[WIRE_PK];

	(void)state;
	memset(p, 'x', sizeof(p));
	wire_device_data_decode_rep(p, &data);
	assert_int_equal(strlen(data.magic), 4);
	assert_int_equal(strlen(data.build_date), 11);
	assert_int_equal(strlen(data.name), 10);
	wire_device_name_decode_rep(p, &name);
	assert_int_equal(strlen(name.name), 10);
	assert_int_equal(strlen(name.joystick), 16);
	assert_int_equal(strlen(name.long_name), 20);
	wire_lcd_row_decode_req(p, &row);
	assert_int_equal(strlen(row.text), 24);
}

static void an_empty_operation_takes_null(void **state)
{
	uint8_t p[WIRE_PK];

	(void)state;
	wire_reboot_encode_req(p, NULL);
	assert_int_equal(p[WIRE_AT_OP], 0xF3);
	wire_reboot_decode_req(p, NULL);
	wire_reboot_encode_rep(p, NULL);
	assert_int_equal(p[WIRE_AT_MAGIC], WIRE_REPLY);
	wire_reboot_decode_rep(p, NULL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(fields_lie_inside_and_do_not_overlap),
		cmocka_unit_test(a_fixed_sub_id_is_not_a_field),
		cmocka_unit_test_setup(random_packets_survive_a_round_trip, seed_setup),
		cmocka_unit_test(encoding_carries_every_covered_byte),
		cmocka_unit_test(decoding_clears_the_whole_struct_and_no_more),
		cmocka_unit_test(nothing_is_touched_beyond_the_packet),
		cmocka_unit_test(counts_never_exceed_their_arrays),
		cmocka_unit_test(text_always_ends),
		cmocka_unit_test(an_empty_operation_takes_null),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
