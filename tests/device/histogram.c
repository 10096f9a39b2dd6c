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
	struct pokeys_histogram h;

	(void)state;
	memset(&h, 0, sizeof(h));
	histogram_add(&h, 63);
	assert_int_equal(h.bucket[0], 1);
	for (unsigned int i = 1; i < POKEYS_HISTOGRAM_BUCKETS; i++) {
		const uint64_t octave = UINT64_C(64) << (i - 1) / 4;
		const uint64_t from = octave + octave / 4 * ((i - 1) % 4);

		histogram_add(&h, from);
		histogram_add(&h, from + octave / 4 - 1);
		assert_int_equal(h.bucket[i], 2);
	}
	histogram_add(&h, UINT64_MAX);
	assert_int_equal(h.bucket[POKEYS_HISTOGRAM_BUCKETS - 1], 3);
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
	assert_int_equal(h.bucket[pokeys_duration_bucket(500)], 1);
}

/* Six days of a cycle at 4 kHz are more than 32 bits hold. */
static void no_bucket_begins_again(void **state)
{
	const uint64_t most = UINT32_MAX;
	const unsigned int here = pokeys_duration_bucket(500);
	struct pokeys_histogram h;

	(void)state;
	memset(&h, 0, sizeof(h));
	histogram_add(&h, 500);
	h.count = h.bucket[here] = most;
	histogram_add(&h, 500);
	assert_true(h.bucket[here] == most + 1);
	assert_true(h.count == most + 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(buckets_are_quarter_octaves_from_64_ns),
		cmocka_unit_test(extremes_and_sum_are_kept),
		cmocka_unit_test(no_bucket_begins_again),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
