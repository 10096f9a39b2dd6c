// SPDX-License-Identifier: GPL-2.0-or-later
/* Signs of life come from cycles, not from time passing. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include "daemon/control/watchdog.h"

#define MS UINT64_C(1000000)

/* Signs given in `ms` milliseconds, looked at every 20, cycles at 1 kHz or standing. */
static int signs(struct watchdog *watchdog, uint64_t *now, uint64_t *cycles, int ms, int advance)
{
	int count = 0;

	for (int i = 0; i < ms; i += 20) {
		*now += 20 * MS;
		*cycles += advance ? 20 : 0;
		count += watchdog_due(watchdog, *cycles, *now);
	}
	return count;
}

static void a_running_loop_gives_four_signs_in_the_time_of_one(void **state)
{
	struct watchdog watchdog;
	uint64_t now = 12345 * MS, cycles = 3;

	(void)state;
	watchdog_init(&watchdog, 2000 * MS, 0, now);
	assert_int_equal(signs(&watchdog, &now, &cycles, 10000, 1), 20);
}

static void a_standing_loop_gives_none(void **state)
{
	struct watchdog watchdog;
	uint64_t now = 12345 * MS, cycles = 3;

	(void)state;
	watchdog_init(&watchdog, 2000 * MS, 0, now);
	assert_true(signs(&watchdog, &now, &cycles, 1000, 1) > 0);
	assert_int_equal(signs(&watchdog, &now, &cycles, 60000, 0), 0);
}

static void the_first_cycle_after_a_stall_gives_one_at_once(void **state)
{
	struct watchdog watchdog;
	uint64_t now = 12345 * MS, cycles = 3;

	(void)state;
	watchdog_init(&watchdog, 2000 * MS, 0, now);
	signs(&watchdog, &now, &cycles, 1000, 1);
	signs(&watchdog, &now, &cycles, 1900, 0);
	assert_int_equal(signs(&watchdog, &now, &cycles, 20, 1), 1);
}

static void a_loop_that_never_ran_gives_none(void **state)
{
	struct watchdog watchdog;
	uint64_t now = 0, cycles = 0;

	(void)state;
	watchdog_init(&watchdog, 2000 * MS, 0, now);
	assert_int_equal(signs(&watchdog, &now, &cycles, 10000, 0), 0);
}

static void nobody_watching_gets_none(void **state)
{
	struct watchdog watchdog;
	uint64_t now = 0, cycles = 0;

	(void)state;
	watchdog_init(&watchdog, 0, 0, now);
	assert_int_equal(signs(&watchdog, &now, &cycles, 10000, 1), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_running_loop_gives_four_signs_in_the_time_of_one),
		cmocka_unit_test(a_standing_loop_gives_none),
		cmocka_unit_test(the_first_cycle_after_a_stall_gives_one_at_once),
		cmocka_unit_test(a_loop_that_never_ran_gives_none),
		cmocka_unit_test(nobody_watching_gets_none),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
