/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The longest times are kept, and periods above the threshold counted.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "halbridge/table.h"
#include "halbridge/timing.h"

#define US	UINT64_C(1000)

static struct timing timing;
static struct values values;

static int setup(void **state)
{
	(void)state;
	memset(&timing, 0, sizeof(timing));
	memset(&values, 0, sizeof(values));
	table_set_parameters(&values);
	return 0;
}

static void period(uint64_t read_us, uint64_t write_us)
{
	timing_read(&timing, &values, read_us * US);
	timing_write(&timing, &values, write_us * US);
}

static void the_longest_are_kept_until_somebody_sets_them(void **state)
{
	(void)state;
	assert_true(values.time_threshold == 200);
	period(7, 3);
	period(5, 4);
	assert_true(values.read_time_max == 7 && values.write_time_max == 4);
	values.read_time_max = values.write_time_max = 0;
	period(2, 1);
	assert_true(values.read_time_max == 2 && values.write_time_max == 1);
	values.read_time_max = (double)NAN;
	period(1, 1);
	assert_true(values.read_time_max == 1);
}

static void periods_above_the_threshold_are_counted(void **state)
{
	(void)state;
	period(100, 100);
	assert_int_equal(values.time_exceeded_count, 0);
	period(100, 101);
	period(500, 1);
	assert_int_equal(values.time_exceeded_count, 2);
	assert_int_equal(timing.last_us, 501);
	values.time_threshold = 1000;
	period(500, 1);
	assert_int_equal(values.time_exceeded_count, 2);
}

static void without_a_threshold_none_is(void **state)
{
	static const double none[] = { 0, -1, (double)NAN };

	(void)state;
	for (size_t i = 0; i < sizeof(none) / sizeof(none[0]); i++) {
		values.time_threshold = none[i];
		period(5000, 5000);
		assert_int_equal(values.time_exceeded_count, 0);
	}
}

static void a_read_without_a_write_is_a_period(void **state)
{
	(void)state;
	timing_read(&timing, &values, 300 * US);
	timing_read(&timing, &values, 3 * US);
	assert_int_equal(values.time_exceeded_count, 1);
	timing_read(&timing, &values, 3 * US);
	assert_int_equal(values.time_exceeded_count, 1);
}

static void a_write_without_a_read_is_one_as_well(void **state)
{
	(void)state;
	timing_write(&timing, &values, 300 * US);
	timing_write(&timing, &values, 3 * US);
	assert_int_equal(values.time_exceeded_count, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(the_longest_are_kept_until_somebody_sets_them, setup),
		cmocka_unit_test_setup(periods_above_the_threshold_are_counted, setup),
		cmocka_unit_test_setup(without_a_threshold_none_is, setup),
		cmocka_unit_test_setup(a_read_without_a_write_is_a_period, setup),
		cmocka_unit_test_setup(a_write_without_a_read_is_one_as_well, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
