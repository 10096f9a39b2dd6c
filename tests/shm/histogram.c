/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Buckets of the histograms: where they begin, that they are a quarter octave
 * wide, and what percentiles say.
 */
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <stdlib.h>
#include <cmocka.h>
#include <pokeys/shm.h>

static void add(struct pokeys_histogram *histogram, uint64_t ns, uint32_t times)
{
	if (!histogram->count || ns < histogram->min_ns)
		histogram->min_ns = ns;
	if (ns > histogram->max_ns)
		histogram->max_ns = ns;
	histogram->count += times;
	histogram->sum_ns += ns * times;
	histogram->bucket[pokeys_histogram_bucket(ns)] += times;
}

static void first_bucket_takes_all_below_64_ns(void **state)
{
	(void)state;
	assert_int_equal(pokeys_histogram_bucket(0), 0);
	assert_int_equal(pokeys_histogram_bucket(63), 0);
	assert_int_equal(pokeys_histogram_bucket(64), 1);
	assert_int_equal(pokeys_histogram_bucket(79), 1);
	assert_int_equal(pokeys_histogram_bucket(80), 2);
	assert_int_equal(pokeys_histogram_bucket(127), 4);
	assert_int_equal(pokeys_histogram_bucket(128), 5);
}

static void last_bucket_takes_all_above(void **state)
{
	(void)state;
	assert_int_equal(pokeys_histogram_bucket(UINT64_MAX), POKEYS_HISTOGRAM_BUCKETS - 1);
	assert_int_equal(pokeys_histogram_bucket(UINT64_C(4000000000)),
			 POKEYS_HISTOGRAM_BUCKETS - 1);
}

static void lower_bound_is_the_first_of_its_bucket(void **state)
{
	(void)state;
	for (unsigned int bucket = 1; bucket < POKEYS_HISTOGRAM_BUCKETS; bucket++) {
		uint64_t lower = pokeys_histogram_lower(bucket);

		assert_int_equal(pokeys_histogram_bucket(lower), bucket);
		assert_int_equal(pokeys_histogram_bucket(lower - 1), bucket - 1);
	}
	assert_int_equal(pokeys_histogram_lower(0), 0);
	assert_int_equal(pokeys_histogram_lower(10000),
			 pokeys_histogram_lower(POKEYS_HISTOGRAM_BUCKETS - 1));
}

static void a_bucket_is_at_most_a_quarter_wide(void **state)
{
	(void)state;
	for (unsigned int bucket = 1; bucket + 1 < POKEYS_HISTOGRAM_BUCKETS; bucket++) {
		uint64_t lower = pokeys_histogram_lower(bucket);

		assert_true(pokeys_histogram_lower(bucket + 1) - lower <= lower / 4);
	}
}

static void nothing_has_no_percentile(void **state)
{
	struct pokeys_histogram histogram = { 0 };

	(void)state;
	assert_int_equal(pokeys_histogram_percentile(&histogram, 0.5), 0);
}

static void percentile_is_within_a_bucket_of_the_truth(void **state)
{
	struct pokeys_histogram histogram = { 0 };

	(void)state;
	add(&histogram, 1000, 90);
	add(&histogram, 100000, 9);
	add(&histogram, 5000000, 1);
	assert_int_equal(pokeys_histogram_percentile(&histogram, 0), 1000);
	assert_in_range(pokeys_histogram_percentile(&histogram, 0.001), 1000, 1250);
	assert_in_range(pokeys_histogram_percentile(&histogram, 0.5), 1000, 1250);
	assert_in_range(pokeys_histogram_percentile(&histogram, 0.95), 100000, 125000);
	assert_in_range(pokeys_histogram_percentile(&histogram, 0.99), 100000, 125000);
	assert_int_equal(pokeys_histogram_percentile(&histogram, 0.999), 5000000);
	assert_int_equal(pokeys_histogram_percentile(&histogram, 1), 5000000);
}

/* At least the part that was asked for lies below, and no sample more than that takes. */
static void percentile_counts_the_one_that_completes_the_part(void **state)
{
	static const struct {
		double p;
		uint32_t quick; /* of 100 ns, and behind them one of 1 ms */
		bool late;      /* the late one is needed for the part */
	} cases[] = {
		{ 0.999, 500, true }, { 0.999, 998, true }, { 0.999, 999, false },
		{ 0.99, 159, false }, { 0.99, 98, true },   { 0.99, 99, false },
		{ 0.07, 99, false },  { 0.5, 1, false },    { 0.5, 0, true },
		{ 0.999, 0, true },   { 0.75, 3, false },   { 0.76, 3, true },
		{ 1e-9, 3, false },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(cases) / sizeof(*cases); i++) {
		struct pokeys_histogram histogram = { 0 };

		add(&histogram, 100, cases[i].quick);
		add(&histogram, 1000000, 1);
		assert_int_equal(pokeys_histogram_percentile(&histogram, cases[i].p) > 112,
				 cases[i].late);
	}
}

static void percentile_is_never_above_the_largest(void **state)
{
	struct pokeys_histogram histogram = { 0 };

	(void)state;
	add(&histogram, UINT64_C(20000000000), 3);
	assert_int_equal(pokeys_histogram_percentile(&histogram, 0.5), UINT64_C(20000000000));
	add(&histogram, 10, 5);
	assert_int_equal(pokeys_histogram_percentile(&histogram, 0.5), 64);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(first_bucket_takes_all_below_64_ns),
		cmocka_unit_test(last_bucket_takes_all_above),
		cmocka_unit_test(lower_bound_is_the_first_of_its_bucket),
		cmocka_unit_test(a_bucket_is_at_most_a_quarter_wide),
		cmocka_unit_test(nothing_has_no_percentile),
		cmocka_unit_test(percentile_is_within_a_bucket_of_the_truth),
		cmocka_unit_test(percentile_counts_the_one_that_completes_the_part),
		cmocka_unit_test(percentile_is_never_above_the_largest),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
