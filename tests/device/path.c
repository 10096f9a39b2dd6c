/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The path of a motion buffer after 49.7 days of motion: slots are found as on the first. No step
 * is longer, and no change of steps larger, than the axis can do while it catches up.
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
		const struct buffer_slot before = to;

		to.position[0] = i;
		buffer_path_step(device, device->buffer.end, &to, &before);
		buffer_path_accept(device, 1);
	}
}

static void slots_are_found_beyond_32_bits(void **state)
{
	static const uint64_t begins[] = {
		0,
		UINT32_MAX - UINT64_C(100),
		UINT32_MAX - UINT64_C(50),
		UINT32_MAX,
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

enum { MOST = 40, CHANGE = 3 };

static struct buffer_slot wish;
static int32_t step_before;

static void begin_follow(void)
{
	device->image.engine.axis[0].max_speed = MOST * 1e3f;
	device->image.engine.axis[0].max_acceleration = (CHANGE - 1) * 1e6f;
	wish.position[0] = 0;
	step_before = 0;
	buffer_path_begin(device, wish.position);
}

/* A slot in which the wish goes on by so much; where the axis is then. */
static int32_t follow(int32_t pace)
{
	const struct buffer_slot before = wish;
	int32_t step;

	wish.position[0] += pace;
	buffer_path_step(device, device->buffer.end, &wish, &before);
	buffer_path_accept(device, 1);
	step = device->buffer.step[0];
	assert_in_range(step + MOST, 0, 2 * MOST);
	assert_in_range(step - step_before + CHANGE, 0, 2 * CHANGE);
	step_before = step;
	return device->buffer.path[device->buffer.end % BUFFER_PATH].position[0];
}

static void follow_exactly(int32_t pace)
{
	const int32_t at = follow(pace);

	assert_int_equal(at, wish.position[0]);
}

/* After a gap it is far behind. It catches up, passes nothing, and goes on with it. */
static void it_brakes_to_what_it_has_caught_up_with(void **state)
{
	(void)state;
	for (int32_t pace = -30; pace <= 30; pace += 5) {
		for (int32_t gap = -3000; gap <= 3000; gap += 125) {
			begin_follow();
			wish.position[0] = gap;
			for (unsigned int k = 0; k < 1000; k++) {
				const int32_t at = follow(pace);
				const int32_t off = wish.position[0] - at;

				if (gap > 0 && pace >= 0)
					assert_true(off >= 0);
				if (gap < 0 && pace <= 0)
					assert_true(off <= 0);
			}
			follow_exactly(pace);
			assert_int_equal(step_before, pace);
		}
	}
}

enum { WINDOW = 10, RUN_MS = 600 };

/* A stepper's 200,000 pulses/s^2: what rounding needs is ten times as much. */
static const float slowly = 0.2f; /* pulses/ms^2 */

/* So fast in all, and slower by no more than it can in any ten slots. `paces`: of each slot. */
static void catch_up(const int32_t paces[RUN_MS], int32_t gap)
{
	struct wire_axis_config *config =
		&device->configure.setting[SETTING_AXIS].value.axis.config;
	int32_t steps[RUN_MS], fastest = 0;

	begin_follow();
	config->max_accel = config->max_decel = slowly;
	device->image.engine.axis[0].max_acceleration = slowly * 1e6f;
	wish.position[0] = gap;
	for (int32_t k = 0; k < RUN_MS; k++) {
		assert_true(follow(paces[k]) <= wish.position[0]);
		steps[k] = step_before;
		fastest = steps[k] > fastest ? steps[k] : fastest;
		if (k >= WINDOW)
			assert_true((float)(steps[k - WINDOW] - steps[k]) <= slowly * WINDOW + 2);
	}
	assert_true(fastest >= paces[0] + 15);
}

static void a_stepper_brakes_as_it_can(void **state)
{
	int32_t paces[RUN_MS];

	(void)state;
	for (int32_t k = 0; k < RUN_MS; k++)
		paces[k] = 5;
	catch_up(paces, 3000);
	follow_exactly(5);
	/* what it follows slows down as well, at four fifths of that */
	for (int32_t k = 0; k < RUN_MS; k++)
		paces[k] = k < 60 ? 20 : k < 185 ? 20 - (k - 60) * 4 / 25 : 0;
	catch_up(paces, 3000);
	follow_exactly(0);
	/* a command that has not come for a cycle, and is there in the next */
	for (int32_t k = 0; k < RUN_MS; k++)
		paces[k] = k == 40 || k == 90 ? 0 : k == 41 || k == 91 ? 20 : 10;
	catch_up(paces, 3000);
	follow_exactly(10);
}

/* What is suddenly on the other side is followed from rest. */
static void it_turns_from_rest(void **state)
{
	(void)state;
	begin_follow();
	for (unsigned int k = 0; k < 100; k++)
		follow(-10);
	wish.position[0] += 5000;
	buffer_path_step(device, device->buffer.end, &wish, &wish);
	assert_in_range(device->buffer.step[0], 0, CHANGE);
}

/* As far as it can slow down, and it is not passed in any case. */
static void what_it_can_follow_is_followed_exactly(void **state)
{
	(void)state;
	begin_follow();
	for (int32_t pace = 0; pace < 30; pace += CHANGE)
		follow_exactly(pace);
	for (int32_t pace = 30; pace > -30; pace -= CHANGE)
		follow_exactly(pace);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(slots_are_found_beyond_32_bits, begin, end),
		cmocka_unit_test_setup_teardown(it_brakes_to_what_it_has_caught_up_with, begin,
						end),
		cmocka_unit_test_setup_teardown(it_turns_from_rest, begin, end),
		cmocka_unit_test_setup_teardown(a_stepper_brakes_as_it_can, begin, end),
		cmocka_unit_test_setup_teardown(what_it_can_follow_is_followed_exactly, begin, end),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
