/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Slots of the motion buffer and the multi-part fill (protocol sections
 * 3.24.5 and 1.6): codes, capacity, and refusal of anything which does not
 * belong together - a wrongly taken part would move the machine.
 */

#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "wire/pulse.h"

static void slots_are_sign_and_magnitude(void **state)
{
	(void)state;
	assert_int_equal(wire_slot8(1), 0x01);
	assert_int_equal(wire_slot8(-1), 0x81);
	assert_int_equal(wire_slot8(127), 0x7F);
	assert_int_equal(wire_slot8(-127), 0xFF);
	assert_int_equal(wire_slot8(0), 0x00);
	assert_int_equal(wire_slot16(-1), 0x8001);
	assert_int_equal(wire_slot16(-32767), 0xFFFF);
	for (int n = -127; n <= 127; n++)
		assert_int_equal(wire_slot8_steps(wire_slot8(n)), n);
	for (int n = -32767; n <= 32767; n++)
		assert_int_equal(wire_slot16_steps(wire_slot16(n)), n);
}

static void steps_beyond_a_slot_are_clamped(void **state)
{
	(void)state;
	assert_int_equal(wire_slot8_steps(wire_slot8(128)), 127);
	assert_int_equal(wire_slot8_steps(wire_slot8(-1000)), -127);
	assert_int_equal(wire_slot8_steps(wire_slot8(INT_MIN)), -127);
	assert_int_equal(wire_slot8_steps(wire_slot8(INT_MAX)), 127);
	assert_int_equal(wire_slot16_steps(wire_slot16(INT_MIN)), -32767);
	assert_int_equal(wire_slot16_steps(wire_slot16(40000)), 32767);
	/* negative zero stands still */
	assert_int_equal(wire_slot8_steps(0x80), 0);
}

static void capacity_is_that_of_section_3_24_5(void **state)
{
	(void)state;
	assert_int_equal(wire_slots_max(WIRE_SLOTS_8BIT, 8, WIRE_FILL_DATA), 7);
	assert_int_equal(wire_slots_max(WIRE_SLOTS_8BIT, 4, WIRE_FILL_DATA), 14);
	assert_int_equal(wire_slots_max(WIRE_SLOTS_8BIT, 3, WIRE_FILL_DATA), 18);
	assert_int_equal(wire_slots_max(WIRE_SLOTS_8BIT, 1, WIRE_FILL_DATA), 56);
	assert_int_equal(wire_slots_max(WIRE_SLOTS_16BIT, 3, WIRE_FILL_DATA), 9);
	assert_int_equal(wire_slots_max(WIRE_SLOTS_8BIT, 3, WIRE_MULTI_DATA), 149);
	assert_int_equal(wire_slots_max(WIRE_SLOTS_16BIT, 3, WIRE_MULTI_DATA), 74);
	assert_int_equal(wire_slots_max(WIRE_SLOTS_8BIT, 0, WIRE_FILL_DATA), 0);
	assert_int_equal(wire_slots_max(WIRE_SLOTS_8BIT, 9, WIRE_FILL_DATA), 0);
	assert_true(wire_fill_fits(WIRE_SLOTS_8BIT, 18, 3, WIRE_FILL_DATA));
	assert_false(wire_fill_fits(WIRE_SLOTS_8BIT, 19, 3, WIRE_FILL_DATA));
	assert_false(wire_fill_fits(WIRE_SLOTS_8BIT, 1, 0, WIRE_FILL_DATA));
	assert_false(wire_fill_fits(WIRE_SLOTS_8BIT, 255, 255, WIRE_FILL_DATA));
}

static void a_slot_has_the_axes_in_order(void **state)
{
	uint8_t data[WIRE_FILL_DATA] = { 0 };

	(void)state;
	assert_true(wire_slot_set(data, sizeof(data), WIRE_SLOTS_8BIT, 3, 2, 1, -5));
	assert_int_equal(data[7], 0x85);
	assert_true(wire_slot_set(data, sizeof(data), WIRE_SLOTS_16BIT, 3, 2, 1, -600));
	assert_int_equal(data[14], 0x58);
	assert_int_equal(data[15], 0x82);
	assert_int_equal(wire_slot_get(data, sizeof(data), WIRE_SLOTS_16BIT, 3, 2, 1), -600);
	assert_int_equal(wire_slot_get(data, sizeof(data), WIRE_SLOTS_8BIT, 3, 2, 1), -5);
}

static void slots_outside_the_data_are_neither_read_nor_written(void **state)
{
	uint8_t data[WIRE_FILL_DATA], before[WIRE_FILL_DATA];
	const uint8_t widths[] = { WIRE_SLOTS_8BIT, WIRE_SLOTS_16BIT, 0x00 };

	(void)state;
	memset(data, 0x7F, sizeof(data));
	memcpy(before, data, sizeof(data));
	for (unsigned int w = 0; w < sizeof(widths); w++) {
		for (unsigned int axes = 0; axes < 256; axes++) {
			const unsigned int max = wire_slots_max(widths[w], (uint8_t)axes,
								sizeof(data));

			assert_false(wire_slot_set(data, sizeof(data), widths[w], (uint8_t)axes,
						   max, 0, 1));
			assert_false(wire_slot_set(data, sizeof(data), widths[w], (uint8_t)axes, 0,
						   axes, 1));
			assert_int_equal(wire_slot_get(data, sizeof(data), widths[w], (uint8_t)axes,
						       UINT_MAX, 0),
					 0);
		}
	}
	assert_memory_equal(data, before, sizeof(data));
}

static const struct wire_multi fill3 = { WIRE_SLOTS_8BIT, 20, 3 };

static void build(uint8_t p[WIRE_MULTI_BYTES], uint8_t id)
{
	uint8_t data[60];

	for (size_t i = 0; i < sizeof(data); i++)
		data[i] = (uint8_t)(i + 1);
	assert_true(wire_multi_build(p, id, &fill3, data, sizeof(data)));
}

static void a_built_fill_is_parsed_again(void **state)
{
	uint8_t p[WIRE_MULTI_BYTES], data[WIRE_MULTI_DATA];
	struct wire_multi fill;

	(void)state;
	for (unsigned int id = 0; id < 256; id++) {
		build(p, (uint8_t)id);
		assert_int_equal(wire_multi_reply_id((uint8_t)id), p[7 * WIRE_PK + WIRE_AT_ID]);
		assert_true(wire_multi_parse(p, &fill, data));
		assert_memory_equal(&fill, &fill3, sizeof(fill));
		assert_int_equal(data[0], 1);
		assert_int_equal(data[59], 60);
		assert_int_equal(data[60], 0);
	}
}

static void a_fill_larger_than_its_data_is_not_built(void **state)
{
	uint8_t p[WIRE_MULTI_BYTES], before[WIRE_MULTI_BYTES], data[WIRE_MULTI_DATA + 1] = { 0 };
	struct wire_multi fill = { WIRE_SLOTS_8BIT, 20, 3 };

	(void)state;
	memset(before, 0xEE, sizeof(before));
	memcpy(p, before, sizeof(p));
	assert_false(wire_multi_build(p, 0, &fill, data, 59));
	assert_false(wire_multi_build(p, 0, &fill, data, WIRE_MULTI_DATA + 1));
	fill.axes = 9;
	assert_false(wire_multi_build(p, 0, &fill, data, WIRE_MULTI_DATA));
	fill = (struct wire_multi){ 0xFD, 20, 3 };
	assert_false(wire_multi_build(p, 0, &fill, data, WIRE_MULTI_DATA));
	assert_memory_equal(p, before, sizeof(p));
}

/* Any header bit of any part: the sum, the order or the ids no longer fit. */
static void a_damaged_header_in_any_part_is_refused(void **state)
{
	uint8_t p[WIRE_MULTI_BYTES], data[WIRE_MULTI_DATA];
	struct wire_multi fill;

	(void)state;
	build(p, 250);
	for (unsigned int part = 0; part < WIRE_MULTI_PARTS; part++) {
		for (unsigned int bit = 0; bit < 64; bit++) {
			uint8_t *byte = &p[part * WIRE_PK + bit / 8];

			*byte ^= (uint8_t)(1u << (bit % 8));
			assert_false(wire_multi_parse(p, &fill, data));
			*byte ^= (uint8_t)(1u << (bit % 8));
		}
	}
	assert_true(wire_multi_parse(p, &fill, data));
}

static void parts_of_two_fills_are_not_mixed(void **state)
{
	uint8_t p[WIRE_MULTI_BYTES], q[WIRE_MULTI_BYTES], data[WIRE_MULTI_DATA];
	struct wire_multi fill;

	(void)state;
	build(p, 10);
	build(q, 30);
	for (unsigned int part = 0; part < WIRE_MULTI_PARTS; part++) {
		uint8_t mixed[WIRE_MULTI_BYTES];

		memcpy(mixed, p, sizeof(mixed));
		memcpy(mixed + part * WIRE_PK, q + part * WIRE_PK, WIRE_PK);
		assert_false(wire_multi_parse(mixed, &fill, data));
	}
	/* two parts swapped, each good by itself */
	memcpy(q, p, sizeof(q));
	memcpy(q + 2 * WIRE_PK, p + 3 * WIRE_PK, WIRE_PK);
	memcpy(q + 3 * WIRE_PK, p + 2 * WIRE_PK, WIRE_PK);
	assert_false(wire_multi_parse(q, &fill, data));
}

static void a_fill_claiming_too_much_is_refused(void **state)
{
	uint8_t p[WIRE_MULTI_BYTES], data[WIRE_MULTI_DATA];
	struct wire_multi fill;

	(void)state;
	build(p, 0);
	p[WIRE_AT_P3] = 150;
	wire_finish(p, 0);
	assert_false(wire_multi_parse(p, &fill, data));
	p[WIRE_AT_P3] = 149;
	wire_finish(p, 0);
	assert_true(wire_multi_parse(p, &fill, data));
	p[WIRE_AT_P2] = 0x00;
	wire_finish(p, 0);
	assert_false(wire_multi_parse(p, &fill, data));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(slots_are_sign_and_magnitude),
		cmocka_unit_test(steps_beyond_a_slot_are_clamped),
		cmocka_unit_test(capacity_is_that_of_section_3_24_5),
		cmocka_unit_test(a_slot_has_the_axes_in_order),
		cmocka_unit_test(slots_outside_the_data_are_neither_read_nor_written),
		cmocka_unit_test(a_built_fill_is_parsed_again),
		cmocka_unit_test(a_fill_larger_than_its_data_is_not_built),
		cmocka_unit_test(a_damaged_header_in_any_part_is_refused),
		cmocka_unit_test(parts_of_two_fills_are_not_mixed),
		cmocka_unit_test(a_fill_claiming_too_much_is_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
