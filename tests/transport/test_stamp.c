/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Wall clock stamps on the monotonic clock, whatever is done to the wall clock. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "daemon/transport/stamp.h"

#define SECOND	UINT64_C(1000000000)
#define HOUR	(3600 * SECOND)
#define WALL	(UINT64_C(1700000000) * SECOND)

/* A reading at `mono`, when the wall clock shows `mono + ahead`. */
static void read_at(struct stamp *s, uint64_t mono, uint64_t ahead)
{
	stamp_sample(s, mono, mono + 20 + ahead, mono + 40);
}

static void stamp_is_converted(void **state)
{
	struct stamp s = { 0 };

	(void)state;
	read_at(&s, SECOND, WALL);
	read_at(&s, 2 * SECOND, WALL);
	assert_int_equal(stamp_convert(&s, WALL + 2 * SECOND - 5000, 2 * SECOND + 40),
			 2 * SECOND - 5000);
}

static void monotonic_clock_may_be_ahead_of_the_wall_clock(void **state)
{
	struct stamp s = { 0 };

	(void)state;
	/* a machine without a battery: it is 1970, and has been up for a day */
	read_at(&s, 24 * HOUR, 0 - 23 * HOUR);
	assert_int_equal(stamp_convert(&s, HOUR + 100, 24 * HOUR + 1000), 24 * HOUR + 100);
}

static void stamp_before_the_first_reading_is_unknown(void **state)
{
	struct stamp s = { 0 };

	(void)state;
	assert_int_equal(stamp_convert(&s, WALL, SECOND), 0);
	read_at(&s, 5 * SECOND, WALL);
	assert_int_equal(stamp_convert(&s, WALL + 4 * SECOND, 5 * SECOND + 40), 0);
}

static void stamp_slightly_in_the_future_is_now(void **state)
{
	struct stamp s = { 0 };

	(void)state;
	read_at(&s, SECOND, WALL);
	assert_int_equal(stamp_convert(&s, WALL + SECOND + 5000, SECOND + 40), SECOND + 40);
	assert_int_equal(stamp_convert(&s, WALL + SECOND + 100000, SECOND + 40), 0);
}

static void wall_clock_set_by_an_hour_spoils_no_time(void **state)
{
	(void)state;
	for (int forward = 0; forward <= 1; forward++) {
		uint64_t after = forward ? WALL + HOUR : WALL - HOUR;
		struct stamp s = { 0 };

		read_at(&s, 10 * HOUR, WALL);
		/* stamped before the step, converted after it: unknown, not wrong */
		read_at(&s, 10 * HOUR + 1000, after);
		assert_int_equal(stamp_convert(&s, WALL + 10 * HOUR + 500, 10 * HOUR + 1040), 0);
		/* stamped after the step, converted before it was noticed: unknown */
		read_at(&s, 10 * HOUR, WALL);
		assert_int_equal(stamp_convert(&s, after + 10 * HOUR + 500, 10 * HOUR + 1040), 0);
		/* both after it: right again */
		read_at(&s, 10 * HOUR + 2000, after);
		read_at(&s, 10 * HOUR + 9000, after);
		assert_int_equal(stamp_convert(&s, after + 10 * HOUR + 5000, 10 * HOUR + 9040),
				 10 * HOUR + 5000);
	}
}

static void loose_reading_changes_nothing(void **state)
{
	struct stamp s = { 0 };

	(void)state;
	read_at(&s, SECOND, WALL);
	/* preempted for a millisecond between the two clocks */
	stamp_sample(&s, 2 * SECOND, WALL + 2 * SECOND, 2 * SECOND + 1000000);
	assert_int_equal(stamp_convert(&s, WALL + 2 * SECOND, 2 * SECOND + 1000000), 0);
	read_at(&s, 3 * SECOND, WALL);
	assert_int_equal(stamp_convert(&s, WALL + 2 * SECOND + 7, 3 * SECOND), 2 * SECOND + 7);
}

/*
 * Random steps of the wall clock at random moments; what is converted is
 * right to 50 us, or unknown. Never anything else.
 */
static void random_steps_give_right_or_unknown(void **state)
{
	const char *given = getenv("POKEYS_SEED");
	unsigned int seed = (unsigned int)(given ? strtoul(given, NULL, 0) :
						   (unsigned long)time(NULL));
	uint64_t mono = 100 * HOUR, ahead = WALL, known = 0;
	struct stamp s = { 0 };

	(void)state;
	printf("seed %u\n", seed);
	read_at(&s, mono, ahead);
	for (int i = 0; i < 200000; i++) {
		uint64_t arrived, stamp, told;
		bool step = rand_r(&seed) % 50 == 0;

		mono += 100 + (uint64_t)rand_r(&seed) % 1000000;
		arrived = mono;
		stamp = arrived + ahead;
		mono += 100 + (uint64_t)rand_r(&seed) % 100000;
		/* between stamping and reading, by more than any packet waits here */
		if (step)
			ahead += (uint64_t)(rand_r(&seed) % 2 ? 1 : -1) *
				 (SECOND + (uint64_t)rand_r(&seed) % HOUR);
		read_at(&s, mono, ahead);
		told = stamp_convert(&s, stamp, mono + 40);
		if (told) {
			known++;
			assert_true(told + 50000 >= arrived && told <= arrived + 50000);
		} else {
			assert_true(step);
		}
	}
	assert_true(known > 150000);
}

static void reading_the_clocks_gives_monotonic_now(void **state)
{
	struct stamp s = { 0 };
	uint64_t before = stamp_now(), now = stamp_read(&s);

	(void)state;
	assert_true(now >= before && now <= stamp_now());
	assert_true(s.known || !s.fresh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(stamp_is_converted),
		cmocka_unit_test(monotonic_clock_may_be_ahead_of_the_wall_clock),
		cmocka_unit_test(stamp_before_the_first_reading_is_unknown),
		cmocka_unit_test(stamp_slightly_in_the_future_is_now),
		cmocka_unit_test(wall_clock_set_by_an_hour_spoils_no_time),
		cmocka_unit_test(loose_reading_changes_nothing),
		cmocka_unit_test(random_steps_give_right_or_unknown),
		cmocka_unit_test(reading_the_clocks_gives_monotonic_now),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
