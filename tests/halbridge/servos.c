/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Servo motors by pins: what reaches the daemon, and when a motor that does not follow is shown to
 * LinuxCNC as a fault. Each pin by itself is in every_in_pin and every_out_pin.
 */
#include "tests/halbridge/rig.h"

enum { X = 0, Y = 1 };

static struct rig rig;
static struct value_servo *const x = &rig.values.servo[X];
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig.daemon.servo[X].state = POKEYS_SERVO_OFF;
	rig_periods(&rig, 2);
	return 0;
}

static void a_position_goes_through_whole_and_a_speed_of_0_is_not_known(void **state)
{
	(void)state;
	x->pos_cmd = 123456.78901234567;
	x->enable = true;
	rig_period(&rig);
	assert_true(command->servo[X].position == 123456.78901234567);
	assert_true(isnan(command->servo[X].velocity));
	assert_int_equal(command->servo[X].enable, 1);
	x->vel_cmd = -2.5;
	rig_period(&rig);
	assert_true(command->servo[X].velocity == -2.5f);
	rig.daemon.servo[X].position = -98765.43210987654;
	rig_periods(&rig, 2);
	assert_true(x->pos_fb == -98765.43210987654);
}

static void only_motors_that_there_are_are_enabled(void **state)
{
	(void)state;
	rig.values.servo[Y].enable = true;
	rig_period(&rig);
	assert_int_equal(command->servo[Y].enable, 0);
	assert_true(rig.values.input_refused);
	rig_expect_note(&rig, TABLE_SERVOS,
			"pokeys.0.servo.01.enable = 1: has no effect: pokeysd.conf has no such "
			"servo");
	rig.values.servo[Y].enable = false;
	rig_period(&rig);
	assert_false(rig.values.input_refused);
	/* of the next daemon, too */
	x->enable = true;
	rig_period(&rig);
	assert_int_equal(command->servo[X].enable, 1);
	rig.daemon.epoch++;
	rig.daemon.servo[X].state = POKEYS_SERVO_NONE;
	rig_periods(&rig, 3);
	assert_int_equal(command->servo[X].enable, 0);
}

/* The daemon makes it a fault: it must not be enabled again when the number is one again. */
static void a_position_that_is_no_number_is_passed_on(void **state)
{
	(void)state;
	x->enable = true;
	rig_period(&rig);
	x->pos_cmd = (double)NAN;
	rig_period(&rig);
	assert_true(isnan(command->servo[X].position));
	assert_int_equal(command->servo[X].enable, 1);
	rig_expect_note(&rig, TABLE_SERVOS, "not a finite number; the motor is stopped by a fault");
}

static void a_motor_that_does_not_follow_is_a_fault(void **state)
{
	(void)state;
	x->enable = true;
	rig.daemon.servo[X].state = POKEYS_SERVO_ENABLED;
	rig_periods(&rig, 2);
	assert_true(x->enabled && !x->fault);
	rig.daemon.servo[X].state = POKEYS_SERVO_FAULT;
	rig.daemon.servo[X].fault = POKEYS_SERVO_STALLED;
	rig_periods(&rig, 2);
	assert_true(x->fault && !x->enabled);
	assert_int_equal(x->fault_code, POKEYS_SERVO_STALLED);
	x->enable = false;
	rig_periods(&rig, 2);
	assert_true(x->fault);
	/* off, and the device has not said so */
	rig.daemon.servo[X].state = POKEYS_SERVO_STOPPING;
	rig_periods(&rig, 2);
	assert_true(x->fault && x->enabled);
	/* an enable that was refused */
	rig.daemon.servo[X].state = POKEYS_SERVO_OFF;
	rig.daemon.servo[X].fault = 0;
	rig.daemon.servo[X].refused = POKEYS_SERVO_ELSEWHERE;
	rig_periods(&rig, 2);
	assert_false(x->fault);
	x->enable = true;
	rig_periods(&rig, 2);
	assert_true(x->fault);
	assert_int_equal(x->fault_code, 0);
}

static void a_daemon_that_is_gone_is_a_fault_of_a_motor_that_is_to_be_enabled(void **state)
{
	(void)state;
	x->enable = true;
	rig.daemon.servo[X].state = POKEYS_SERVO_ENABLED;
	rig.daemon.servo[X].position = 7;
	rig_periods(&rig, 2);
	rig.daemon_dead = true;
	/* a pause for which the daemon itself does not stop a motor */
	rig_periods(&rig, 90);
	assert_false(rig.values.daemon_alive);
	assert_true(x->enabled && !x->fault);
	rig_periods(&rig, 20);
	assert_false(x->enabled);
	assert_true(x->fault);
	assert_true(x->pos_fb == 7);
	x->enable = false;
	rig_periods(&rig, 2);
	assert_false(x->fault);
}

/* There never was one, or there is one whose image this driver does not understand. */
static void without_a_daemon_a_motor_that_is_to_be_enabled_is_a_fault(void **state)
{
	const enum exchange_got none[] = { EXCHANGE_NOTHING, EXCHANGE_REFUSED };

	(void)state;
	for (unsigned int i = 0; i < 2; i++) {
		rig_init(&rig);
		x->enable = true;
		exchange_read(&rig.exchange, &rig.values, none[i], rig.now_ns);
		assert_true(x->fault);
		x->enable = false;
		exchange_read(&rig.exchange, &rig.values, none[i], rig.now_ns);
		assert_false(x->fault);
	}
	setup(state);
	x->enable = true;
	rig.daemon.servo[X].state = POKEYS_SERVO_ENABLED;
	rig_periods(&rig, 2);
	assert_true(x->enabled && !x->fault);
	exchange_read(&rig.exchange, &rig.values, EXCHANGE_REFUSED, rig.now_ns);
	assert_true(!x->enabled && x->fault);
}

static void one_that_does_not_exist_is_a_fault_when_it_is_to_be_enabled(void **state)
{
	struct value_servo *y = &rig.values.servo[Y];

	(void)state;
	y->enable = true;
	rig_periods(&rig, 2);
	assert_true(y->fault && !y->enabled);
	y->enable = false;
	rig_periods(&rig, 2);
	assert_false(y->fault);
}

/* The number that it would be enabled at is not that of now. */
static void one_that_could_not_be_enabled_stays_off_until_the_pin_falls(void **state)
{
	(void)state;
	x->enable = true;
	rig_periods(&rig, 2);
	assert_int_equal(command->servo[X].enable, 1);
	for (unsigned int i = 0; i < 20; i++)
		exchange_write(&rig.exchange, &rig.values, rig.now_ns, RIG_MS);
	assert_int_equal(command->servo[X].enable, 0);
	rig_periods(&rig, 5);
	assert_int_equal(command->servo[X].enable, 0);
	assert_true(x->fault);
	x->enable = false;
	rig_periods(&rig, 2);
	x->enable = true;
	rig_periods(&rig, 2);
	assert_int_equal(command->servo[X].enable, 1);
}

/* The daemon moves it meanwhile, and what is commanded goes on being sent. */
static void a_button_begins_homing(void **state)
{
	(void)state;
	x->enable = true;
	x->pos_cmd = 3;
	rig.daemon.servo[X].state = POKEYS_SERVO_ENABLED;
	rig_periods(&rig, 2);
	x->home = true;
	rig_period(&rig);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(command->one_shot[0].operation, POKEYS_ONE_SHOT_SERVO_HOME);
	assert_int_equal(command->one_shot[0].index, X);
	assert_int_equal(command->one_shot[0].flags, 0);
	rig.daemon.servo[X].homing = POKEYS_SERVO_HOMING_SEARCH;
	x->home = false;
	rig_periods(&rig, 2);
	assert_true(x->homing && x->enabled && !x->fault);
	assert_int_equal(command->one_shot_head, 1);
	assert_true(command->servo[X].position == 3 && command->servo[X].enable);
	rig.daemon.servo[X].homing = POKEYS_SERVO_HOMING_NONE;
	rig.daemon.servo[X].home_end = POKEYS_SERVO_HOME_DONE;
	rig.daemon.servo[X].homed = 1;
	rig_periods(&rig, 2);
	assert_true(x->homed && !x->homing);
	assert_int_equal(x->home_end, POKEYS_SERVO_HOME_DONE);
	/* nor is it homing without a daemon */
	rig.daemon.servo[X].homing = POKEYS_SERVO_HOMING_SEARCH;
	rig_periods(&rig, 2);
	rig.daemon_dead = true;
	rig_periods(&rig, 120);
	assert_false(x->homing);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(a_position_goes_through_whole_and_a_speed_of_0_is_not_known,
				       setup),
		cmocka_unit_test_setup(only_motors_that_there_are_are_enabled, setup),
		cmocka_unit_test_setup(a_button_begins_homing, setup),
		cmocka_unit_test_setup(a_position_that_is_no_number_is_passed_on, setup),
		cmocka_unit_test_setup(a_motor_that_does_not_follow_is_a_fault, setup),
		cmocka_unit_test_setup(one_that_could_not_be_enabled_stays_off_until_the_pin_falls,
				       setup),
		cmocka_unit_test_setup(
			a_daemon_that_is_gone_is_a_fault_of_a_motor_that_is_to_be_enabled, setup),
		cmocka_unit_test(without_a_daemon_a_motor_that_is_to_be_enabled_is_a_fault),
		cmocka_unit_test_setup(one_that_does_not_exist_is_a_fault_when_it_is_to_be_enabled,
				       setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
