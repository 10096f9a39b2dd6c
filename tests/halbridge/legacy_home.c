/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older scheme's homing, probing and whatever else is asked of the device once:
 * what is asked, what is told of it, and what becomes of it when nobody is there.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct value_legacy *const legacy = &rig.values.legacy;
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init_older(&rig);
	return 0;
}

static struct pokeys_one_shot *newest(void)
{
	return &command->one_shot[(command->one_shot_head - 1) % POKEYS_ONE_SHOTS];
}

static void answer(enum pokeys_outcome outcome)
{
	uint32_t id = command->one_shot_head - 1;

	rig.daemon.one_shot_ack = id + 1;
	rig.daemon.one_shot[id % POKEYS_ONE_SHOT_RESULTS] = (struct pokeys_one_shot_result){
		.id = id, .operation = newest()->operation, .outcome = (uint8_t)outcome
	};
	rig_period(&rig);
}

static void ask(uint32_t axes, uint32_t what)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (axes >> i & 1)
			legacy->axis[i].command = what;
	}
	rig_period(&rig);
}

static void homing_is_a_conversation(void **state)
{
	uint32_t head = command->one_shot_head;

	(void)state;
	rig_drive_older(&rig);
	legacy->axis_set[0].sequence = 1;
	legacy->axis_set[6].sequence = -1;
	legacy->axis_set[0].zero_position = 4000;
	legacy->axis_set[0].home_position = 4100;
	legacy->axis[0].index_enable = true;
	ask(0x41, LEGACY_HOME_START);
	assert_int_equal(command->one_shot_head, head + 1);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_HOME);
	assert_int_equal(newest()->mask, 0x41);
	assert_int_equal(command->axis[0].mode, POKEYS_AXIS_OFF);
	rig.daemon.engine.axis[0].state = 12;
	answer(POKEYS_OUTCOME_DONE);
	assert_int_equal(legacy->axis[0].state, 12);
	rig.daemon.engine.axis[0].state = rig.daemon.engine.axis[6].state = 10;
	rig_period(&rig);
	assert_int_equal(legacy->axis[0].state, 3);
	ask(0x41, LEGACY_HOME_FINALIZE);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_HOME_FINISH);
	assert_int_equal(newest()->mask, 0x41);
	rig.daemon.engine.axis[0].state = rig.daemon.engine.axis[6].state = 1;
	answer(POKEYS_OUTCOME_DONE);
	assert_int_equal(legacy->axis[0].state, 4);
	ask(0x01, LEGACY_HOME_ARM);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_SET_POSITION);
	assert_int_equal(newest()->value[0], 4000);
	assert_int_equal(legacy->axis[0].homing_status, 6);
	rig_period(&rig);
	assert_int_equal(legacy->axis[0].state, 17);
	answer(POKEYS_OUTCOME_DONE);
	assert_int_equal(legacy->axis[0].state, 18);
	assert_false(legacy->axis[0].index_enable);
	ask(0x01, LEGACY_HOME_FINAL);
	rig_period(&rig);
	assert_int_equal(legacy->axis[0].state, 19);
	assert_int_equal(command->axis[0].position, 4100);
	rig.daemon.engine.axis[0].position = 4100;
	rig_period(&rig);
	assert_int_equal(legacy->axis[0].state, 1);
}

static void a_group_waits_for_the_one_that_is_homed(void **state)
{
	uint64_t head = command->one_shot_head;

	(void)state;
	legacy->axis_set[0].sequence = 1;
	legacy->axis_set[1].sequence = 2;
	ask(0x01, LEGACY_HOME_START);
	ask(0x02, LEGACY_HOME_START);
	rig_periods(&rig, 20);
	assert_int_equal(command->one_shot_head, head + 1);
	assert_int_equal(newest()->mask, 0x01);
	assert_int_equal(legacy->axis[1].homing_status, LEGACY_HOME_IDLE);
	rig.daemon.engine.axis[0].state = 10;
	answer(POKEYS_OUTCOME_DONE);
	rig_periods(&rig, 5);
	assert_int_equal(command->one_shot_head, head + 1);
	ask(0x01, LEGACY_HOME_FINALIZE);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_HOME_FINISH);
	rig.daemon.engine.axis[0].state = 1;
	answer(POKEYS_OUTCOME_DONE);
	rig_periods(&rig, 3);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_HOME);
	assert_int_equal(newest()->mask, 0x02);
}

static void an_axis_that_homes_gets_no_reference_while_data_are_stale(void **state)
{
	(void)state;
	rig_drive_older(&rig);
	rig_period(&rig);
	assert_int_equal(command->axis[0].mode, POKEYS_AXIS_POSITION);
	ask(0x01, LEGACY_HOME_START);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_true(rig.values.stale);
	assert_int_equal(command->axis[0].mode, POKEYS_AXIS_OFF);
}

static void probing_tells_speed_and_input(void **state)
{
	(void)state;
	legacy->engine.probe_mask = 3;
	legacy->engine.probe_speed = 0.25;
	legacy->engine_set.probe_pin = 12;
	rig_period(&rig);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_PROBE);
	assert_int_equal(newest()->mask, 3);
	assert_int_equal(newest()->index, 20);
	assert_true(newest()->parameter[0] == 0);
	assert_true(newest()->parameter[1] == 0.25f);
	/* a terminal that is none must not become another input */
	legacy->engine.probe_mask = 3;
	legacy->engine_set.probe_pin = 250;
	rig_period(&rig);
	assert_int_equal(newest()->index, 0);
}

static void a_refused_homing_shows_an_error(void **state)
{
	(void)state;
	rig_drive_older(&rig);
	ask(0x01, LEGACY_HOME_START);
	answer(POKEYS_OUTCOME_REFUSED);
	assert_int_equal(legacy->axis[0].state, 20);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
	ask(0x01, LEGACY_HOME_IDLE);
	rig_period(&rig);
	assert_int_equal(legacy->axis[0].state, 0);
}

static void a_position_that_was_not_set_is_set_again(void **state)
{
	uint32_t head;

	(void)state;
	rig_drive_older(&rig);
	ask(0x01, LEGACY_HOME_START);
	answer(POKEYS_OUTCOME_DONE);
	ask(0x01, LEGACY_HOME_FINALIZE);
	answer(POKEYS_OUTCOME_DONE);
	ask(0x01, LEGACY_HOME_ARM);
	head = command->one_shot_head;
	answer(POKEYS_OUTCOME_FAILED);
	rig_period(&rig);
	assert_int_equal(command->one_shot_head, head + 1);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_SET_POSITION);
	answer(POKEYS_OUTCOME_DONE);
	assert_int_equal(legacy->axis[0].state, 18);
}

static void a_homing_ends_with_its_daemon(void **state)
{
	(void)state;
	rig_drive_older(&rig);
	ask(0x01, LEGACY_HOME_START);
	rig.daemon.epoch++;
	rig_periods(&rig, 2);
	assert_int_equal(legacy->axis[0].state, 20);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
}

static void a_cancelled_homing_is_told_to_the_device(void **state)
{
	(void)state;
	rig_drive_older(&rig);
	ask(0x01, LEGACY_HOME_START);
	answer(POKEYS_OUTCOME_DONE);
	ask(0x01, LEGACY_HOME_CANCEL);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_HOME_CANCEL);
	assert_int_equal(legacy->axis[0].homing_status, 1);
	rig_period(&rig);
	assert_int_equal(legacy->axis[0].homing_status, 0);
}

static void a_start_mask_is_told_once(void **state)
{
	uint32_t head = command->one_shot_head;

	(void)state;
	legacy->engine.home_mask = 0x05;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, head + 1);
	assert_int_equal(newest()->mask, 0x05);
	assert_int_equal(legacy->engine.home_mask, 0);
	legacy->axis[2].preset = 777;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, head + 2);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_SET_POSITION);
	assert_int_equal(newest()->mask, 0x04);
	assert_int_equal(newest()->value[2], 777);
}

static void what_was_asked_while_the_device_was_away_is_not_done_later(void **state)
{
	uint32_t head = command->one_shot_head;

	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 20);
	legacy->engine.home_mask = 0x05;
	legacy->engine.probe_mask = 0x01;
	legacy->axis[2].preset = 777;
	rig_periods(&rig, 3);
	rig.device_silent = false;
	rig_periods(&rig, 20);
	assert_int_equal(command->one_shot_head, head);
	assert_int_equal(legacy->engine.home_mask, 0);
	assert_int_equal(legacy->engine.probe_mask, 0);
	assert_int_equal(rig.values.one_shot_failed_count, 3);
}

/* So many presets that were done, while the homing of axis 0 goes on. */
static void preset_often(unsigned int count)
{
	for (unsigned int i = 0; i < count; i++) {
		legacy->axis[2].preset++;
		rig_period(&rig);
		assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_SET_POSITION);
		answer(POKEYS_OUTCOME_DONE);
	}
}

/* More than the daemon keeps results of, and more than the ring holds. */
static void a_homing_that_goes_on_while_others_end_has_not_failed(void **state)
{
	static const unsigned int others[] = { POKEYS_ONE_SHOT_RESULTS, POKEYS_ONE_SHOTS + 20 };
	static const enum pokeys_outcome ends[] = { POKEYS_OUTCOME_DONE, POKEYS_OUTCOME_FAILED };

	(void)state;
	rig_drive_older(&rig);
	legacy->axis_set[0].sequence = 1;
	for (unsigned int i = 0; i < 4; i++) {
		const uint32_t failed = rig.values.one_shot_failed_count;
		const bool well = ends[i % 2] == POKEYS_OUTCOME_DONE;
		uint32_t id;

		ask(0x01, LEGACY_HOME_START);
		id = command->one_shot_head - 1;
		assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_HOME);
		rig.daemon.engine.task_phase = POKEYS_TASK_WORKING;
		rig.daemon.engine.axis[0].state = 12;
		preset_often(others[i / 2]);
		assert_int_equal(rig.values.one_shot_failed_count, failed);
		assert_int_equal(legacy->axis[0].state, 12);
		rig.daemon.engine.axis[0].state = 10;
		rig_end(&rig, id, ends[i % 2], POKEYS_TASK_RESULT_NONE);
		assert_int_equal(rig.values.one_shot_failed_count, failed + !well);
		assert_int_equal(legacy->axis[0].state, well ? 3 : 20);
		rig.daemon.one_shot_ack = command->one_shot_head;
		ask(0x01, LEGACY_HOME_IDLE);
	}
}

/* Two presets on their way at once, and a mask; none of these names says how it ended. */
static void what_came_of_masks_and_presets_is_counted(void **state)
{
	const uint32_t head = command->one_shot_head;

	(void)state;
	legacy->axis[2].preset = 777;
	rig_period(&rig);
	legacy->axis[3].preset = 888;
	rig_period(&rig);
	legacy->engine.home_mask = 1;
	rig_period(&rig);
	assert_int_equal(command->one_shot_head, head + 3);
	rig_end(&rig, head, POKEYS_OUTCOME_REFUSED, POKEYS_TASK_RESULT_NONE);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
	rig_end(&rig, head + 1, POKEYS_OUTCOME_DONE, POKEYS_TASK_RESULT_NONE);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
	rig.daemon.epoch++; /* it is not known whether the axis was homed */
	rig_periods(&rig, 2);
	assert_int_equal(rig.values.one_shot_failed_count, 2);
	rig_periods(&rig, 20);
	assert_int_equal(rig.values.one_shot_failed_count, 2);
}

static void a_fault_is_cleared_while_the_machine_is_off(void **state)
{
	uint32_t head = command->one_shot_head;

	(void)state;
	rig_drive_older(&rig);
	rig.daemon.engine.state = 101;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, head);
	rig.values.machine_is_on = false;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, head + 1);
	assert_int_equal(newest()->operation, POKEYS_ONE_SHOT_CLEAR_FAULT);
	answer(POKEYS_OUTCOME_FAILED);
	assert_int_equal(rig.values.one_shot_failed_count, 0);
	rig_periods(&rig, 1100);
	assert_int_equal(command->one_shot_head, head + 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(an_axis_that_homes_gets_no_reference_while_data_are_stale,
				       setup),
		cmocka_unit_test_setup(probing_tells_speed_and_input, setup),
		cmocka_unit_test_setup(homing_is_a_conversation, setup),
		cmocka_unit_test_setup(a_group_waits_for_the_one_that_is_homed, setup),
		cmocka_unit_test_setup(a_refused_homing_shows_an_error, setup),
		cmocka_unit_test_setup(a_position_that_was_not_set_is_set_again, setup),
		cmocka_unit_test_setup(a_homing_ends_with_its_daemon, setup),
		cmocka_unit_test_setup(a_cancelled_homing_is_told_to_the_device, setup),
		cmocka_unit_test_setup(a_start_mask_is_told_once, setup),
		cmocka_unit_test_setup(what_was_asked_while_the_device_was_away_is_not_done_later,
				       setup),
		cmocka_unit_test_setup(a_homing_that_goes_on_while_others_end_has_not_failed,
				       setup),
		cmocka_unit_test_setup(what_came_of_masks_and_presets_is_counted, setup),
		cmocka_unit_test_setup(a_fault_is_cleared_while_the_machine_is_off, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
