/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The path of a motion buffer after 49.7 days of motion: slots are found as on the first.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/device/internal.h"

static struct device *device;

static int begin(void **state)
{
	(void)state;
	device = aligned_alloc(64, device_size());
	assert_non_null(device);
	memset(device, 0, device_size());
	device->image.engine.axes_enabled = 1;
	device->image.engine.axis[0].mode = POKEYS_AXIS_BUFFERED;
	device->motion.driven = 1;
	return 0;
}

static int end(void **state)
{
	(void)state;
	free(device);
	return 0;
}

/* From there on a pulse in each slot, as far as the path reaches back. */
static void walk(uint64_t from)
{
	struct buffer_slot to = { { 0 } };

	buffer_path_begin(device, to.position);
	device->buffer.seen = device->buffer.end = from;
	device->buffer.path[from % BUFFER_PATH].position[0] = 0;
	for (int32_t i = 1; i <= 100; i++) {
		to.position[0] = i;
		buffer_path_step(device, device->buffer.end, &to);
		buffer_path_accept(device, 1);
	}
}

static void slots_are_found_beyond_32_bits(void **state)
{
	static const uint64_t begins[] = {
		0, UINT32_MAX - UINT64_C(100), UINT32_MAX - UINT64_C(50), UINT32_MAX,
	};
	int32_t position[POKEYS_AXES] = { 0 };
	uint64_t at;

	(void)state;
	assert_int_equal(buffer_axes(device), 1);
	for (size_t k = 0; k < sizeof(begins) / sizeof(begins[0]); k++) {
		walk(begins[k]);
		for (int32_t i = 0; i <= 100; i++) {
			position[0] = i;
			assert_true(buffer_path_find(device, position, device->buffer.seen,
						     device->buffer.end, &at));
			assert_true(at == begins[k] + (uint64_t)i);
		}
		position[0] = 101;
		assert_false(buffer_path_find(device, position, device->buffer.seen,
					      device->buffer.end, &at));
		assert_int_equal(buffer_level(device), 100);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(slots_are_found_beyond_32_bits, begin, end),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
