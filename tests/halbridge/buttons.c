/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pins that are pressed: once per edge, never late, and the clock.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct values *const values = &rig.values;
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig_periods(&rig, 2);
	return 0;
}

static void acknowledge(uint32_t id, enum pokeys_outcome outcome)
{
	rig.daemon.one_shot_ack = id + 1;
	rig.daemon.one_shot[id % POKEYS_ONE_SHOT_RESULTS] = (struct pokeys_one_shot_result){
		.id = id,
		.operation = command->one_shot[id].operation,
		.outcome = (uint8_t)outcome,
	};
}

static void one_press_is_one_one_shot(void **state)
{
	(void)state;
	values->counter.reset = true;
	rig_periods(&rig, 5);
	assert_int_equal(command->one_shot_head, 1);
	acknowledge(0, POKEYS_OUTCOME_DONE);
	rig_periods(&rig, 5);
	values->counter.reset = false;
	rig_period(&rig);
	values->counter.reset = true;
	rig_periods(&rig, 5);
	assert_int_equal(command->one_shot_head, 2);
	assert_int_equal(values->one_shot_failed_count, 0);
}

/* A button that hangs, or is wired the wrong way round, must not wear the flash out. */
static void a_pin_that_is_true_from_the_start_is_no_press(void **state)
{
	(void)state;
	rig_init(&rig);
	values->diagnostics.config_save = true;
	rig_periods(&rig, 5);
	assert_true(values->connected);
	assert_int_equal(command->one_shot_head, 0);
	values->diagnostics.config_save = false;
	rig_period(&rig);
	values->diagnostics.config_save = true;
	rig_period(&rig);
	assert_int_equal(command->one_shot_head, 1);
}

static void a_press_while_the_device_is_away_is_not_kept(void **state)
{
	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 10);
	values->counter.reset = true;
	rig_periods(&rig, 3);
	rig.device_silent = false;
	rig_periods(&rig, 10);
	assert_true(values->connected);
	assert_int_equal(command->one_shot_head, 0);
	assert_int_equal(values->one_shot_failed_count, 1);
}

/* Beginning and end: a wheel must not be let go for ever. */
static void wheels_go_while_the_pin_is_true(void **state)
{
	(void)state;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 0);
	values->engine.mpg_jog = true;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(command->one_shot[0].operation, POKEYS_ONE_SHOT_JOG);
	values->engine.mpg_jog = false;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 2);
	assert_int_equal(command->one_shot[1].operation, POKEYS_ONE_SHOT_JOG_END);
}

/* The daemon is there, and a moment without fresh data is nothing rare. */
static void a_wheel_let_go_while_data_are_stale_is_let_go(void **state)
{
	(void)state;
	values->engine.mpg_jog = true;
	rig_periods(&rig, 3);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_false(values->connected);
	values->engine.mpg_jog = false;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 1);
	rig.device_silent = false;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 2);
	assert_int_equal(command->one_shot[1].operation, POKEYS_ONE_SHOT_JOG_END);
	assert_int_equal(values->one_shot_failed_count, 0);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	rig.device_silent = false;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 2); /* once */
}

/* As a HAL file has it that asks for machine-on-permitted as well. */
static void a_wheel_goes_on_whose_pin_falls_with_fresh_data(void **state)
{
	(void)state;
	values->engine.mpg_jog = true;
	rig_periods(&rig, 3);
	rig.device_silent = true;
	for (unsigned int i = 0; i < 20; i++) {
		rig_period(&rig);
		values->engine.mpg_jog = values->connected;
	}
	assert_false(values->engine.mpg_jog);
	rig.device_silent = false;
	for (unsigned int i = 0; i < 5; i++) {
		rig_period(&rig);
		values->engine.mpg_jog = values->connected;
	}
	for (unsigned int i = 0; i < command->one_shot_head; i++)
		assert_int_equal(command->one_shot[i].operation, POKEYS_ONE_SHOT_JOG);
}

static void a_press_that_another_daemon_finds_is_not_repeated(void **state)
{
	(void)state;
	values->engine.clear_fault = true;
	rig_periods(&rig, 2);
	rig.daemon.epoch++;
	rig.daemon.one_shot_ack = 0;
	rig_periods(&rig, 5);
	assert_int_equal(command->one_shot_head, 0);
	assert_int_equal(values->one_shot_failed_count, 1);
}

static void a_press_that_fails_is_counted(void **state)
{
	(void)state;
	values->diagnostics.config_save = true;
	rig_period(&rig);
	acknowledge(0, POKEYS_OUTCOME_REFUSED);
	rig_periods(&rig, 3);
	assert_int_equal(values->one_shot_failed_count, 1);
}

static void date(uint32_t year, uint32_t month, uint32_t day)
{
	values->rtc.set_year = year;
	values->rtc.set_month = month;
	values->rtc.set_day = day;
}

static const int32_t *clock_set(uint32_t year, uint32_t month, uint32_t day)
{
	date(year, month, day);
	values->rtc.set_hour = 13;
	values->rtc.set_minute = 59;
	values->rtc.set_second = 7;
	values->rtc.set = false;
	rig_period(&rig);
	values->rtc.set = true;
	rig_period(&rig);
	return command->one_shot[command->one_shot_head - 1].value;
}

static void the_clock_is_set_with_the_days_that_follow_from_the_date(void **state)
{
	const int32_t *value;

	(void)state;
	value = clock_set(2026, 11, 21); /* a Saturday, day 325 */
	assert_int_equal(command->one_shot[0].operation, POKEYS_ONE_SHOT_SET_RTC);
	assert_true(value[0] == 2026 && value[1] == 11 && value[2] == 21);
	assert_true(value[3] == 13 && value[4] == 59 && value[5] == 7);
	assert_true(value[6] == 6 && value[7] == 325);
	acknowledge(0, POKEYS_OUTCOME_DONE);
	rig_period(&rig);
	assert_int_equal(values->rtc.set_outcome, POKEYS_OUTCOME_DONE);
	value = clock_set(2000, 2, 29); /* a Tuesday, day 60 */
	assert_true(value[6] == 2 && value[7] == 60);
	value = clock_set(2028, 12, 31); /* a Sunday, day 366 */
	assert_true(value[6] == 0 && value[7] == 366);
	value = clock_set(2099, 1, 1); /* a Thursday */
	assert_true(value[6] == 4 && value[7] == 1);
}

static void a_date_that_is_none_is_refused(void **state)
{
	static const uint32_t dates[][3] = {
		{ 2026, 2, 29 }, { 2026, 13, 1 },
		{ 2026, 0, 1 },  { 1999, 1, 1 },
		{ 2026, 4, 31 }, { 2026, 4, 0 },
		{ 2100, 1, 1 },  { UINT32_MAX, UINT32_MAX, UINT32_MAX },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(dates) / sizeof(dates[0]); i++) {
		clock_set(dates[i][0], dates[i][1], dates[i][2]);
		rig_period(&rig);
		assert_int_equal(command->one_shot_head, 0);
		assert_int_equal(values->rtc.set_outcome, POKEYS_OUTCOME_REFUSED);
		assert_int_equal(values->input_refused_count, i + 1);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(one_press_is_one_one_shot, setup),
		cmocka_unit_test_setup(a_pin_that_is_true_from_the_start_is_no_press, setup),
		cmocka_unit_test_setup(a_press_while_the_device_is_away_is_not_kept, setup),
		cmocka_unit_test_setup(wheels_go_while_the_pin_is_true, setup),
		cmocka_unit_test_setup(a_wheel_let_go_while_data_are_stale_is_let_go, setup),
		cmocka_unit_test_setup(a_wheel_goes_on_whose_pin_falls_with_fresh_data, setup),
		cmocka_unit_test_setup(a_press_that_another_daemon_finds_is_not_repeated, setup),
		cmocka_unit_test_setup(a_press_that_fails_is_counted, setup),
		cmocka_unit_test_setup(the_clock_is_set_with_the_days_that_follow_from_the_date,
				       setup),
		cmocka_unit_test_setup(a_date_that_is_none_is_refused, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
