/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing by pins: joint after joint, groups together, and what becomes of those
 * that wait when one fails, is cancelled, or nobody is there to do it.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct values *const values = &rig.values;
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		values->joint[i].scale = 200;
	rig_periods(&rig, 2);
	return 0;
}

static void press(unsigned int joints)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		values->joint[i].home = joints >> i & 1;
	rig_period(&rig);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		values->joint[i].home = false;
	rig_period(&rig);
}

/* As the daemon does it: the task begins with the one-shot, and is idle when it has ended. */
static void work(uint32_t id)
{
	rig.daemon.one_shot_ack = id + 1;
	rig.daemon.engine.task = POKEYS_TASK_HOMING;
	rig.daemon.engine.task_phase = POKEYS_TASK_WORKING;
	rig.daemon.engine.task_axes = command->one_shot[id].mask;
	rig_period(&rig);
}

static unsigned int homing(void)
{
	unsigned int joints = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		joints |= (unsigned int)values->joint[i].homing << i;
	return joints;
}

static void a_press_homes_one_joint(void **state)
{
	(void)state;
	values->joint[2].home_offset = -12.5;
	values->homing.time_limit = 30;
	press(1u << 2);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(command->one_shot[0].operation, POKEYS_ONE_SHOT_HOME);
	assert_int_equal(command->one_shot[0].mask, 1u << 2);
	assert_int_equal(command->one_shot[0].flags, POKEYS_HOME_FINISH_ITSELF);
	assert_int_equal(command->one_shot[0].value[2], -2500);
	assert_true(command->one_shot[0].parameter[0] == 30);
	work(0);
	assert_int_equal(homing(), 1u << 2);
	assert_true(values->homing.active);
	assert_int_equal(values->homing.phase, POKEYS_TASK_WORKING);
	rig_end(&rig, 0, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
	assert_int_equal(homing(), 0);
	assert_false(values->homing.active);
	assert_int_equal(values->homing.error, 0);
	assert_int_equal(values->one_shot_failed_count, 0);
}

static void joints_wait_for_each_other(void **state)
{
	(void)state;
	press(0x15);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(command->one_shot[0].mask, 0x01);
	work(0);
	assert_int_equal(homing(), 0x15);
	/* homed, but the engine has not let go: the daemon would refuse the next */
	rig.daemon.one_shot[0] = (struct pokeys_one_shot_result){
		.operation = POKEYS_ONE_SHOT_HOME,
		.outcome = POKEYS_OUTCOME_DONE,
	};
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 1);
	rig_end(&rig, 0, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
	assert_int_equal(command->one_shot[1].mask, 0x04);
	work(1);
	rig_end(&rig, 1, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
	assert_int_equal(command->one_shot[2].mask, 0x10);
	work(2);
	rig_end(&rig, 2, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
	assert_int_equal(command->one_shot_head, 3);
	assert_int_equal(homing(), 0);
}

static void a_group_is_one_request_whichever_was_pressed(void **state)
{
	(void)state;
	values->joint[1].home_group = values->joint[3].home_group = 2;
	values->joint[0].home_group = 1;
	press(1u << 3);
	assert_int_equal(command->one_shot[0].mask, 0x0a);
	work(0);
	rig_end(&rig, 0, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
	press(0x0a);
	assert_int_equal(command->one_shot[1].mask, 0x0a);
	work(1);
	rig_end(&rig, 1, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
	assert_int_equal(command->one_shot_head, 2);
}

static void a_failure_ends_it_for_those_that_wait(void **state)
{
	(void)state;
	press(0x03);
	work(0);
	rig_end(&rig, 0, POKEYS_OUTCOME_FAILED, POKEYS_TASK_TRIPPED);
	rig_periods(&rig, 5);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(homing(), 0);
	assert_int_equal(values->homing.error, POKEYS_TASK_TRIPPED);
	assert_int_equal(values->one_shot_failed_count, 1);
	press(0x01);
	assert_int_equal(command->one_shot_head, 2);
}

static void a_refusal_is_shown(void **state)
{
	(void)state;
	press(0x01);
	rig_end(&rig, 0, POKEYS_OUTCOME_REFUSED, POKEYS_TASK_RESULT_NONE);
	assert_int_equal(values->homing.error, 8);
	press(0x01);
	rig_end(&rig, 1, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
	assert_int_equal(values->homing.error, 0);
}

static void cancel_is_one_request_and_nobody_waits_any_more(void **state)
{
	(void)state;
	press(0x03);
	work(0);
	values->homing.cancel = true;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 2);
	assert_int_equal(command->one_shot[1].operation, POKEYS_ONE_SHOT_HOME_CANCEL);
	rig_end(&rig, 0, POKEYS_OUTCOME_FAILED, POKEYS_TASK_CANCELLED);
	rig_end(&rig, 1, POKEYS_OUTCOME_DONE, POKEYS_TASK_CANCELLED);
	rig_periods(&rig, 5);
	assert_int_equal(command->one_shot_head, 2);
	assert_int_equal(homing(), 0);
	assert_int_equal(values->homing.error, POKEYS_TASK_CANCELLED);
}

static void it_is_cancelled_while_data_are_stale(void **state)
{
	(void)state;
	press(0x01);
	work(0);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_false(values->connected);
	values->homing.cancel = true;
	rig_periods(&rig, 3);
	assert_int_equal(command->one_shot_head, 2);
	assert_int_equal(command->one_shot[1].operation, POKEYS_ONE_SHOT_HOME_CANCEL);
	assert_int_equal(values->one_shot_failed_count, 0);
}

static void a_press_while_the_device_is_away_is_not_kept(void **state)
{
	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 10);
	press(0x01);
	rig.device_silent = false;
	rig_periods(&rig, 10);
	assert_true(values->connected);
	assert_int_equal(command->one_shot_head, 0);
	assert_int_equal(values->homing.error, 8);
	assert_int_equal(values->one_shot_failed_count, 1);
}

static void another_daemon_does_not_home(void **state)
{
	(void)state;
	press(0x03);
	work(0);
	rig.daemon.epoch++;
	rig.daemon.one_shot_ack = 0;
	rig.daemon.engine.task_phase = POKEYS_TASK_IDLE;
	rig_periods(&rig, 5);
	assert_int_equal(command->one_shot_head, 0);
	assert_int_equal(homing(), 0);
	assert_int_equal(values->homing.error, 9);
}

/* Wired the wrong way round, or hanging: no axis sets off when the component is loaded. */
static void a_pin_that_is_true_from_the_start_is_no_press(void **state)
{
	(void)state;
	rig_init(&rig);
	values->joint[0].home = true;
	rig_periods(&rig, 5);
	assert_true(values->connected);
	assert_int_equal(command->one_shot_head, 0);
}

static void bad_parameters_are_refused_and_named(void **state)
{
	static const double bad[] = { NAN, INFINITY, 1e9, -1e9 };
	struct refusal_note note;

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		values->joint[0].home_offset = bad[i];
		press(0x01);
		assert_int_equal(command->one_shot_head, 0);
		assert_int_equal(values->homing.error, 8);
	}
	values->joint[0].home_offset = 0;
	rig_period(&rig);
	values->homing.time_limit = 3601;
	press(0x01);
	assert_int_equal(command->one_shot_head, 0);
	assert_true(values->input_refused);
	while (refusal_take(&rig.exchange.refusals, &note))
		;
	assert_int_equal(note.offset, offsetof(struct values, homing.time_limit));
	values->homing.time_limit = 3600;
	press(0x01);
	assert_int_equal(command->one_shot_head, 1);
	assert_false(values->input_refused);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(a_press_homes_one_joint, setup),
		cmocka_unit_test_setup(joints_wait_for_each_other, setup),
		cmocka_unit_test_setup(a_group_is_one_request_whichever_was_pressed, setup),
		cmocka_unit_test_setup(a_failure_ends_it_for_those_that_wait, setup),
		cmocka_unit_test_setup(a_refusal_is_shown, setup),
		cmocka_unit_test_setup(cancel_is_one_request_and_nobody_waits_any_more, setup),
		cmocka_unit_test_setup(it_is_cancelled_while_data_are_stale, setup),
		cmocka_unit_test_setup(a_press_while_the_device_is_away_is_not_kept, setup),
		cmocka_unit_test_setup(another_daemon_does_not_home, setup),
		cmocka_unit_test_setup(a_pin_that_is_true_from_the_start_is_no_press, setup),
		cmocka_unit_test_setup(bad_parameters_are_refused_and_named, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
