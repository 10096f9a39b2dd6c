/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Servo motors beside everything else: what else wants their terminals, counters and outputs. */

#include <math.h>
#include "tests/device/servo_rig.h"

static void nobody_else_commands_their_outputs(void **state)
{
	(void)state;
	servo_enable_all();
	world_output(&world, servo_enable_pin[SIGN], false);
	world_output(&world, DIRECTION_PIN, true);
	world_output(&world, LAMP, true);
	world.command.pwm_enable = 1u << 0;
	world.command.pwm_duty[0] = PWM_PERIOD;
	servo_run(50 * MS);
	assert_true(world_latch(&world, servo_enable_pin[SIGN]));
	assert_true(world_latch(&world, LAMP));
	assert_true(fabs(servo_output(SIGN)) < 0.3);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_PWM_LOOP);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	servo_push_all();
	/* the safe state switches off the others, and they go by themselves */
	world.commanding = false;
	servo_run(150 * MS);
	assert_false(world_latch(&world, LAMP));
	servo_expect_off(0);
}

static void what_does_not_exist_is_refused(void **state)
{
	(void)state;
	world.command.servo[MOTORS].enable = 1;
	servo_run(5 * MS);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_SERVO);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, MOTORS);
	world.command.servo[MOTORS].enable = 0;
	servo_enable(SIGN);
	world.command.servo[SIGN].position = NAN;
	servo_run(2 * MS);
	assert_int_equal(servo_shown(SIGN)->fault, POKEYS_SERVO_ODD);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_SERVO_POSITION);
	servo_expect_off(2 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_RESET, MOTORS, 0, 0),
			 POKEYS_OUTCOME_REFUSED);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, MOTORS, 0, 0),
			 POKEYS_OUTCOME_REFUSED);
}

/* Their counters are not written, and the others of their bank only while they stand. */
static void their_counters_are_theirs(void **state)
{
	(void)state;
	servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, SIGN, 400, POKEYS_SERVO_HOMED);
	servo_enable(SIGN);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SET_ENCODER, servo_encoder[SIGN], 7, 0),
			 POKEYS_OUTCOME_REFUSED);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_ARM_INDEX, servo_encoder[SIGN], 0, 0),
			 POKEYS_OUTCOME_REFUSED);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SET_ENCODER, 0, 7, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SET_ENCODER, 14, 7, 0), POKEYS_OUTCOME_DONE);
	servo_run(100 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	assert_true(servo_shown(SIGN)->homed);
	world.command.servo[SIGN].enable = 0;
	servo_run(5 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SET_ENCODER, servo_encoder[SIGN], 7, 0),
			 POKEYS_OUTCOME_REFUSED);
	assert_true(servo_shown(SIGN)->homed);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SET_ENCODER, 0, 7, 0), POKEYS_OUTCOME_DONE);
	servo_run(200 * MS);
	assert_false(servo_shown(SIGN)->homed);
	servo_enable(SIGN);
}

static unsigned int lost;

static void lose_pwm(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCB && ++lost % 3 != 0;
}

static bool lose_answers(struct world *w, const uint8_t *packet)
{
	(void)w;
	return packet[1] == 0xCB && ++lost % 3 != 0;
}

/* PWM and direction go by different requests (servo_cycle() judges). */
static void turn_back_and_forth(void **state, void (*watch)(struct world *, const uint8_t *),
				bool (*lose)(struct world *, const uint8_t *))
{
	unsigned int turns = 0;
	uint64_t before = 0;

	servo_prepare(state);
	for (unsigned int i = 0; i < MOTORS; i++) {
		struct servo_config *loop = &world.config.servo[i].servo;

		loop->follow_least = loop->follow_most = 50;
		loop->speed_jump = 9000;
		loop->silent_s = 1;
		loop->runaway_move = 50;
	}
	servo_start();
	servo_enable(SIGN);
	world.watch = watch;
	world.lose_reply = lose;
	for (unsigned int i = 0; i < 5000; i++) {
		world.command.servo[SIGN].position = 2 * sin(i * 0.001 * 4 * M_PI);
		servo_cycle();
		turns += (world.rig.device.pins.latch ^ before) >> DIRECTION_PIN & 1;
		before = world.rig.device.pins.latch;
	}
	assert_true(turns > 15);
}

static void the_direction_waits_for_pwm_that_is_lost(void **state)
{
	turn_back_and_forth(state, lose_pwm, NULL);
}

static void the_direction_waits_for_an_answer_that_is_lost(void **state)
{
	turn_back_and_forth(state, NULL, lose_answers);
}

/* The device is busy then, and an off would not arrive. */
static void nothing_is_saved_or_restarted_while_one_is_enabled(void **state)
{
	(void)state;
	servo_enable(SIGN);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SAVE_CONFIG, 0, 0, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_REBOOT, 0, 0, 0), POKEYS_OUTCOME_REFUSED);
	world.command.servo[SIGN].enable = 0;
	servo_run(20 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SAVE_CONFIG, 0, 0, 0), POKEYS_OUTCOME_DONE);
}

static void lose_all_pwm(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCB;
}

/* Whatever was lost before, off is written as soon as something arrives. */
static void off_does_not_wait_after_losses(void **state)
{
	(void)state;
	servo_enable(TWO_PWM);
	servo_motor(TWO_PWM)->torque = 0.05;
	servo_run(200 * MS);
	world.watch = lose_all_pwm;
	servo_motor(TWO_PWM)->torque = 0;
	world.command.servo[TWO_PWM].enable = 0;
	servo_run(150 * MS);
	assert_true(fabs(servo_output(TWO_PWM)) > 0);
	world.watch = NULL;
	servo_expect_off(4 * MS);
	assert_int_equal(world.event_count[EVENT_SERVO_UNHEARD], 0);
}

static void one_that_is_enabled_is_not_placed(void **state)
{
	(void)state;
	servo_enable(SIGN);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, SIGN, 400, 0),
			 POKEYS_OUTCOME_REFUSED);
	world.command.servo[SIGN].enable = 0;
	servo_run(5 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, SIGN, -400, 0), POKEYS_OUTCOME_DONE);
	servo_run(5 * MS);
	assert_true(servo_shown(SIGN)->position == -1);
	assert_false(servo_shown(SIGN)->homed);
}

static void expect_not_ready(enum pokeys_obstacle obstacle)
{
	servo_start();
	for (unsigned int i = 0; i < MOTORS; i++) {
		assert_int_equal(servo_shown(i)->condition, POKEYS_SERVO_DEVICE);
		assert_int_equal(servo_shown(i)->obstacle, obstacle);
	}
	world.command.servo[SIGN].enable = 1;
	servo_run(20 * MS);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_NOT_READY);
	servo_expect_off(0);
}

static void a_device_that_would_not_stop_them_is_not_used(void **state)
{
	servo_prepare(state);
	world.config.settings.failsafe_peripherals = 0;
	expect_not_ready(POKEYS_OBSTACLE_FAILSAFE);
	servo_prepare(state);
	world.config.settings.failsafe_timeout = SERVOING_FAILSAFE_MOST + 1;
	expect_not_ready(POKEYS_OBSTACLE_FAILSAFE);
	servo_prepare(state);
	world.config.settings.failsafe_peripherals = 0;
	world.config.servo[SIGN].without_failsafe = true;
	servo_start();
	servo_enable(SIGN);
	assert_int_equal(servo_shown(ANTIPHASE)->condition, POKEYS_SERVO_DEVICE);
}

static void one_without_pwm_or_an_encoder_is_not_ready(void **state)
{
	servo_prepare(state);
	world.config.settings.pwm_period = SERVOING_PERIOD_MOST + 1;
	expect_not_ready(POKEYS_OBSTACLE_PWM);
	servo_prepare(state);
	for (unsigned int i = 0; i < MOTORS; i++)
		world.config.settings.encoder[servo_encoder[i]].options = 0;
	expect_not_ready(POKEYS_OBSTACLE_ENCODER);
}

/* They are stopped and left alone before anything is asked: it may run as somebody left it. */
static void one_that_runs_when_the_daemon_begins_is_stopped_first(void **state)
{
	servo_begin(state);
	servo_enable_all();
	for (unsigned int i = 0; i < MOTORS; i++)
		servo_motor(i)->torque = 0.1;
	servo_run(200 * MS);
	for (unsigned int i = 0; i < MOTORS; i++)
		servo_motor(i)->torque = 0;
	world_start(&world); /* the daemon was killed, and another one begins */
	servo_run(1300 * MS);
	servo_expect_off(0);
	world_until(&world, world_is_running, 2 * SECOND);
	servo_expect_off(0);
}

static enum pokeys_outcome set_gain(unsigned int motor, unsigned int which, float value)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_SERVO_GAIN,
		.index = (uint8_t)motor,
		.mask = (uint8_t)which,
		.parameter = { value },
	};

	return world_do(&world, &shot, 1 * SECOND);
}

static void gains_change_while_it_runs(void **state)
{
	const double before = world.config.servo[SIGN].servo.gains.d;
	double output;

	(void)state;
	servo_enable_all();
	servo_push_all();
	output = (double)servo_shown(SIGN)->output;
	assert_int_equal(set_gain(SIGN, POKEYS_GAIN_P, 0.35f), POKEYS_OUTCOME_DONE);
	assert_true(servo_shown(SIGN)->p == 0.35f);
	assert_true(fabs((double)servo_shown(SIGN)->output - output) < 0.02);
	assert_true(fabs((double)servo_shown(SIGN)->d - before) < 1e-6);
	assert_int_equal(set_gain(SIGN, POKEYS_GAIN_ACCELERATION, 0.001f), POKEYS_OUTCOME_DONE);
	assert_true(servo_shown(SIGN)->acceleration_gain == 0.001f);
	assert_true(servo_shown(TWO_PWM)->p != 0.35f);
	assert_int_equal(world.event_count[EVENT_SERVO_GAIN], 2);
	servo_run(500 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
}

static void what_is_no_gain_is_refused(void **state)
{
	const float bad[] = { NAN, INFINITY, -1, 2e6f };
	const float before = servo_shown(SIGN)->p;

	(void)state;
	for (unsigned int i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
		assert_int_equal(set_gain(SIGN, POKEYS_GAIN_P, bad[i]), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(set_gain(SIGN, POKEYS_GAIN_I, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(set_gain(SIGN, POKEYS_GAIN_P, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(set_gain(SIGN, POKEYS_GAINS, 1), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(set_gain(SIGN, UINT8_MAX, 1), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(set_gain(MOTORS, POKEYS_GAIN_P, 1), POKEYS_OUTCOME_REFUSED);
	assert_true(servo_shown(SIGN)->p == before);
	assert_int_equal(world.event_count[EVENT_SERVO_GAIN], 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(nobody_else_commands_their_outputs, servo_begin),
		cmocka_unit_test_setup(what_does_not_exist_is_refused, servo_begin),
		cmocka_unit_test_setup(their_counters_are_theirs, servo_begin),
		cmocka_unit_test(the_direction_waits_for_pwm_that_is_lost),
		cmocka_unit_test(the_direction_waits_for_an_answer_that_is_lost),
		cmocka_unit_test_setup(nothing_is_saved_or_restarted_while_one_is_enabled,
				       servo_begin),
		cmocka_unit_test_setup(off_does_not_wait_after_losses, servo_begin),
		cmocka_unit_test_setup(one_that_is_enabled_is_not_placed, servo_begin),
		cmocka_unit_test_setup(gains_change_while_it_runs, servo_begin),
		cmocka_unit_test_setup(what_is_no_gain_is_refused, servo_begin),
		cmocka_unit_test(a_device_that_would_not_stop_them_is_not_used),
		cmocka_unit_test(one_without_pwm_or_an_encoder_is_not_ready),
		cmocka_unit_test(one_that_runs_when_the_daemon_begins_is_stopped_first),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
