/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Threading by pins: what is asked of the daemon, why it was refused, how it ended, and
 * where a joint is said to be while the spindle leads it.
 */
#include <math.h>
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct values *const values = &rig.values;
static struct value_threading *const threading = &rig.values.threading;
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

static void press(bool *pin)
{
	*pin = true;
	rig_period(&rig);
	*pin = false;
	rig_period(&rig);
}

static void outcome(uint32_t id, enum pokeys_outcome how)
{
	rig.daemon.one_shot[id % POKEYS_ONE_SHOT_RESULTS] = (struct pokeys_one_shot_result){
		.id = id,
		.outcome = (uint8_t)how,
		.operation = command->one_shot[id % POKEYS_ONE_SHOTS].operation,
	};
	rig.daemon.one_shot_ack = id + 1;
	rig_periods(&rig, 2);
}

static void each_edge_is_one_request(void **state)
{
	bool *const pins[] = {
		&threading->prepare, &threading->force,  &threading->arm,
		&threading->release, &threading->cancel,
	};

	(void)state;
	threading->time_limit = 40;
	for (uint32_t i = 0; i < 5; i++) {
		press(pins[i]);
		assert_int_equal(command->one_shot_head, i + 1);
		assert_int_equal(command->one_shot[i].operation,
				 POKEYS_ONE_SHOT_THREAD_PREPARE + i);
		assert_true(command->one_shot[i].parameter[0] == (i < 2 ? 40 : 0));
		outcome(i, POKEYS_OUTCOME_DONE);
	}
	assert_false(threading->out.refused);
	assert_int_equal(values->one_shot_failed_count, 0);
}

static void refusal_says_why_until_the_next_request(void **state)
{
	(void)state;
	press(&threading->arm);
	rig.daemon.threading.refused = POKEYS_THREADING_NOT_PREPARED;
	outcome(0, POKEYS_OUTCOME_REFUSED);
	assert_true(threading->out.refused);
	assert_int_equal(threading->out.reason, POKEYS_THREADING_NOT_PREPARED);
	assert_int_equal(values->one_shot_failed_count, 1);
	press(&threading->prepare);
	assert_false(threading->out.refused);
	threading->time_limit = -1;
	press(&threading->force);
	assert_int_equal(threading->out.reason, POKEYS_THREADING_BAD_LIMIT);
	assert_int_equal(command->one_shot_head, 2);
	threading->time_limit = 0;
	rig.device_silent = true;
	rig_periods(&rig, 20);
	press(&threading->arm);
	rig.device_silent = false;
	rig_periods(&rig, 2);
	assert_int_equal(threading->out.reason, 9);
	assert_int_equal(command->one_shot_head, 2);
}

static void stale_data_hold_up_nothing_that_ends_it(void **state)
{
	bool *const pins[] = { &threading->release, &threading->cancel };

	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_false(values->connected);
	for (uint32_t i = 0; i < 2; i++) {
		press(pins[i]);
		assert_int_equal(command->one_shot_head, i + 1);
		assert_int_equal(command->one_shot[i].operation,
				 POKEYS_ONE_SHOT_THREAD_RELEASE + i);
		outcome(i, POKEYS_OUTCOME_DONE);
	}
	assert_int_equal(values->one_shot_failed_count, 0);
	rig.device_silent = false;
	rig_periods(&rig, 3);
	assert_int_equal(threading->out.reason, POKEYS_THREADING_WELL);
}

static void what_ends_it_is_refused_without_a_link(void **state)
{
	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 20);
	rig.daemon.link = POKEYS_LINK_LOST;
	press(&threading->release);
	outcome(0, POKEYS_OUTCOME_REFUSED);
	assert_int_equal(values->one_shot_failed_count, 1);
	rig.daemon.link = POKEYS_LINK_RUNNING;
	rig.device_silent = false;
	rig_periods(&rig, 3);
	assert_true(threading->out.refused);
	assert_int_equal(threading->out.reason, 9);
}

static void bad_limit_holds_up_nothing_that_ends_it(void **state)
{
	bool *const pins[] = { &threading->arm, &threading->release, &threading->cancel };
	const double bad[] = { -1, NAN, 1e9 };

	(void)state;
	for (uint32_t i = 0; i < 3; i++) {
		threading->time_limit = bad[i];
		press(&threading->prepare);
		assert_int_equal(threading->out.reason, POKEYS_THREADING_BAD_LIMIT);
		press(pins[i]);
		assert_int_equal(threading->out.reason, POKEYS_THREADING_WELL);
		assert_int_equal(command->one_shot_head, i + 1);
		assert_int_equal(command->one_shot[i].operation, POKEYS_ONE_SHOT_THREAD_ARM + i);
		outcome(i, POKEYS_OUTCOME_DONE);
	}
}

static void works(uint8_t phase)
{
	rig.daemon.engine.task = POKEYS_TASK_THREADING;
	rig.daemon.engine.task_phase = phase;
	rig.daemon.engine.task_axes = 1 << 2;
	rig_periods(&rig, 2);
}

static void ends(uint8_t result)
{
	rig.daemon.engine.task_result = result;
	rig.daemon.engine.task_count++;
	works(POKEYS_TASK_IDLE);
}

static void end_is_told(void **state)
{
	(void)state;
	works(POKEYS_TASK_WORKING);
	ends(POKEYS_TASK_STARVED);
	assert_int_equal(threading->out.error, POKEYS_TASK_STARVED);
	works(POKEYS_TASK_WORKING);
	assert_int_equal(threading->out.error, POKEYS_TASK_STARVED);
	ends(POKEYS_TASK_DONE);
	assert_int_equal(threading->out.error, 0);
	rig.daemon.engine.task = POKEYS_TASK_HOMING;
	rig.daemon.engine.task_result = POKEYS_TASK_TRIPPED;
	rig.daemon.engine.task_count++;
	rig_periods(&rig, 2);
	assert_int_equal(threading->out.error, 0);
}

static void another_daemon_does_not_know(void **state)
{
	(void)state;
	rig.daemon.threading.active = 1;
	works(POKEYS_TASK_WORKING);
	press(&threading->release);
	rig.daemon.epoch++;
	rig.daemon.threading.active = 0;
	rig.daemon.engine.task = POKEYS_TASK_NONE;
	rig.daemon.engine.task_phase = POKEYS_TASK_IDLE;
	rig_periods(&rig, 3);
	assert_int_equal(threading->out.error, 9);
	assert_int_equal(values->one_shot_failed_count, 1);
}

/* The machine must not be stopped because the spindle has not turned yet. */
static void led_joint_is_where_it_is_commanded(void **state)
{
	(void)state;
	values->joint[2].pos_cmd = 10;
	values->joint[3].pos_cmd = 10;
	rig.daemon.engine.axis[2].position = rig.daemon.engine.axis[3].position = 1500;
	rig.daemon.engine.axis[2].following_error = 500;
	rig_periods(&rig, 2);
	assert_true(values->joint[2].pos_fb == 7.5);
	works(POKEYS_TASK_WORKING);
	assert_true(values->joint[2].pos_fb == 10);
	assert_true(values->joint[2].following_error == 2.5);
	assert_true(values->joint[3].pos_fb == 7.5);
	values->joint[2].pos_cmd = 11;
	rig_periods(&rig, 3);
	assert_true(values->joint[2].pos_fb == 11);
	works(POKEYS_TASK_STOPPING);
	assert_true(values->joint[2].pos_fb == 7.5);
	works(POKEYS_TASK_FINISHING);
	assert_true(values->joint[2].pos_fb == 11);
	ends(POKEYS_TASK_DONE);
	assert_true(values->joint[2].pos_fb == 7.5);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(each_edge_is_one_request, setup),
		cmocka_unit_test_setup(refusal_says_why_until_the_next_request, setup),
		cmocka_unit_test_setup(bad_limit_holds_up_nothing_that_ends_it, setup),
		cmocka_unit_test_setup(stale_data_hold_up_nothing_that_ends_it, setup),
		cmocka_unit_test_setup(what_ends_it_is_refused_without_a_link, setup),
		cmocka_unit_test_setup(end_is_told, setup),
		cmocka_unit_test_setup(another_daemon_does_not_know, setup),
		cmocka_unit_test_setup(led_joint_is_where_it_is_commanded, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
