/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Two threads are told when they last, once, and only if both functs really run.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "halbridge/callers.h"

enum { A = 0x1000, B = 0x2000 };

static struct callers callers;
static struct callers_seen now;

static int setup(void **state)
{
	(void)state;
	memset(&callers, 0, sizeof(callers));
	memset(&now, 0, sizeof(now));
	return 0;
}

static enum callers_news look(uintptr_t reader, uintptr_t writer, uint32_t reads, uint32_t writes)
{
	now = (struct callers_seen){ reader, writer, now.reads + reads, now.writes + writes };
	return callers_look(&callers, &now);
}

static void one_thread_is_as_it_should_be(void **state)
{
	(void)state;
	assert_false(look(0, 0, 0, 0));
	for (int i = 0; i < 100; i++)
		assert_false(look(A, A, 200, 200));
}

static void two_threads_are_told_once(void **state)
{
	(void)state;
	assert_false(look(A, B, 200, 200));
	assert_int_equal(look(A, B, 200, 200), CALLERS_TWO_THREADS);
	for (int i = 0; i < 100; i++)
		assert_false(look(A, B, 200, 200));
}

static void and_again_when_it_was_mended_in_between(void **state)
{
	(void)state;
	look(A, B, 200, 200);
	assert_true(look(A, B, 200, 200));
	assert_false(look(A, A, 200, 200));
	assert_false(look(B, A, 200, 200));
	assert_true(look(B, A, 200, 200));
}

static void who_moves_them_one_by_one_hears_nothing(void **state)
{
	(void)state;
	for (int i = 0; i < 10; i++) {
		assert_false(look(A, A, 200, 200));
		assert_false(look(A, B, 200, 200));
		assert_false(look(B, B, 200, 200));
		assert_false(look(B, A, 200, 200));
	}
}

static void one_that_does_not_run_does_not_count(void **state)
{
	(void)state;
	look(A, A, 200, 200);
	for (int i = 0; i < 100; i++)
		assert_false(look(B, A, 200, 0));
}

static void writing_without_reading_is_told_once(void **state)
{
	(void)state;
	look(A, A, 200, 200);
	assert_false(look(A, A, 0, 200));
	assert_int_equal(look(A, A, 0, 200), CALLERS_NO_READ);
	for (int i = 0; i < 100; i++)
		assert_false(look(A, A, 0, 200));
	assert_false(look(A, A, 200, 200));
	assert_false(look(A, A, 0, 200));
	assert_int_equal(look(A, A, 0, 200), CALLERS_NO_READ);
}

static void that_was_never_read_is_told_as_well(void **state)
{
	(void)state;
	assert_false(look(0, A, 0, 200));
	assert_int_equal(look(0, A, 0, 200), CALLERS_NO_READ);
}

static void a_thread_that_stands_still_is_not_told(void **state)
{
	(void)state;
	look(A, A, 200, 200);
	assert_false(look(A, A, 0, 100));
	for (int i = 0; i < 100; i++)
		assert_false(look(A, A, 0, 0));
}

static void a_slow_thread_counts_as_well(void **state)
{
	unsigned int told = 0;

	(void)state;
	for (int i = 0; i < 30; i++)
		told += look(A, B, 200, i % 10 == 0 ? 2 : 0) == CALLERS_TWO_THREADS;
	assert_int_equal(told, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(one_thread_is_as_it_should_be, setup),
		cmocka_unit_test_setup(two_threads_are_told_once, setup),
		cmocka_unit_test_setup(and_again_when_it_was_mended_in_between, setup),
		cmocka_unit_test_setup(who_moves_them_one_by_one_hears_nothing, setup),
		cmocka_unit_test_setup(one_that_does_not_run_does_not_count, setup),
		cmocka_unit_test_setup(writing_without_reading_is_told_once, setup),
		cmocka_unit_test_setup(that_was_never_read_is_told_as_well, setup),
		cmocka_unit_test_setup(a_thread_that_stands_still_is_not_told, setup),
		cmocka_unit_test_setup(a_slow_thread_counts_as_well, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
