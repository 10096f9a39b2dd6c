/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device that begins another count: positions continue, and position-lost stays true until
 * the joint has been homed.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct values *const values = &rig.values;
static struct value_joint *const joint = &rig.values.joint[2];
static struct pokeys_axis *const axis = &rig.daemon.engine.axis[2];
static const struct pokeys_axis_command *const command = &rig.exchange.command.axis[2];

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	joint->scale = 400;
	axis->position = 60000;
	rig_periods(&rig, 3);
	joint->motion_homed = true;
	joint->pos_cmd = joint->pos_fb;
	rig_periods(&rig, 3);
	assert_true(joint->pos_fb == 150);
	assert_false(values->position_lost);
	return 0;
}

/* As the daemon tells it. */
static void begin_anew(int32_t position)
{
	axis->position_epoch = (uint8_t)((axis->position_epoch | 1) + 1);
	axis->position = position;
	axis->homed = 0;
}

static void set(int32_t position)
{
	axis->position_epoch = (uint8_t)((axis->position_epoch + 1) | 1);
	axis->position = position;
}

static void is_lost(bool unhome)
{
	assert_true(joint->position_lost && values->position_lost);
	assert_int_equal(rig.exchange.positions.unhome_ns != 0, unhome);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		assert_int_equal(values->joint[i].position_lost, i == 2);
}

static void is_known(void)
{
	assert_false(joint->position_lost);
	assert_false(values->position_lost);
	assert_false(values->unhome);
}

static void pos_fb_does_not_jump_and_neither_does_the_axis(void **state)
{
	(void)state;
	begin_anew(0);
	rig_period(&rig);
	is_lost(true);
	assert_true(joint->pos_fb == 150);
	/* a command of before, and one that follows the feedback, are where the axis stands */
	assert_int_equal(command->position, 0);
	joint->pos_cmd = 151;
	rig_period(&rig);
	assert_int_equal(command->position, 400);
	axis->position = 400;
	rig_period(&rig);
	assert_true(joint->pos_fb == 151);
	/* and once more */
	begin_anew(-7);
	rig_period(&rig);
	assert_true(joint->pos_fb == 151);
	assert_int_equal(command->position, -7);
	is_lost(true);
}

static void nothing_ends_it_but_homing(void **state)
{
	(void)state;
	begin_anew(0);
	rig_periods(&rig, 1000);
	is_lost(true);
	rig.device_silent = true;
	rig_periods(&rig, 1000);
	rig.device_silent = false;
	rig_periods(&rig, 1000);
	is_lost(true);
	/* LinuxCNC has unhomed it: the machine may be switched on again, to home it */
	joint->motion_homed = false;
	rig_periods(&rig, 1000);
	is_lost(false);
	joint->motion_homed = true;
	rig_period(&rig);
	is_known();
	assert_true(joint->pos_fb == 150);
}

/* halui takes edges, and LinuxCNC refuses the order while an axis moves. */
static void it_asks_until_it_is_unhomed(void **state)
{
	unsigned int edges = 0;

	(void)state;
	begin_anew(0);
	for (unsigned int i = 0; i < 2000; i++) {
		const bool before = values->unhome;

		rig_period(&rig);
		edges += values->unhome && !before;
		if (i == 0)
			assert_true(values->unhome);
	}
	assert_int_equal(edges, 4);
	joint->motion_homed = false;
	rig_period(&rig);
	is_lost(false);
	assert_false(values->unhome);
}

static void one_that_was_never_homed_is_lost_and_not_unhomed(void **state)
{
	(void)state;
	joint->motion_homed = false;
	rig_period(&rig);
	begin_anew(0);
	rig_period(&rig);
	is_lost(false);
}

static void homing_by_the_device_ends_it_with_its_own_count(void **state)
{
	(void)state;
	begin_anew(0);
	rig_periods(&rig, 3);
	is_lost(true);
	set(-800);
	rig_period(&rig);
	is_known();
	assert_true(joint->pos_fb == -2);
	joint->pos_cmd = -1;
	rig_period(&rig);
	assert_int_equal(command->position, -400);
}

static void it_is_noticed_when_data_are_fresh_again(void **state)
{
	(void)state;
	rig.daemon.link = POKEYS_LINK_IDENTIFYING;
	begin_anew(0);
	rig_periods(&rig, 100);
	assert_true(joint->pos_fb == 150);
	rig.daemon.link = POKEYS_LINK_RUNNING;
	rig_period(&rig);
	is_lost(true);
	assert_true(joint->pos_fb == 150);
}

/* It cannot know what was before it. */
static void another_daemon_is_a_loss(void **state)
{
	(void)state;
	rig.daemon.epoch++;
	axis->position = 60100;
	axis->position_epoch = 0;
	rig.daemon.link = POKEYS_LINK_IDENTIFYING;
	rig_periods(&rig, 10);
	assert_false(joint->position_lost);
	rig.daemon.link = POKEYS_LINK_RUNNING;
	rig_period(&rig);
	assert_true(joint->position_lost && values->unhome);
	assert_true(joint->pos_fb == 150);
	assert_int_equal(command->position, 60100);
}

static void a_buffer_that_ran_dry_is_a_loss_of_steps(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		rig.daemon.engine.axis[i].mode = i == 2 ? POKEYS_AXIS_BUFFERED :
							  POKEYS_AXIS_POSITION;
	rig_period(&rig);
	is_known();
	values->engine.dry_loses = false;
	rig.daemon.engine.buffer_underruns++;
	rig_period(&rig);
	is_known();
	values->engine.dry_loses = true;
	rig_period(&rig);
	is_known();
	rig.daemon.engine.buffer_underruns++;
	axis->position += 40;
	rig_period(&rig);
	is_lost(true);
	/* the count is right */
	assert_true(joint->pos_fb == 150.1);
}

enum { STOPPED = 0, RUNNING = 3, STOP_LIMIT = 100, STOP_EMERGENCY = 101 };

static void trip(uint8_t state)
{
	rig.daemon.engine.state = state;
	rig.daemon.engine.stops++;
}

/* The device stops all axes at once; those that moved may have lost steps. */
static void a_stop_by_a_switch_is_a_loss_for_axes_that_moved(void **state)
{
	static const uint8_t stops[] = { STOP_LIMIT, STOP_EMERGENCY };

	for (unsigned int i = 0; i < 2; i++) {
		setup(state);
		rig.daemon.engine.state = RUNNING;
		axis->position += 40;
		rig_periods(&rig, 3);
		is_known();
		trip(stops[i]);
		rig_period(&rig);
		is_lost(true);
		assert_true(joint->pos_fb == 150.1);
		/* it is homed again, from the switch */
		joint->motion_homed = false;
		rig_periods(&rig, 2);
		joint->motion_homed = true;
		rig_periods(&rig, 5);
		is_known();
	}
}

static void the_last_step_may_come_with_the_stop(void **state)
{
	(void)state;
	rig_periods(&rig, 200);
	trip(STOP_LIMIT);
	axis->position -= 3;
	rig_period(&rig);
	is_lost(true);
}

/* Whoever saw the switch has stopped the machine, and the thread was late just then. */
static void a_stop_that_is_over_already_is_a_loss(void **state)
{
	(void)state;
	/* standing, so that this is none: the count runs over next */
	rig.daemon.engine.stops = UINT8_MAX;
	rig_periods(&rig, 200);
	is_known();
	rig.daemon.engine.state = RUNNING;
	axis->position += 40;
	rig_periods(&rig, 3);
	trip(STOP_LIMIT);
	rig.daemon.engine.state = STOPPED;
	axis->position += 3;
	rig_period(&rig);
	is_lost(true);
}

/* Somebody presses a switch by hand, or the motors can take it. */
static void a_stop_of_axes_that_stand_is_no_loss(void **state)
{
	(void)state;
	rig.daemon.engine.state = RUNNING;
	axis->position += 40;
	rig_periods(&rig, 200);
	trip(STOP_LIMIT);
	rig_periods(&rig, 3);
	is_known();
	values->engine.dry_loses = false;
	rig.daemon.engine.state = RUNNING;
	axis->position += 40;
	rig_periods(&rig, 3);
	trip(STOP_LIMIT);
	rig_periods(&rig, 3);
	is_known();
}

/* The motor has no current any more, whether it moved or not. */
static void an_error_of_a_driver_is_a_loss_for_its_axis(void **state)
{
	(void)state;
	values->engine.dry_loses = false;
	rig_periods(&rig, 200);
	/* a driver that is switched off says so, too, and one reading is none */
	axis->error = true;
	rig_periods(&rig, 10);
	axis->enabled = true;
	rig_periods(&rig, 10);
	axis->error = false;
	rig_periods(&rig, 10);
	axis->error = true;
	rig_periods(&rig, 2);
	axis->error = false;
	rig_periods(&rig, 10);
	is_known();
	axis->error = true;
	rig_period(&rig);
	axis->enabled = false;
	rig_periods(&rig, 2);
	is_lost(true);
	joint->motion_homed = false;
	rig_periods(&rig, 2);
	joint->motion_homed = true;
	rig_periods(&rig, 5);
	is_known();
	axis->error = false;
	rig_periods(&rig, 5);
	is_known();
}

/* A spindle, which nobody homes; and an error that was there before. */
static void who_has_no_position_loses_none(void **state)
{
	(void)state;
	axis->mode = POKEYS_AXIS_VELOCITY;
	rig.daemon.engine.state = RUNNING;
	axis->position += 4000;
	rig_periods(&rig, 3);
	trip(STOP_EMERGENCY);
	rig_periods(&rig, 3);
	is_known();
	rig_init(&rig);
	axis->mode = POKEYS_AXIS_POSITION;
	axis->error = axis->enabled = true;
	rig_periods(&rig, 10);
	is_known();
}

/* What was before is no concern of a component that has just been loaded. */
static void a_daemon_that_has_counted_before_is_no_loss(void **state)
{
	(void)state;
	rig_init(&rig);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		rig.daemon.engine.axis[i].mode = POKEYS_AXIS_BUFFERED;
	rig.daemon.engine.buffer_underruns = 5;
	rig_periods(&rig, 3);
	is_known();
}

/* Its mode comes by a setting of HAL's, some time after data are fresh. */
static void another_daemon_is_a_loss_for_one_set_up_late(void **state)
{
	(void)state;
	rig.daemon.epoch++;
	axis->mode = POKEYS_AXIS_OFF;
	axis->position = 0;
	for (unsigned int i = 0; i < 10; i++) {
		rig_period(&rig);
		assert_true(joint->pos_fb == 150);
	}
	axis->mode = POKEYS_AXIS_POSITION;
	rig_period(&rig);
	assert_true(joint->position_lost && values->unhome);
	assert_true(joint->pos_fb == 150);
}

static void an_axis_that_is_not_there_loses_nothing(void **state)
{
	(void)state;
	axis->mode = POKEYS_AXIS_OFF;
	begin_anew(0);
	rig_periods(&rig, 3);
	is_known();
}

/* What the device's planner cannot reach is measured in the device's own count. */
static void a_place_beyond_the_planner_is_refused_by_its_count(void **state)
{
	(void)state;
	begin_anew(JOINT_POSITION_MOST - 400);
	rig_period(&rig);
	joint->pos_cmd = 151;
	rig_period(&rig);
	assert_int_equal(command->position, JOINT_POSITION_MOST);
	joint->pos_cmd = 151.1;
	rig_period(&rig);
	assert_true(joint->refused);
	assert_int_equal(command->position, JOINT_POSITION_MOST);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(pos_fb_does_not_jump_and_neither_does_the_axis, setup),
		cmocka_unit_test_setup(nothing_ends_it_but_homing, setup),
		cmocka_unit_test_setup(it_asks_until_it_is_unhomed, setup),
		cmocka_unit_test_setup(one_that_was_never_homed_is_lost_and_not_unhomed, setup),
		cmocka_unit_test_setup(homing_by_the_device_ends_it_with_its_own_count, setup),
		cmocka_unit_test_setup(it_is_noticed_when_data_are_fresh_again, setup),
		cmocka_unit_test_setup(another_daemon_is_a_loss, setup),
		cmocka_unit_test_setup(a_buffer_that_ran_dry_is_a_loss_of_steps, setup),
		cmocka_unit_test_setup(a_stop_by_a_switch_is_a_loss_for_axes_that_moved, setup),
		cmocka_unit_test_setup(the_last_step_may_come_with_the_stop, setup),
		cmocka_unit_test_setup(a_stop_that_is_over_already_is_a_loss, setup),
		cmocka_unit_test_setup(a_stop_of_axes_that_stand_is_no_loss, setup),
		cmocka_unit_test_setup(who_has_no_position_loses_none, setup),
		cmocka_unit_test_setup(an_error_of_a_driver_is_a_loss_for_its_axis, setup),
		cmocka_unit_test(a_daemon_that_has_counted_before_is_no_loss),
		cmocka_unit_test_setup(another_daemon_is_a_loss_for_one_set_up_late, setup),
		cmocka_unit_test_setup(an_axis_that_is_not_there_loses_nothing, setup),
		cmocka_unit_test_setup(a_place_beyond_the_planner_is_refused_by_its_count, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
