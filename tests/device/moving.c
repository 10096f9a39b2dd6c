/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Servo motors go along a path together: they keep to it and end where it ends; what is refused,
 * and why; what ends it, and that the commander's position of before brings none of them back.
 */

#include <math.h>
#include "tests/device/servo_rig.h"

enum { COUNTS = 400, ALL = 7 };

static void prepare(void)
{
	servo_prepare(NULL);
	world.config.corner_deviation = 0.01;
	for (unsigned int i = 0; i < MOTORS; i++) {
		world.config.servo[i].acceleration = 1000;
		world.config.servo[i].servo.speed_most = 100;
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

static struct pokeys_one_shot move_of(uint8_t motors, double one, double two, double three,
				      double speed)
{
	return (struct pokeys_one_shot){
		.operation = POKEYS_ONE_SHOT_MOVE,
		.mask = motors,
		.flags = POKEYS_MOVE_BEGINS,
		.value = { (int32_t)lround(one * COUNTS), (int32_t)lround(two * COUNTS),
			   (int32_t)lround(three * COUNTS) },
		.parameter = { (float)speed },
	};
}

static enum pokeys_outcome move(uint8_t motors, double one, double two, double three, double speed)
{
	const struct pokeys_one_shot shot = move_of(motors, one, two, three, speed);

	return world_do(&world, &shot, 1 * SECOND);
}

/* One that goes on from the move before. */
static enum pokeys_outcome move_on(uint8_t motors, double one, double speed)
{
	struct pokeys_one_shot shot = move_of(motors, one, one, one, speed);

	shot.flags = 0;
	return world_do(&world, &shot, 1 * SECOND);
}

static struct pokeys_one_shot control_of(enum pokeys_moves_control which, double value)
{
	return (struct pokeys_one_shot){
		.operation = POKEYS_ONE_SHOT_MOVES_CONTROL,
		.index = (uint8_t)which,
		.parameter = { (float)value },
	};
}

static enum pokeys_outcome control(enum pokeys_moves_control which, double value)
{
	const struct pokeys_one_shot shot = control_of(which, value);

	return world_do(&world, &shot, 1 * SECOND);
}

static const struct pokeys_moves *moves(void)
{
	return &world.state.moves;
}

static bool is_near(unsigned int motor, double place)
{
	return fabs(servo_shown(motor)->position - place) < 0.05;
}

static void assert_at(double one, double two, double three)
{
	assert_true(is_near(0, one) && is_near(1, two) && is_near(2, three));
	/* and so are the shafts, whatever is shown; a turn is 5 units */
	assert_true(fabs(servo_motor(SIGN)->angle / (2 * M_PI) * 5 - one) < 0.05);
}

static void until_over(void)
{
	for (unsigned int k = 0; moves()->waiting; k++) {
		assert_true(k < 60000);
		servo_cycle();
	}
	servo_run(300 * MS);
}

static void refuses(enum pokeys_outcome outcome, enum pokeys_moves_refusal why)
{
	assert_int_equal(outcome, POKEYS_OUTCOME_REFUSED);
	assert_int_equal(moves()->refused, why);
}

static void they_go_together(void **state)
{
	double off = 0;

	(void)state;
	assert_int_equal(moves()->state, POKEYS_MOVES_IDLE);
	assert_int_equal(move(ALL, 20, 10, -5, 40), POKEYS_OUTCOME_DONE);
	assert_int_equal(move(3, 20, 30, 0, 40), POKEYS_OUTCOME_DONE);
	assert_int_equal(moves()->state, POKEYS_MOVES_MOVING);
	assert_int_equal(moves()->motors, ALL);
	while (moves()->waiting == 2) {
		servo_cycle();
		off = fmax(off, fabs(servo_shown(0)->position - 2 * servo_shown(1)->position));
	}
	/* on the line, but for the following error */
	assert_true(off < 1);
	until_over();
	assert_at(20, 30, -5);
	assert_int_equal(moves()->end, POKEYS_MOVES_DONE);
	assert_int_equal(moves()->taken, 2);
	assert_int_equal(world.event_count[EVENT_MOVES], 0);
	/* moves are no events */
	assert_int_equal(world.event_count[EVENT_ONE_SHOT], 0);
}

/* The commander's position is still that of before. */
static void they_stay_until_the_commander_is_there(void **state)
{
	(void)state;
	assert_int_equal(move(ALL, 5, 6, 7, 40), POKEYS_OUTCOME_DONE);
	until_over();
	servo_run(2 * SECOND);
	assert_at(5, 6, 7);
	assert_int_equal(moves()->state, POKEYS_MOVES_HANDOVER);
	for (unsigned int i = 0; i < MOTORS; i++) {
		world.command.servo[i].position = servo_shown(i)->commanded;
		servo_run(150 * MS);
		assert_int_equal(moves()->motors, ALL << (i + 1) & ALL);
	}
	assert_int_equal(moves()->state, POKEYS_MOVES_IDLE);
	for (unsigned int k = 0; k < 500; k++) {
		for (unsigned int i = 0; i < MOTORS; i++)
			world.command.servo[i].position += 0.01;
		servo_cycle();
	}
	servo_run(200 * MS);
	assert_at(10, 11, 12);
	/* and again from here */
	assert_int_equal(move(1, 0, 0, 0, 40), POKEYS_OUTCOME_DONE);
	until_over();
	assert_at(0, 11, 12);
	assert_int_equal(moves()->motors, 1);
}

static void what_cannot_be_moved_is_refused(void **state)
{
	(void)state;
	refuses(move(0, 1, 1, 1, 10), POKEYS_MOVES_ODD);
	refuses(move(8, 1, 1, 1, 10), POKEYS_MOVES_ODD);
	refuses(move(ALL, 1, 1, 1, -1), POKEYS_MOVES_ODD);
	refuses(move(ALL, 1, 1, 1, NAN), POKEYS_MOVES_ODD);
	world.command.servo[1].enable = 0;
	servo_run(10 * MS);
	refuses(move(ALL, 1, 1, 1, 10), POKEYS_MOVES_OFF);
	assert_int_equal(move(5, 1, 1, 0, 10), POKEYS_OUTCOME_DONE);
	until_over();
	assert_at(1, 0, 1);
	assert_int_equal(moves()->refused, POKEYS_MOVES_TAKEN);
	/* soft limits are those of an axis that is homed */
	assert_int_equal(move(4, -101, 0, 0, 0), POKEYS_OUTCOME_DONE);
	until_over();
	world.command.servo[2].enable = 0;
	servo_run(10 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, 2, 0, POKEYS_SERVO_HOMED),
			 POKEYS_OUTCOME_DONE);
	servo_enable(2);
	refuses(move(4, 100.1, 0, 0, 10), POKEYS_MOVES_LIMIT);
	assert_int_equal(move(4, 3, 0, 0, 10), POKEYS_OUTCOME_DONE);
	until_over();
	assert_true(is_near(2, 3));
}

static void a_full_queue_loses_nothing(void **state)
{
	(void)state;
	assert_int_equal(control(POKEYS_MOVES_HOLD, 0), POKEYS_OUTCOME_DONE);
	assert_true(moves()->held);
	/* what is refused changes nothing */
	assert_int_equal(control(POKEYS_MOVES_STOP, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(control(POKEYS_MOVES_ABORT, 0), POKEYS_OUTCOME_REFUSED);
	assert_true(moves()->held);
	for (unsigned int i = 1; i <= POKEYS_MOVES; i++)
		assert_int_equal(move(1, i, 0, 0, 20), POKEYS_OUTCOME_DONE);
	refuses(move(1, 90, 0, 0, 20), POKEYS_MOVES_FULL);
	assert_int_equal(world.event_count[EVENT_ONE_SHOT], 3);
	assert_int_equal(moves()->waiting, POKEYS_MOVES);
	assert_int_equal(moves()->state, POKEYS_MOVES_HELD);
	servo_run(500 * MS);
	assert_at(0, 0, 0);
	assert_int_equal(control(POKEYS_MOVES_RESUME, 0), POKEYS_OUTCOME_DONE);
	until_over();
	assert_at(POKEYS_MOVES, 0, 0);
}

/* Moves sent after a refused one would begin at another place. */
static void after_one_that_is_refused_none_is_taken(void **state)
{
	(void)state;
	refuses(move_on(1, 1, 10), POKEYS_MOVES_BROKEN);
	assert_int_equal(move(1, 1, 0, 0, 10), POKEYS_OUTCOME_DONE);
	assert_int_equal(move_on(1, 2, 10), POKEYS_OUTCOME_DONE);
	refuses(move_on(1, 3, NAN), POKEYS_MOVES_ODD);
	refuses(move_on(1, 4, 10), POKEYS_MOVES_ODD);
	refuses(move_on(1, 5, 10), POKEYS_MOVES_ODD);
	until_over();
	assert_at(2, 0, 0);
	assert_int_equal(moves()->end, POKEYS_MOVES_DONE);
	assert_int_equal(move(1, 3, 0, 0, 10), POKEYS_OUTCOME_DONE);
	until_over();
	/* one that has ended where it should goes on */
	assert_int_equal(move_on(1, 4, 10), POKEYS_OUTCOME_DONE);
	servo_run(50 * MS);
	assert_int_equal(control(POKEYS_MOVES_ABORT, 0), POKEYS_OUTCOME_DONE);
	servo_run(200 * MS);
	refuses(move_on(1, 5, 10), POKEYS_MOVES_BROKEN);
	assert_int_equal(move(1, 5, 0, 0, 10), POKEYS_OUTCOME_DONE);
	until_over();
	assert_at(5, 0, 0);
}

/* A soft limit between two counts is that of the nearer one, and no further. */
static void a_limit_between_two_counts_can_be_reached(void **state)
{
	struct pokeys_one_shot shot;

	(void)state;
	servo_prepare(NULL);
	for (unsigned int i = 0; i < MOTORS; i++)
		world.config.servo[i].acceleration = 1000;
	world.config.servo[0].servo.scale = 819.2;
	world.config.servo[0].servo.most = 3;
	servo_start();
	servo_enable_all();
	world.command.servo[0].enable = 0;
	servo_run(10 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, 0, 0, POKEYS_SERVO_HOMED),
			 POKEYS_OUTCOME_DONE);
	servo_enable(0);
	/* 3 units are 2457.6 counts */
	refuses(move(1, 2459.0 / COUNTS, 0, 0, 10), POKEYS_MOVES_LIMIT);
	assert_int_equal(move(1, 2458.0 / COUNTS, 0, 0, 10), POKEYS_OUTCOME_DONE);
	until_over();
	assert_true(is_near(0, 3));
	assert_int_equal(servo_shown(0)->state, POKEYS_SERVO_ENABLED);
	assert_true(servo_shown(0)->commanded <= 3);
	/* parts of a count are none of the encoder, but of a path */
	shot = move_of(1, -800.0 / COUNTS, 0, 0, 10);
	shot.fraction[0] = 64;
	assert_int_equal(world_do(&world, &shot, 1 * SECOND), POKEYS_OUTCOME_DONE);
	until_over();
	assert_true(fabs(servo_shown(0)->commanded + 799.75 / 819.2) < 1e-9);
}

/* What one motor does by itself while the others slow down is no part of the next path. */
static void a_motor_that_was_off_begins_where_it_is(void **state)
{
	struct pokeys_one_shot shot;
	double before;

	(void)state;
	assert_int_equal(move(3, 90, 90, 0, 60), POKEYS_OUTCOME_DONE);
	servo_run(300 * MS);
	world.command.servo[1].enable = 0;
	servo_run(3 * MS);
	world.command.servo[1].position = servo_shown(1)->position;
	world.command.servo[1].enable = 1;
	servo_run(10 * MS);
	assert_int_equal(servo_shown(1)->state, POKEYS_SERVO_ENABLED);
	assert_int_equal(moves()->state, POKEYS_MOVES_ABORTING);
	world.command.servo[1].velocity = 0;
	servo_run(10 * MS);
	before = servo_shown(1)->commanded;
	shot = control_of(POKEYS_MOVES_STOP, 0);
	world_one_shot(&world, &shot);
	shot = move_of(3, 90, 90, 0, 60);
	world_one_shot(&world, &shot);
	for (unsigned int k = 0; k < 5; k++) {
		servo_cycle();
		assert_true(fabs(servo_shown(1)->commanded - before) < 0.1);
	}
}

static void who_else_moves_a_motor_keeps_it(void **state)
{
	(void)state;
	world.command.servo[0].velocity = 10;
	for (unsigned int k = 0; k < 100; k++) {
		world.command.servo[0].position += 0.01;
		servo_cycle();
	}
	refuses(move(1, 5, 0, 0, 10), POKEYS_MOVES_COMMANDED);
	world.command.servo[0].velocity = 0;
	servo_run(100 * MS);
	assert_int_equal(move(1, 5, 0, 0, 10), POKEYS_OUTCOME_DONE);
	servo_run(50 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_HOME, 0, 0, 0), POKEYS_OUTCOME_REFUSED);
}

static void it_can_be_held_slowed_and_ended(void **state)
{
	double at;

	(void)state;
	assert_int_equal(move(1, 90, 0, 0, 40), POKEYS_OUTCOME_DONE);
	servo_run(300 * MS);
	assert_true(fabs((double)moves()->speed - 40) < 0.01);
	assert_int_equal(control(POKEYS_MOVES_FEED, 0.5), POKEYS_OUTCOME_DONE);
	servo_run(100 * MS);
	assert_true(fabs((double)moves()->speed - 20) < 0.01);
	assert_true(fabs((double)moves()->feed - 0.5) < 1e-6);
	assert_int_equal(control(POKEYS_MOVES_FEED, 2.5), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(control(POKEYS_MOVES_FEED, NAN), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(control(POKEYS_MOVES_HOLD, 0), POKEYS_OUTCOME_DONE);
	servo_run(100 * MS);
	assert_true(moves()->speed == 0);
	assert_int_equal(moves()->state, POKEYS_MOVES_HELD);
	assert_int_equal(control(POKEYS_MOVES_RESUME, 0), POKEYS_OUTCOME_DONE);
	servo_run(100 * MS);
	assert_int_equal(control(POKEYS_MOVES_ABORT, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(moves()->end, POKEYS_MOVES_ABORTED);
	assert_int_equal(world.last_event[EVENT_MOVES].a, POKEYS_MOVES_ABORTED);
	servo_run(200 * MS);
	at = servo_shown(0)->position;
	assert_int_equal(moves()->waiting, 0);
	assert_int_equal(control(POKEYS_MOVES_ABORT, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(control(POKEYS_MOVES_STOP, 0), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(control((enum pokeys_moves_control)5, 0), POKEYS_OUTCOME_REFUSED);
	servo_run(500 * MS);
	assert_true(is_near(0, at));
	/* at once: where it was commanded to be in that cycle */
	assert_int_equal(move(1, 90, 0, 0, 40), POKEYS_OUTCOME_DONE);
	servo_run(200 * MS);
	assert_int_equal(control(POKEYS_MOVES_STOP, 0), POKEYS_OUTCOME_DONE);
	at = servo_shown(0)->commanded;
	servo_run(300 * MS);
	assert_true(is_near(0, at));
	assert_int_equal(servo_shown(0)->state, POKEYS_SERVO_ENABLED);
}

/* The path of all of them is none any more. */
static void a_fault_of_one_ends_it_for_all(void **state)
{
	(void)state;
	assert_int_equal(move(ALL, 90, 90, 90, 60), POKEYS_OUTCOME_DONE);
	assert_int_equal(move(ALL, 0, 0, 0, 60), POKEYS_OUTCOME_DONE);
	servo_run(300 * MS);
	sim_motor_break(servo_motor(1), SIM_MOTOR_STALLED);
	servo_expect_fault(1, POKEYS_SERVO_FOLLOWING, 200 * MS);
	servo_run(2 * MS);
	assert_int_equal(moves()->state, POKEYS_MOVES_ABORTING);
	assert_int_equal(moves()->end, POKEYS_MOVES_STOPPED);
	assert_int_equal(world.last_event[EVENT_MOVES].b, 1);
	refuses(move(1, 0, 0, 0, 60), POKEYS_MOVES_ENDING);
	servo_run(500 * MS);
	assert_int_equal(moves()->waiting, 0);
	assert_int_equal(moves()->motors, 5);
	for (unsigned int i = 0; i < MOTORS; i += 2) {
		assert_int_equal(servo_shown(i)->state, POKEYS_SERVO_ENABLED);
		assert_true(servo_shown(i)->position > 5 && servo_shown(i)->position < 30);
		assert_true(fabs((double)servo_shown(i)->velocity) < 0.1);
	}
	assert_int_equal(world.event_count[EVENT_MOVES], 1);
}

static void it_ends_with_its_commander(void **state)
{
	(void)state;
	for (unsigned int way = 0; way < 3; way++) {
		prepare();
		assert_int_equal(move(ALL, 90, 90, 90, 60), POKEYS_OUTCOME_DONE);
		assert_int_equal(control(POKEYS_MOVES_FEED, 0.5), POKEYS_OUTCOME_DONE);
		servo_run(200 * MS);
		if (way == 0)
			world_commander(&world, 6);
		else if (way == 1)
			world.commanding = false;
		else
			world.command.flags |= POKEYS_COMMAND_EMERGENCY;
		servo_expect_off(120 * MS);
		assert_int_equal(moves()->waiting, 0);
		assert_int_equal(moves()->motors, 0);
		assert_int_equal(moves()->end, POKEYS_MOVES_STOPPED);
	}
	/* what was slowed down was so for that commander */
	prepare();
	assert_int_equal(control(POKEYS_MOVES_FEED, 0.5), POKEYS_OUTCOME_DONE);
	world_commander(&world, 6);
	servo_run(100 * MS);
	assert_true(fabs((double)moves()->feed - 1) < 1e-6);
}

/* One that is homing holds its place at the end, from where it may be moved. */
static void homing_and_moves_follow_each_other(void **state)
{
	struct servoing_config *config;

	(void)state;
	servo_prepare(NULL);
	config = &world.config.servo[SIGN];
	for (unsigned int i = 0; i < MOTORS; i++)
		world.config.servo[i].acceleration = 1000;
	config->home = (struct servo_home_config){
		.search = -20,
		.latch = 2,
		.acceleration = 1000,
		.position = 5,
		.distance = 40,
	};
	config->home_pin = LOW_PIN;
	config->home_inverted = true;
	servo_start();
	sim_bench_pin(&world.rig.device, LOW_PIN, true);
	sim_bench_pin(&world.rig.device, HIGH_PIN, true);
	servo_run(20 * MS);
	servo_enable_all();
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_HOME, SIGN, 0, 0), POKEYS_OUTCOME_DONE);
	refuses(move(1, 5, 0, 0, 10), POKEYS_MOVES_HOMING);
	for (unsigned int k = 0; servo_shown(SIGN)->home_end == POKEYS_SERVO_HOME_NONE; k++) {
		const double place = servo_motor(SIGN)->angle / (2 * M_PI) * 5;

		assert_true(k < 30000);
		sim_bench_pin(&world.rig.device, LOW_PIN, place > -8);
		servo_cycle();
	}
	assert_int_equal(servo_shown(SIGN)->home_end, POKEYS_SERVO_HOME_DONE);
	servo_run(50 * MS);
	assert_int_equal(move(3, 12, 4, 0, 10), POKEYS_OUTCOME_DONE);
	assert_int_equal(servo_shown(SIGN)->homing, POKEYS_SERVO_HOMING_NONE);
	until_over();
	assert_true(is_near(0, 12) && is_near(1, 4));
	/* and home again, from where the path has left it */
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_HOME, SIGN, 0, 0), POKEYS_OUTCOME_DONE);
	servo_run(100 * MS);
	assert_int_equal(moves()->motors, 2);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(they_go_together, begin),
		cmocka_unit_test_setup(they_stay_until_the_commander_is_there, begin),
		cmocka_unit_test_setup(what_cannot_be_moved_is_refused, begin),
		cmocka_unit_test_setup(a_full_queue_loses_nothing, begin),
		cmocka_unit_test_setup(after_one_that_is_refused_none_is_taken, begin),
		cmocka_unit_test(a_limit_between_two_counts_can_be_reached),
		cmocka_unit_test_setup(a_motor_that_was_off_begins_where_it_is, begin),
		cmocka_unit_test_setup(who_else_moves_a_motor_keeps_it, begin),
		cmocka_unit_test_setup(it_can_be_held_slowed_and_ended, begin),
		cmocka_unit_test_setup(a_fault_of_one_ends_it_for_all, begin),
		cmocka_unit_test(it_ends_with_its_commander),
		cmocka_unit_test(homing_and_moves_follow_each_other),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
