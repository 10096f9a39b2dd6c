/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Motors search for their gains through the device: with the delays of the network and of the
 * outputs, whatever drives the motor; who may begin a search, and what ends it.
 */

#include <math.h>
#include "tests/device/servo_rig.h"

static double place(unsigned int motor)
{
	return servo_motor(motor)->angle / (2 * M_PI) * 5;
}

static void prepare(void)
{
	servo_prepare(NULL);
	for (unsigned int i = 0; i < MOTORS; i++) {
		/* rough ones, with which it is only held */
		world.config.servo[i].servo.gains = (struct servo_gains){ .p = 0.2 };
		world.config.servo[i].acceleration = 1000;
	}
	servo_start();
	servo_enable_all();
}

static int begin(void **state)
{
	(void)state;
	prepare();
	return 0;
}

static enum pokeys_outcome tune(unsigned int motor, double distance, double most)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_SERVO_TUNE,
		.index = (uint8_t)motor,
		.parameter = { (float)distance, (float)most },
	};

	return world_do(&world, &shot, 1 * SECOND);
}

static void gain(unsigned int motor, enum pokeys_gain which, float value)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_SERVO_GAIN,
		.index = (uint8_t)motor,
		.mask = (uint8_t)which,
		.parameter = { value },
	};

	assert_int_equal(world_do(&world, &shot, 1 * SECOND), POKEYS_OUTCOME_DONE);
}

/* Until it has ended. It stays within its distance. */
static void until_ended(unsigned int motor, double distance)
{
	const double from = place(motor);

	for (unsigned int k = 0; servo_shown(motor)->tuning == POKEYS_SERVO_TUNING_RUNS; k++) {
		assert_true(k < 40000);
		servo_cycle();
		assert_true(fabs(place(motor) - from) < distance * 0.6);
	}
	servo_run(5 * MS);
	assert_true(fabs(servo_output(motor)) <= 0);
	assert_int_not_equal(servo_shown(motor)->state, POKEYS_SERVO_ENABLED);
}

static void found_is(float found, double real)
{
	if (!(fabs((double)found - real) <= real * 0.15))
		fail_msg("%g instead of %g", (double)found, real);
}

/* What the three drives have found is the same motor, and each follows with it. */
static void each_drive_finds_its_gains(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < MOTORS; i++) {
		const struct pokeys_servo *shown = servo_shown(i);

		assert_int_equal(tune(i, 40, 0), POKEYS_OUTCOME_DONE);
		assert_int_equal(shown->tuning, POKEYS_SERVO_TUNING_RUNS);
		until_ended(i, 40);
		assert_int_equal(shown->tuning, POKEYS_SERVO_TUNING_DONE);
		assert_int_equal(shown->tune_reason, POKEYS_SERVO_TUNE_FINE);
		found_is(shown->tuned_velocity_gain, 0.00262);
		found_is(shown->tuned_acceleration_gain, 5.2e-5);
		found_is(shown->tuned_acceleration, 19100);
		/* what it has is what it had */
		assert_true(fabs((double)shown->p - 0.2) < 1e-6);
		gain(i, POKEYS_GAIN_P, shown->tuned_p);
		gain(i, POKEYS_GAIN_I, shown->tuned_i);
		gain(i, POKEYS_GAIN_D, shown->tuned_d);
		gain(i, POKEYS_GAIN_VELOCITY, shown->tuned_velocity_gain);
		gain(i, POKEYS_GAIN_ACCELERATION, shown->tuned_acceleration_gain);
	}
	servo_enable_all();
	/* from one position */
	for (unsigned int k = 0; k < 800; k++) {
		for (unsigned int i = 0; i < MOTORS; i++) {
			world.command.servo[i].position += 0.05;
			world.command.servo[i].velocity = 50;
		}
		servo_cycle();
		for (unsigned int i = 0; k > 400 && i < MOTORS; i++)
			assert_true(fabs((double)servo_shown(i)->error) < 0.15);
	}
	for (unsigned int i = 0; i < MOTORS; i++) {
		world.command.servo[i].velocity = 0;
		assert_int_equal(servo_shown(i)->state, POKEYS_SERVO_ENABLED);
	}
	servo_run(500 * MS);
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_true(fabs((double)servo_shown(i)->error) < 0.03);
	assert_int_equal(world.event_count[EVENT_SERVO_TUNED], 2 * MOTORS);
}

/* A direction that takes its time: the model is that of the motor, the loop is slower. */
static void a_dwell_is_no_part_of_the_motor(void **state)
{
	float quick;

	(void)state;
	prepare();
	assert_int_equal(tune(SIGN, 40, 0), POKEYS_OUTCOME_DONE);
	until_ended(SIGN, 40);
	quick = servo_shown(SIGN)->tuned_p;
	servo_prepare(NULL);
	world.config.servo[SIGN].servo.gains = (struct servo_gains){ .p = 0.2 };
	world.config.servo[SIGN].drive.dwell_ns = 10 * MS;
	servo_start();
	servo_enable(SIGN);
	servo_run(100 * MS);
	assert_int_equal(tune(SIGN, 40, 0), POKEYS_OUTCOME_DONE);
	until_ended(SIGN, 40);
	assert_int_equal(servo_shown(SIGN)->tuning, POKEYS_SERVO_TUNING_DONE);
	found_is(servo_shown(SIGN)->tuned_velocity_gain, 0.00262);
	found_is(servo_shown(SIGN)->tuned_acceleration_gain, 5.2e-5);
	assert_true(servo_shown(SIGN)->tuned_p < quick / 2);
}

/* What the device has is not known for a moment: that is no delay of the motor. */
static void a_lost_packet_is_no_part_of_the_motor(void **state)
{
	const struct sim_link_faults faults = {
		.loss = 0.02,
		.delay = { .low_ns = MS / 10, .high_ns = MS / 5 },
	};
	float quick;

	(void)state;
	prepare();
	assert_int_equal(tune(ANTIPHASE, 40, 0), POKEYS_OUTCOME_DONE);
	until_ended(ANTIPHASE, 40);
	quick = servo_shown(ANTIPHASE)->tuned_p;
	prepare();
	for (unsigned int i = 0; i < 2; i++)
		sim_link_set_faults(&world.rig.link, i, &faults);
	assert_int_equal(tune(ANTIPHASE, 40, 0), POKEYS_OUTCOME_DONE);
	until_ended(ANTIPHASE, 40);
	assert_int_equal(servo_shown(ANTIPHASE)->tuning, POKEYS_SERVO_TUNING_DONE);
	found_is(servo_shown(ANTIPHASE)->tuned_velocity_gain, 0.00262);
	if (servo_shown(ANTIPHASE)->tuned_p < quick / 8)
		fail_msg("p %g instead of %g", (double)servo_shown(ANTIPHASE)->tuned_p,
			 (double)quick);
}

static void who_may_begin_it(void **state)
{
	const struct pokeys_one_shot move = {
		.operation = POKEYS_ONE_SHOT_MOVE,
		.mask = 1,
		.flags = POKEYS_MOVE_BEGINS,
		.value = { 400 },
		.parameter = { 1 },
	};

	(void)state;
	assert_int_equal(tune(0, -1, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(tune(0, NAN, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(tune(0, 40, 2), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(tune(MOTORS, 40, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(tune(0, 0, 0), POKEYS_OUTCOME_REFUSED);
	world.command.servo[0].enable = 0;
	servo_run(10 * MS);
	assert_int_equal(tune(0, 40, 0), POKEYS_OUTCOME_REFUSED);
	servo_enable(0);
	assert_int_equal(world_do(&world, &move, 1 * SECOND), POKEYS_OUTCOME_DONE);
	assert_int_equal(tune(0, 40, 0), POKEYS_OUTCOME_REFUSED);
	servo_run(1500 * MS);
	/* held at the end of a path, it may */
	assert_int_equal(tune(0, 40, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world_do(&world, &move, 1 * SECOND), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(world.state.moves.refused, POKEYS_MOVES_COMMANDED);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_HOME, 0, 0, 0), POKEYS_OUTCOME_REFUSED);
	servo_run(500 * MS);
	/* on request it ends */
	assert_int_equal(tune(0, 0, 0), POKEYS_OUTCOME_DONE);
	servo_cycle();
	servo_expect_off(5 * MS);
	assert_int_equal(servo_shown(0)->tuning, POKEYS_SERVO_TUNING_FAILED);
	assert_int_equal(servo_shown(0)->tune_reason, POKEYS_SERVO_TUNE_STOPPED);
}

static void what_stops_a_motor_ends_it(void **state)
{
	(void)state;
	for (unsigned int way = 0; way < 5; way++) {
		prepare();
		assert_int_equal(tune(SIGN, 40, 0), POKEYS_OUTCOME_DONE);
		servo_run(700 * MS);
		assert_int_equal(servo_shown(SIGN)->tuning, POKEYS_SERVO_TUNING_RUNS);
		for (unsigned int i = 1; i < MOTORS; i++)
			world.command.servo[i].enable = 0;
		if (way == 0)
			world_commander(&world, 6);
		else if (way == 1)
			world.commanding = false;
		else if (way == 2)
			world.command.flags |= POKEYS_COMMAND_EMERGENCY;
		else if (way == 3)
			world.command.servo[SIGN].enable = 0;
		else
			sim_motor_break(servo_motor(SIGN), SIM_MOTOR_SILENT);
		/* it has no voltage for a moment whenever it turns */
		servo_run(120 * MS);
		servo_expect_off(0);
		assert_int_equal(servo_shown(SIGN)->tuning, POKEYS_SERVO_TUNING_FAILED);
		assert_int_equal(servo_shown(SIGN)->tune_reason,
				 way == 4 ? POKEYS_SERVO_TUNE_SILENT : POKEYS_SERVO_TUNE_STOPPED);
		assert_int_equal(world.last_event[EVENT_SERVO_TUNED].b, POKEYS_SERVO_TUNING_FAILED);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(each_drive_finds_its_gains, begin),
		cmocka_unit_test(a_dwell_is_no_part_of_the_motor),
		cmocka_unit_test(a_lost_packet_is_no_part_of_the_motor),
		cmocka_unit_test_setup(who_may_begin_it, begin),
		cmocka_unit_test(what_stops_a_motor_ends_it),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
