/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every duration falls into the bucket that state.h promises.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/device/histogram.h"

static void buckets_are_quarter_octaves_from_64_ns(void **state)
{
	(void)state;
	assert_int_equal(histogram_bucket(0), 0);
	assert_int_equal(histogram_bucket(79), 0);
	for (unsigned int i = 0; i < POKEYS_HISTOGRAM_BUCKETS; i++) {
		const uint64_t octave = UINT64_C(64) << i / 4;
		const uint64_t from = octave + octave / 4 * (i % 4);

		assert_int_equal(histogram_bucket(from), i);
		assert_int_equal(histogram_bucket(from + octave / 4 - 1), i);
		if (i)
			assert_int_equal(histogram_bucket(from - 1), i - 1);
	}
	assert_int_equal(histogram_bucket(UINT64_MAX), POKEYS_HISTOGRAM_BUCKETS - 1);
}

static void extremes_and_sum_are_kept(void **state)
{
	struct pokeys_histogram h;

	(void)state;
	memset(&h, 0, sizeof(h));
	histogram_add(&h, 500);
	histogram_add(&h, 100);
	histogram_add(&h, 900);
	assert_int_equal(h.count, 3);
	assert_int_equal(h.sum_ns, 1500);
	assert_int_equal(h.min_ns, 100);
	assert_int_equal(h.max_ns, 900);
	assert_int_equal(h.bucket[histogram_bucket(500)], 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(buckets_are_quarter_octaves_from_64_ns),
		cmocka_unit_test(extremes_and_sum_are_kept),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
