/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Gains by parameters: whose they are, what the daemon is asked for, and when. The daemon takes a
 * gain as this test plays it, or refuses it.
 */
#include "tests/halbridge/rig.h"

enum { X = 1, BED = 2 };

static struct rig rig;
static double *const gain = rig.values.servo[X].gain;
static double *const of_bed = rig.values.heater[BED].gain;
static unsigned int asked;
static bool refuses;

static float *gain_of(const struct pokeys_one_shot *shot)
{
	struct pokeys_servo *servo = &rig.daemon.servo[X];
	struct pokeys_heater *heater = &rig.daemon.heater[BED];
	float *const servos[] = {
		&servo->p, &servo->i, &servo->d, &servo->velocity_gain, &servo->acceleration_gain,
	};
	float *const heaters[] = { &heater->p, &heater->i, &heater->d };

	if (shot->operation == POKEYS_ONE_SHOT_SERVO_GAIN) {
		assert_int_equal(shot->index, X);
		assert_in_range(shot->mask, 0, POKEYS_GAIN_ACCELERATION);
		return servos[shot->mask];
	}
	assert_int_equal(shot->operation, POKEYS_ONE_SHOT_HEATER_GAIN);
	assert_int_equal(shot->index, BED);
	assert_in_range(shot->mask, 0, POKEYS_GAIN_D);
	return heaters[shot->mask];
}

/* As the daemon does: p and i are not both 0. */
static bool is_refused(const struct pokeys_one_shot *shot)
{
	const struct pokeys_servo *servo = &rig.daemon.servo[X];
	const float other = shot->mask == POKEYS_GAIN_P ? servo->i : servo->p;

	return refuses ||
	       (shot->operation == POKEYS_ONE_SHOT_SERVO_GAIN && shot->mask <= POKEYS_GAIN_I &&
		!(shot->parameter[0] > 0) && !(other > 0));
}

/* Periods of a daemon that does what it is asked for. */
static void run(unsigned int periods)
{
	while (periods--) {
		const struct pokeys_command *command = &rig.exchange.command;

		rig_period(&rig);
		for (uint32_t id = rig.daemon.one_shot_ack; id < rig.exchange.queue.head; id++) {
			const struct pokeys_one_shot *shot =
				&command->one_shot[id % POKEYS_ONE_SHOTS];

			const bool refused = is_refused(shot);

			asked++;
			if (!refused)
				*gain_of(shot) = shot->parameter[0];
			rig.daemon.one_shot[id % POKEYS_ONE_SHOT_RESULTS] =
				(struct pokeys_one_shot_result){
					.id = id,
					.operation = shot->operation,
					.outcome = refused ? POKEYS_OUTCOME_REFUSED :
							     POKEYS_OUTCOME_DONE,
				};
			rig.daemon.one_shot_ack = id + 1;
		}
	}
}

static void configure(void)
{
	rig.daemon.servo[X] = (struct pokeys_servo){
		.state = POKEYS_SERVO_OFF,
		.p = 0.3f,
		.d = 0.01f,
		.velocity_gain = 0.02f,
	};
	rig.daemon.heater[BED] = (struct pokeys_heater){
		.state = POKEYS_HEATER_OFF,
		.p = 22.2f,
		.i = 1.08f,
		.d = 114,
	};
}

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	configure();
	refuses = false;
	asked = 0;
	run(4);
	return 0;
}

static void until_they_are_set_they_are_those_of_the_daemon(void **state)
{
	(void)state;
	assert_true(gain[POKEYS_GAIN_P] == (double)0.3f && gain[POKEYS_GAIN_I] == 0);
	assert_true(gain[POKEYS_GAIN_VELOCITY] == (double)0.02f);
	assert_true(of_bed[POKEYS_GAIN_D] == 114);
	/* of a motor that pokeysd.conf does not have */
	assert_true(isnan(rig.values.servo[0].gain[0]));
	rig.daemon.servo[X].p = 0.5f;
	rig.daemon.heater[BED].i = 2;
	run(2);
	assert_true(gain[POKEYS_GAIN_P] == 0.5 && of_bed[POKEYS_GAIN_I] == 2);
	assert_int_equal(asked, 0);
}

static void one_that_is_set_is_asked_for_once(void **state)
{
	(void)state;
	gain[POKEYS_GAIN_P] = 0.7;
	gain[POKEYS_GAIN_ACCELERATION] = 1e-4;
	of_bed[POKEYS_GAIN_I] = 0.7;
	run(100);
	assert_int_equal(asked, 3);
	assert_true(rig.daemon.servo[X].p == 0.7f && rig.daemon.heater[BED].i == 0.7f);
	assert_true(rig.daemon.servo[X].acceleration_gain == 1e-4f);
	/* it stays as it was written, not as a float has it */
	assert_true(gain[POKEYS_GAIN_P] == 0.7 && of_bed[POKEYS_GAIN_I] == 0.7);
	gain[POKEYS_GAIN_P] = 0.7;
	run(10);
	assert_int_equal(asked, 3);
	assert_int_equal(rig.values.input_refused_count, 0);
}

static void the_next_daemon_is_asked_as_well(void **state)
{
	(void)state;
	gain[POKEYS_GAIN_D] = 0.05;
	run(10);
	assert_int_equal(asked, 1);
	rig.daemon.epoch++;
	rig.daemon.one_shot_ack = 0;
	memset(rig.daemon.one_shot, 0, sizeof(rig.daemon.one_shot));
	configure();
	run(10);
	assert_true(rig.daemon.servo[X].d == 0.05f);
	assert_true(rig.daemon.servo[X].p == 0.3f);
	assert_int_equal(asked, 2);
}

static void one_that_is_refused_goes_back(void **state)
{
	(void)state;
	refuses = true;
	gain[POKEYS_GAIN_P] = 1e30;
	run(100);
	assert_int_equal(asked, 1);
	assert_true(gain[POKEYS_GAIN_P] == (double)0.3f);
	rig_expect_note(&rig, TABLE_SERVOS,
			"pokeys.0.servo.01.pid-p = 1e+30: the daemon refuses this gain");
	refuses = false;
	gain[POKEYS_GAIN_P] = 0.4;
	run(10);
	assert_true(rig.daemon.servo[X].p == 0.4f);
}

static void one_that_is_given_back_follows_the_daemon(void **state)
{
	(void)state;
	gain[POKEYS_GAIN_P] = 0.4;
	run(10);
	gain[POKEYS_GAIN_P] = -1;
	run(10);
	assert_true(gain[POKEYS_GAIN_P] == (double)0.4f);
	rig.daemon.servo[X].p = 0.6f;
	run(3);
	assert_true(gain[POKEYS_GAIN_P] == (double)0.6f);
	gain[POKEYS_GAIN_P] = (double)NAN;
	run(3);
	assert_true(gain[POKEYS_GAIN_P] == (double)0.6f);
	assert_int_equal(asked, 1);
}

/* Whichever comes first, the other one is not 0 by then. */
static void p_and_i_are_exchanged(void **state)
{
	(void)state;
	gain[POKEYS_GAIN_P] = 0;
	gain[POKEYS_GAIN_I] = 5;
	run(10);
	assert_true(rig.daemon.servo[X].p == 0 && rig.daemon.servo[X].i == 5);
	assert_int_equal(asked, 2);
	gain[POKEYS_GAIN_P] = 0.5;
	gain[POKEYS_GAIN_I] = 0;
	run(10);
	assert_true(rig.daemon.servo[X].p == 0.5f && rig.daemon.servo[X].i == 0);
	assert_int_equal(rig.values.input_refused_count, 0);
}

/* Set before there is a daemon, and changed while one is asked for. */
static void the_newest_is_asked_for(void **state)
{
	(void)state;
	rig_init(&rig);
	rig.daemon_dead = true;
	rig.values.servo[X].gain[POKEYS_GAIN_P] = 0.1;
	run(5);
	assert_int_equal(asked, 0);
	rig.daemon_dead = false;
	configure();
	for (unsigned int i = 0; i < 50; i++) {
		gain[POKEYS_GAIN_P] = 0.1 + i * 0.01;
		run(1);
	}
	run(5);
	assert_true(rig.daemon.servo[X].p == (float)gain[POKEYS_GAIN_P]);
	assert_true(fabs(gain[POKEYS_GAIN_P] - 0.59) < 1e-9);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(until_they_are_set_they_are_those_of_the_daemon, setup),
		cmocka_unit_test_setup(one_that_is_set_is_asked_for_once, setup),
		cmocka_unit_test_setup(the_next_daemon_is_asked_as_well, setup),
		cmocka_unit_test_setup(one_that_is_refused_goes_back, setup),
		cmocka_unit_test_setup(one_that_is_given_back_follows_the_daemon, setup),
		cmocka_unit_test_setup(p_and_i_are_exchanged, setup),
		cmocka_unit_test_setup(the_newest_is_asked_for, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
