/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The age of data, by the rule of <pokeys/state.h> that the daemon, HAL, pokeysctl and
 * monitors share. Data that never came and time stamps in the future must never count as
 * fresh, whether the machine was started a moment ago or has run for years.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <pokeys/state.h>

#define SECOND UINT64_C(1000000000)

static const uint64_t moments[] = { 1, SECOND, 7199 * SECOND, SECOND * 86400 * 365 * 100 };
enum { MOMENTS = sizeof(moments) / sizeof(moments[0]) };

static void an_age_is_the_time_since(void **state)
{
	(void)state;
	for (int i = 0; i < MOMENTS; i++) {
		assert_true(pokeys_age_ns(moments[i], moments[i]) == 0);
		assert_true(pokeys_age_ns(moments[i], moments[i] + 2 * SECOND) == 2 * SECOND);
	}
	assert_true(pokeys_age_ns(1, UINT64_MAX) == UINT64_MAX - 1);
}

static void what_never_came_has_no_age(void **state)
{
	(void)state;
	for (int i = 0; i < MOMENTS; i++)
		assert_true(pokeys_age_ns(0, moments[i]) == POKEYS_NEVER);
}

static void a_little_ahead_is_now_and_more_is_never(void **state)
{
	(void)state;
	for (int i = 0; i < MOMENTS; i++) {
		uint64_t now = moments[i], ahead = now + POKEYS_AHEAD_MOST_NS;

		assert_true(pokeys_age_ns(now + 1, now) == 0);
		assert_true(pokeys_age_ns(ahead, now) == 0);
		assert_true(pokeys_age_ns(ahead + 1, now) == POKEYS_NEVER);
		assert_true(pokeys_age_ns(now + 7200 * SECOND, now) == POKEYS_NEVER);
		assert_true(pokeys_age_ns(UINT64_MAX, now) == POKEYS_NEVER);
	}
	/* the sum does not wrap */
	assert_true(pokeys_age_ns(UINT64_MAX, UINT64_MAX - 5) == 0);
}

static void data_are_as_old_as_the_older_half(void **unused)
{
	struct pokeys_state state = { .t_digital_ns = 9 * SECOND, .t_motion_ns = 8 * SECOND };
	const uint64_t now = 10 * SECOND;

	(void)unused;
	assert_true(pokeys_state_age_ns(&state, now) == SECOND); /* it has no axes */
	state.capability.pulse_engine = 2;
	assert_true(pokeys_state_age_ns(&state, now) == 2 * SECOND);
	state.t_digital_ns = 7 * SECOND;
	assert_true(pokeys_state_age_ns(&state, now) == 3 * SECOND);
}

/* Inputs that are fresh must not hide positions that are not, nor the other way round. */
static void one_half_that_never_came_or_lies_ahead_is_never(void **unused)
{
	static const uint64_t bad[] = { 0, 3600 * SECOND, UINT64_MAX };
	const uint64_t now = 10 * SECOND;

	(void)unused;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		struct pokeys_state state = { .t_digital_ns = now, .t_motion_ns = bad[i] };

		assert_true(pokeys_state_age_ns(&state, now) == 0);
		state.capability.pulse_engine = 2;
		assert_true(pokeys_state_age_ns(&state, now) == POKEYS_NEVER);
		state.t_digital_ns = bad[i];
		state.t_motion_ns = now;
		assert_true(pokeys_state_age_ns(&state, now) == POKEYS_NEVER);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_age_is_the_time_since),
		cmocka_unit_test(what_never_came_has_no_age),
		cmocka_unit_test(a_little_ahead_is_now_and_more_is_never),
		cmocka_unit_test(data_are_as_old_as_the_older_half),
		cmocka_unit_test(one_half_that_never_came_or_lies_ahead_is_never),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
