/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Heaters by pins: which targets reach the daemon, which are complained about, and what a reset
 * asks for. Each pin by itself is in every_in_pin and every_out_pin.
 */
#include "tests/halbridge/rig.h"

enum { BED = 1 };

static struct rig rig;
static struct value_heater *const bed = &rig.values.heater[BED];
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig.daemon.heater[BED].state = POKEYS_HEATER_OFF;
	rig_periods(&rig, 2);
	return 0;
}

static void only_heaters_that_there_are_are_commanded(void **state)
{
	(void)state;
	assert_int_equal(command->heater_mask, 1u << BED);
	bed->target = 60;
	rig_period(&rig);
	assert_true(command->heater_target[BED] == 60);
	assert_false(rig.values.input_refused);
	rig.values.heater[0].target = 60;
	rig_period(&rig);
	assert_int_equal(command->heater_mask, 1u << BED);
	assert_true(command->heater_target[0] == 0);
	assert_true(rig.values.input_refused);
	rig_expect_note(&rig, TABLE_HEATERS,
			"pokeys.0.heater.00.target = 60: has no effect: pokeysd.conf has no such "
			"heater");
	/* of the next daemon, too */
	rig.daemon.epoch++;
	rig.daemon.heater[BED].state = POKEYS_HEATER_NONE;
	rig_periods(&rig, 3);
	assert_int_equal(command->heater_mask, 0);
	assert_true(command->heater_target[BED] == 0);
	rig_expect_note(&rig, TABLE_HEATERS, "pokeys.0.heater.01.target");
}

static void a_target_that_is_no_number_is_off(void **state)
{
	(void)state;
	bed->target = 60;
	rig_period(&rig);
	bed->target = (double)NAN;
	rig_period(&rig);
	assert_true(command->heater_target[BED] == 0);
	assert_int_equal(command->heater_mask, 0);
	assert_true(rig.values.input_refused);
	rig_expect_note(&rig, TABLE_HEATERS,
			"not a finite number; the heater is off until 0 "
			"was commanded");
	bed->target = 61;
	rig_period(&rig);
	assert_int_equal(command->heater_mask, 1u << BED);
	assert_true(command->heater_target[BED] == 61);
	assert_false(rig.values.input_refused);
}

/* The fault of a heater whose device is silent is shown. */
static void a_silent_device_hides_no_fault_and_a_dead_daemon_shows_none(void **state)
{
	(void)state;
	bed->target = 60;
	rig_periods(&rig, 2);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_false(rig.values.connected);
	rig.daemon.heater[BED].fault = POKEYS_HEATER_DEVICE;
	rig_periods(&rig, 2);
	assert_true(bed->fault);
	assert_true(command->heater_target[BED] == 60);
	assert_int_equal(command->heater_mask, 1u << BED);
	rig.daemon_dead = true;
	rig_periods(&rig, 200);
	rig.daemon.heater[BED].fault = POKEYS_HEATER_FINE;
	rig_periods(&rig, 20);
	assert_true(bed->fault);
	assert_false(rig.values.daemon_alive);
}

static void a_fault_is_a_bit_and_a_code_and_is_reset_once(void **state)
{
	(void)state;
	rig.daemon.heater[BED].state = POKEYS_HEATER_FAULT;
	rig.daemon.heater[BED].fault = POKEYS_HEATER_OPEN;
	rig_period(&rig);
	assert_true(bed->fault);
	assert_int_equal(bed->fault_code, POKEYS_HEATER_OPEN);
	bed->reset = true;
	rig_periods(&rig, 10);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(command->one_shot[0].operation, POKEYS_ONE_SHOT_HEATER_RESET);
	assert_int_equal(command->one_shot[0].index, BED);
	rig.daemon.one_shot[0] = (struct pokeys_one_shot_result){
		.operation = POKEYS_ONE_SHOT_HEATER_RESET,
		.outcome = POKEYS_OUTCOME_REFUSED,
	};
	rig.daemon.one_shot_ack = 1;
	rig_periods(&rig, 2);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
	/* and by a daemon that is gone, not at all */
	bed->reset = false;
	rig_period(&rig);
	bed->reset = true;
	rig_period(&rig);
	rig.daemon.epoch++;
	rig_periods(&rig, 2);
	assert_int_equal(rig.values.one_shot_failed_count, 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(only_heaters_that_there_are_are_commanded, setup),
		cmocka_unit_test_setup(a_target_that_is_no_number_is_off, setup),
		cmocka_unit_test_setup(a_silent_device_hides_no_fault_and_a_dead_daemon_shows_none,
				       setup),
		cmocka_unit_test_setup(a_fault_is_a_bit_and_a_code_and_is_reset_once, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
