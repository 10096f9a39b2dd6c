// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the daemon makes of the guard's file: one that is old, of another
 * interface, of the future, no file at all or garbage is as none.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/guarded.h"

#define SECOND UINT64_C(1000000000)
#define HEAD "interface eth1\nmode native\ntime_ns 5000000000\n"

static char folder[64], path[80];
static struct guarded guard;

static int setup(void **state)
{
	(void)state;
	strcpy(folder, "/tmp/pokeysd-guarded-XXXXXX");
	if (!mkdtemp(folder))
		return -1;
	snprintf(path, sizeof(path), "%s/status", folder);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	unlink(path);
	return rmdir(folder);
}

static bool on(const char *text, const char *interface, uint64_t now_ns)
{
	FILE *to = fopen(path, "w");

	assert_non_null(to);
	fputs(text, to);
	fclose(to);
	guarded_read(&guard, path, interface, now_ns);
	return guard.on;
}

static void a_fresh_file_of_our_interface_counts(void **state)
{
	(void)state;
	assert_true(on(HEAD "pass_arp 3\ndrop_foreign 18446744073709\npass_x 4\n", "eth1",
		       6 * SECOND));
	assert_string_equal(guard.mode, "native");
	assert_int_equal(guard.counters, 3);
	assert_int_equal(guard.passed, 7);
	assert_int_equal(guard.dropped, UINT64_C(18446744073709));
	assert_string_equal(guard.counter[1].name, "drop_foreign");
	assert_int_equal(guard.counter[1].value, UINT64_C(18446744073709));
}

static void another_interface_or_time_is_as_none(void **state)
{
	(void)state;
	assert_false(on(HEAD "pass_arp 3\n", "eth2", 6 * SECOND));
	assert_int_equal(guard.counters, 0);
	assert_false(on(HEAD, "", 6 * SECOND));
	assert_false(on(HEAD, "eth1", 8 * SECOND));
	assert_false(on(HEAD, "eth1", 4 * SECOND));
}

/* The guard writes whenever it likes, also after we have looked at the clock. */
static void one_that_was_written_since_is_fresh(void **state)
{
	(void)state;
	assert_true(on(HEAD, "eth1", 5 * SECOND - 1));
	assert_true(on(HEAD, "eth1", 5 * SECOND - SECOND / 4));
}

static void what_is_no_file_is_as_none(void **state)
{
	(void)state;
	guarded_read(&guard, path, "eth1", SECOND);
	assert_false(guard.on);
	assert_int_equal(mkfifo(path, 0600), 0);
	alarm(60); /* it did hold up */
	guarded_read(&guard, path, "eth1", SECOND);
	alarm(0);
	assert_false(guard.on);
}

static void garbage_gets_into_no_metric(void **state)
{
	char text[8192] = HEAD "bad\"name 1\nx\ndrop_a -1\ndrop_b 99999999999999999999\n"
			       "a_name_that_is_longer_than_any 1\ndrop_c 1 2\n";

	(void)state;
	assert_true(on(text, "eth1", 6 * SECOND));
	assert_int_equal(guard.counters, 0);
	for (int i = 0; i < 400; i++)
		strcat(text, "drop_d 1\n");
	assert_true(on(text, "eth1", 6 * SECOND));
	assert_int_equal(guard.counters, GUARDED_COUNTERS);
	assert_false(on("\n\n  \n interface\n", "eth1", 6 * SECOND));
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(a_fresh_file_of_our_interface_counts),
		TEST(another_interface_or_time_is_as_none),
		TEST(one_that_was_written_since_is_fresh),
		TEST(what_is_no_file_is_as_none),
		TEST(garbage_gets_into_no_metric),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
