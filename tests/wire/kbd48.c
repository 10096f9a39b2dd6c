/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The key map of the kbd48CNC (protocol section 3.13) is one to one, and has
 * its corners where the documentation has them.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "wire/bus.h"

#define ALL ((UINT64_C(1) << WIRE_KBD48_KEYS) - 1)

static void corners_are_where_section_3_13_says(void **state)
{
	(void)state;
	/* x = 0, y = 0: byte (0 >> 1) ^ 1 = 1, bit 7 */
	assert_int_equal(wire_kbd48_bit(0), 15);
	/* x = 0, y = 3: bit 4 */
	assert_int_equal(wire_kbd48_bit(3), 12);
	/* x = 1, y = 0: byte 1, bit 0 */
	assert_int_equal(wire_kbd48_bit(4), 8);
	/* x = 2, y = 1: byte 0, bit 6 */
	assert_int_equal(wire_kbd48_bit(9), 6);
	/* x = 11, y = 3: byte 5 ^ 1 = 4, bit 3 */
	assert_int_equal(wire_kbd48_bit(47), 35);
	assert_int_equal(wire_kbd48_bit(48), -1);
	assert_int_equal(wire_kbd48_bit(~0u), -1);
}

static void every_key_has_a_bit_of_its_own(void **state)
{
	uint64_t bits = 0;

	(void)state;
	for (unsigned int key = 0; key < WIRE_KBD48_KEYS; key++) {
		const int bit = wire_kbd48_bit(key);

		assert_in_range(bit, 0, 47);
		assert_false(bits & (UINT64_C(1) << bit));
		bits |= UINT64_C(1) << bit;
	}
	assert_true(bits == ALL);
}

static void keys_and_data_convert_both_ways(void **state)
{
	uint8_t data[WIRE_PONET_DATA];

	(void)state;
	for (unsigned int key = 0; key < WIRE_KBD48_KEYS; key++) {
		const int bit = wire_kbd48_bit(key);

		wire_kbd48_data(UINT64_C(1) << key, data);
		for (int i = 0; i < WIRE_PONET_DATA; i++)
			assert_int_equal(data[i], i == bit / 8 ? 1 << (bit % 8) : 0);
		assert_true(wire_kbd48_keys(data) == UINT64_C(1) << key);
	}
	wire_kbd48_data(UINT64_MAX, data);
	assert_true(wire_kbd48_keys(data) == ALL);
	assert_int_equal(data[5], 0xFF);
	assert_int_equal(data[6], 0);
	/* bytes behind the keys do not matter */
	memset(data, 0, sizeof(data));
	memset(data + 6, 0xFF, sizeof(data) - 6);
	assert_true(wire_kbd48_keys(data) == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(corners_are_where_section_3_13_says),
		cmocka_unit_test(every_key_has_a_bit_of_its_own),
		cmocka_unit_test(keys_and_data_convert_both_ways),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
