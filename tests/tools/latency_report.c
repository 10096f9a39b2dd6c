// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What is shown of histograms: the part between two readings, tables, pictures.
 * A kernel may call itself anything, and a picture has to stay a picture; what
 * has no samples has no number.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <pokeys/shm.h>
#include "tools/latency.h"

static void add(struct pokeys_histogram *histogram, uint64_t ns)
{
	histogram->bucket[pokeys_histogram_bucket(ns)]++;
	histogram->sum_ns += ns;
	if (!histogram->count++ || ns < histogram->min_ns)
		histogram->min_ns = ns;
	if (ns > histogram->max_ns)
		histogram->max_ns = ns;
}

static void only_what_came_in_between_is_counted(void **state)
{
	struct pokeys_histogram before = { 0 }, after, part;

	(void)state;
	add(&before, 100);
	add(&before, 50000000);
	after = before;
	add(&after, 3000);
	add(&after, 20000);
	latency_since(&before, &after, &part);
	assert_int_equal(part.count, 2);
	assert_int_equal(part.sum_ns, 23000);
	assert_int_equal(part.bucket[pokeys_histogram_bucket(50000000)], 0);
	assert_true(part.min_ns <= 3000 && part.min_ns > 2400);
	assert_true(part.max_ns >= 20000 && part.max_ns < 25000);
}

static void a_new_extreme_is_exact(void **state)
{
	struct pokeys_histogram before = { 0 }, after, part;

	(void)state;
	add(&before, 10000);
	after = before;
	add(&after, 12345678);
	add(&after, 77);
	latency_since(&before, &after, &part);
	assert_int_equal(part.max_ns, 12345678);
	assert_int_equal(part.min_ns, 77);
}

/* The least of all was 79: nothing of it can have been quicker, whatever the bucket begins with. */
static void the_least_of_a_part_is_not_below_that_of_the_whole(void **state)
{
	struct pokeys_histogram before = { 0 }, after, part;

	(void)state;
	add(&before, 79);
	after = before;
	add(&after, 79);
	latency_since(&before, &after, &part);
	assert_int_equal(part.min_ns, 79);
	assert_int_equal(part.max_ns, 79);
}

static void nothing_in_between_is_nothing(void **state)
{
	struct pokeys_histogram before = { 0 }, part;

	(void)state;
	add(&before, 10000);
	latency_since(&before, &before, &part);
	assert_int_equal(part.count, 0);
	assert_int_equal(part.min_ns, 0);
	assert_int_equal(part.max_ns, 0);
}

static void another_daemon_counts_from_zero(void **state)
{
	struct pokeys_histogram before = { 0 }, after = { 0 }, part;

	(void)state;
	add(&before, 10000);
	add(&before, 10000);
	add(&after, 500);
	latency_since(&before, &after, &part);
	assert_int_equal(part.count, 1);
	assert_int_equal(part.max_ns, 500);
	add(&after, 500);
	add(&after, 500);
	latency_since(&before, &after, &part); /* it has counted more meanwhile */
	assert_int_equal(part.count, 3);
	assert_int_equal(part.sum_ns, 1500);
	assert_int_equal(part.bucket[pokeys_histogram_bucket(10000)], 0);
}

/* Everything that can be odd: nothing measured, the last bucket, one sample. */
static void odd(struct latency_run *run)
{
	*run = (struct latency_run){
		.kernel = "6.<&>\"\x1b\xff",
		.is_virtual = -1,
		.seconds = 1,
		.period_ns = 1000000,
		.note = "a \"note\"",
		.count = 3,
		.series = { { .title = "one", .cpu = 1 },
			    { .title = "late<", .cpu = 0 },
			    { .title = "none", .cpu = -1 } },
	};
	add(&run->series[0].histogram, 0);
	add(&run->series[1].histogram, UINT64_MAX / 2);
	add(&run->series[1].histogram, 64);
}

static void what_was_not_measured_has_no_number(void **state)
{
	struct latency_run run;
	char *text;
	size_t length;
	FILE *to = open_memstream(&text, &length);

	(void)state;
	odd(&run);
	latency_print(&run, to);
	fclose(to);
	assert_non_null(strstr(text, "NOT REALTIME"));
	assert_non_null(strstr(text, "perhaps a virtual machine"));
	assert_non_null(strstr(strstr(text, "\nmedian"), " - "));
	assert_null(strstr(text, "nan"));
	free(text);
}

/* For a test in another language: the picture, or the document. */
static int print(const char *what)
{
	struct latency_run run;

	odd(&run);
	if (!strcmp(what, "--svg"))
		latency_plot(&run, stdout);
	else
		latency_print_json(&run, stdout);
	return ferror(stdout) ? 1 : 0;
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(only_what_came_in_between_is_counted),
		cmocka_unit_test(a_new_extreme_is_exact),
		cmocka_unit_test(the_least_of_a_part_is_not_below_that_of_the_whole),
		cmocka_unit_test(nothing_in_between_is_nothing),
		cmocka_unit_test(another_daemon_counts_from_zero),
		cmocka_unit_test(what_was_not_measured_has_no_number),
	};

	if (argc > 1)
		return print(argv[1]);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
