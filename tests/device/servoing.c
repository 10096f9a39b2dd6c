/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Servo motors follow their commander, and stop whenever something is lost. */

#include <math.h>
#include "tests/device/servo_rig.h"

static void they_follow_a_path(void **state)
{
	double most = 0;

	(void)state;
	assert_string_equal(servo_shown(SIGN)->name, "x");
	assert_int_equal(servo_shown(MOTORS)->state, POKEYS_SERVO_NONE);
	servo_enable_all();
	servo_move(20, 100);
	servo_move(-20, 200);
	for (unsigned int i = 0; i < 300; i++) {
		servo_cycle();
		for (unsigned int k = 0; k < MOTORS; k++)
			most = fmax(most, i < 200 ? 0 : fabs((double)servo_shown(k)->error));
	}
	for (unsigned int i = 0; i < MOTORS; i++) {
		assert_true(fabs(servo_shown(i)->position + 20) < 0.02);
		assert_true(fabs(sim_motor_count(servo_motor(i)) + 20 * 400.0) < 9);
		assert_true(servo_shown(i)->commanded == -20);
		assert_int_equal(servo_shown(i)->fault_count, 0);
	}
	assert_true(most < 0.02);
	assert_int_equal(world.event_count[EVENT_SERVO], 0);
	for (unsigned int i = 0; i < MOTORS; i++)
		world.command.servo[i].enable = 0;
	servo_cycle();
	servo_expect_off(1 * MS);
	assert_false(world_latch(&world, servo_enable_pin[SIGN]));
	assert_int_equal(world.rig.device.config.pwm.duty[1], PWM_PERIOD / 2);
}

static void the_error_on_the_way_is_small(void **state)
{
	double most = 0;

	(void)state;
	servo_enable_all();
	for (unsigned int i = 0; i < 2000; i++) {
		for (unsigned int k = 0; k < MOTORS; k++)
			world.command.servo[k].position = 10 * (1 - cos(i * 0.001 * 2 * M_PI));
		servo_cycle();
		for (unsigned int k = 0; k < MOTORS; k++)
			most = fmax(most, fabs((double)servo_shown(k)->error));
	}
	assert_true(most < 0.4);
	assert_int_equal(world.event_count[EVENT_SERVO], 0);
}

/* ... and what it is enabled with is where it is. */
static void it_is_enabled_only_after_off_and_where_it_is(void **state)
{
	(void)state;
	world.command.servo[SIGN].position = 3;
	world.command.servo[SIGN].enable = 1;
	servo_run(10 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_OFF);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_ELSEWHERE);
	assert_int_equal(world.last_event[EVENT_SERVO_REFUSED].b, POKEYS_SERVO_ELSEWHERE);
	world.command.servo[SIGN].position = 0;
	servo_run(10 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_OFF);
	servo_enable(SIGN);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_TAKEN);
	/* a commander that begins with "on" */
	world_commander(&world, 6);
	world.command.servo[SIGN].velocity = NAN;
	world.command.servo[SIGN].enable = 1;
	servo_run(20 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_OFF);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_OFF_FIRST);
	servo_expect_off(0);
}

static void a_commander_that_does_not_read_enables_nothing(void **state)
{
	(void)state;
	world.unread = true;
	world.command.t_thread_ns = 0;
	servo_run(10 * MS);
	world.command.servo[SIGN].enable = 1;
	servo_run(10 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_OFF);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_UNREAD);
	assert_int_equal(world.last_event[EVENT_SERVO_REFUSED].b, POKEYS_SERVO_UNREAD);
	servo_expect_off(0);
	/* it reads again, and has not commanded off */
	world.unread = false;
	servo_run(20 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_OFF);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_UNREAD);
	servo_enable(SIGN);
}

/* A commander gives an edge again that was refused as unread. A loss or a stop ends that reason. */
static void what_a_loss_has_ended_is_not_called_unread(void **state)
{
	for (int refused_before = 0; refused_before < 2; refused_before++) {
		servo_begin(state);
		if (!refused_before)
			servo_enable(SIGN);
		world.unread = true;
		servo_run(200 * MS);
		world.command.servo[SIGN].enable = 1;
		servo_run(10 * MS);
		assert_int_equal(servo_shown(SIGN)->refused,
				 refused_before ? POKEYS_SERVO_UNREAD : POKEYS_SERVO_TAKEN);
		/* its heartbeat is late, and the images after that are of the look before */
		world.commanding = false;
		servo_run(500 * MS);
		world.commanding = true;
		servo_run(20 * MS);
		assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_OFF);
		assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_OFF_FIRST);
	}
}

static void what_a_stop_has_ended_is_not_called_unread(void **state)
{
	(void)state;
	world.unread = true;
	world.command.t_thread_ns = 0;
	servo_run(10 * MS);
	world.command.servo[SIGN].enable = 1;
	servo_run(10 * MS);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_UNREAD);
	world.command.flags = POKEYS_COMMAND_EMERGENCY;
	servo_run(10 * MS);
	world.command.flags = 0;
	servo_run(10 * MS);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_OFF_FIRST);
}

static void a_broken_motor_is_a_fault_until_it_is_reset(void **state)
{
	static const struct {
		enum sim_motor_fault broken;
		enum pokeys_servo_fault fault;
	} ways[] = {
		{ SIM_MOTOR_STALLED, POKEYS_SERVO_FOLLOWING },
		{ SIM_MOTOR_CUT, POKEYS_SERVO_FOLLOWING },
	};

	for (unsigned int i = 0; i < sizeof(ways) / sizeof(ways[0]); i++) {
		servo_begin(state);
		servo_enable_all();
		servo_move(5, 100);
		sim_motor_break(servo_motor(ANTIPHASE), ways[i].broken);
		servo_move(10, 100);
		servo_expect_fault(ANTIPHASE, ways[i].fault, 100 * MS);
		assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
		sim_motor_break(servo_motor(ANTIPHASE), SIM_MOTOR_GOOD);
		/* "on" all the time resets nothing, nor does off */
		world.command.servo[ANTIPHASE].enable = 0;
		servo_run(20 * MS);
		assert_int_equal(servo_shown(ANTIPHASE)->state, POKEYS_SERVO_FAULT);
		assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_RESET, ANTIPHASE, 0, 0),
				 POKEYS_OUTCOME_DONE);
		servo_run(5 * MS);
		assert_int_equal(servo_shown(ANTIPHASE)->state, POKEYS_SERVO_OFF);
		servo_enable(ANTIPHASE);
		assert_int_equal(servo_shown(ANTIPHASE)->fault_count, 1);
	}
}

/* No voltage is left in the cycle that finds it: one cycle after the encoder has shown it. */
static void an_encoder_that_counts_backwards_stops_it(void **state)
{
	double from;

	(void)state;
	servo_enable_all();
	servo_run(100 * MS);
	sim_motor_break(servo_motor(TWO_PWM), SIM_MOTOR_REVERSED);
	from = servo_motor(TWO_PWM)->angle;
	servo_motor(TWO_PWM)->torque = 0.05;
	while (!servo_shown(TWO_PWM)->fault)
		servo_cycle();
	servo_motor(TWO_PWM)->torque = 0;
	servo_expect_fault(TWO_PWM, (enum pokeys_servo_fault)servo_shown(TWO_PWM)->fault, 0);
	assert_in_range(servo_shown(TWO_PWM)->fault, POKEYS_SERVO_FOLLOWING, POKEYS_SERVO_RUNAWAY);
	assert_true(fabs(servo_motor(TWO_PWM)->angle - from) / (2 * M_PI) < 1);
}

static void a_lost_device_stops_them_itself_and_they_are_not_homed(void **state)
{
	(void)state;
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, SIGN, 2000, POKEYS_SERVO_HOMED),
			 POKEYS_OUTCOME_DONE);
	servo_run(2 * MS);
	assert_true(servo_shown(SIGN)->homed && servo_shown(SIGN)->position == 5);
	servo_enable(SIGN);
	servo_motor(SIGN)->torque = 0.1; /* so that there is voltage */
	servo_run(200 * MS);
	assert_true(fabs(servo_output(SIGN)) > 0.02);
	sim_rig_silence(&world.rig, world.now, 1500 * MS);
	servo_run(30 * MS);
	assert_int_equal(servo_shown(SIGN)->fault, POKEYS_SERVO_STALE);
	servo_motor(SIGN)->torque = 0;
	servo_run(1170 * MS);
	assert_true(fabs(servo_output(SIGN)) <= 0);
	servo_run(400 * MS);
	world_until(&world, world_is_running, 3 * SECOND);
	servo_expect_off(5 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_FAULT);
	assert_false(servo_shown(SIGN)->homed);
}

static void a_device_that_was_restarted_keeps_them_off(void **state)
{
	(void)state;
	servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, SIGN, 2000, POKEYS_SERVO_HOMED);
	servo_enable_all();
	servo_push_all();
	sim_device_reboot(&world.rig.device, world_device_time(&world), false);
	servo_run(1 * SECOND);
	world_until(&world, world_is_running, 3 * SECOND);
	servo_expect_off(5 * MS);
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_int_equal(servo_shown(i)->state, POKEYS_SERVO_FAULT);
	assert_false(servo_shown(SIGN)->homed);
}

static void without_a_commander_they_are_off(void **state)
{
	(void)state;
	servo_enable_all();
	servo_push_all();
	world.commanding = false;
	servo_run(110 * MS); /* heartbeat-timeout-ms */
	servo_expect_off(0);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_OFF);
	assert_int_equal(world.event_count[EVENT_SERVO_LEFT], MOTORS);
	world_until(&world, world_is_safe, 1 * SECOND);
	/* it is back, and commands what it commanded before */
	world.commanding = true;
	servo_run(100 * MS);
	servo_expect_off(0);
	servo_enable(SIGN);
}

static void an_emergency_stop_is_a_fault(void **state)
{
	(void)state;
	servo_enable_all();
	servo_push_all();
	world.config.emergency_holds = true;
	world.command.flags |= POKEYS_COMMAND_EMERGENCY;
	servo_run(2 * MS);
	servo_expect_off(0);
	assert_int_equal(servo_shown(SIGN)->fault, POKEYS_SERVO_EMERGENCY);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_RESET, SIGN, 0, 0), POKEYS_OUTCOME_REFUSED);
	/* the reset comes with what ends the emergency */
	world.command.flags = 0;
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_RESET, SIGN, 0, 0), POKEYS_OUTCOME_DONE);
	servo_expect_off(0);
	servo_enable(SIGN);
}

static void the_end_of_the_daemon_stops_them(void **state)
{
	(void)state;
	servo_enable_all();
	servo_push_all();
	device_stop(world.device, world.now);
	world_until(&world, world_is_stopped, 100 * MS);
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_true(fabs(servo_output(i)) <= 0);
	assert_true(world_is_safe(&world));
	assert_int_equal(world.event_count[EVENT_SERVO], 0);
}

static void limits_stop_it_and_let_it_return(void **state)
{
	(void)state;
	servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, TWO_PWM, 99 * 400, POKEYS_SERVO_HOMED);
	servo_enable(TWO_PWM);
	world.command.servo[TWO_PWM].position = 100.2;
	servo_expect_fault(TWO_PWM, POKEYS_SERVO_SOFT_LIMIT, 2 * MS);
	servo_enable(SIGN);
	sim_bench_pin(&world.rig.device, HIGH_PIN, 0);
	servo_run(3 * MS);
	assert_int_equal(servo_shown(SIGN)->fault, POKEYS_SERVO_SWITCH);
	assert_true(servo_shown(SIGN)->high && !servo_shown(SIGN)->low);
	servo_expect_off(1 * MS);
	world.command.servo[SIGN].enable = 0;
	servo_run(5 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_RESET, SIGN, 0, 0), POKEYS_OUTCOME_DONE);
	servo_enable(SIGN);
	for (unsigned int i = 0; i < 100; i++) {
		world.command.servo[SIGN].position -= 0.02;
		servo_cycle();
	}
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
}

static bool is_output(const uint8_t *packet)
{
	return packet[1] == 0xCB || packet[1] == 0xCC;
}

static void swallow_outputs(struct world *w, const uint8_t *packet)
{
	w->swallow = is_output(packet);
}

/* Everything else is answered, which keeps the device's failsafe quiet. */
static void an_off_that_never_arrives_is_left_to_the_device(void **state)
{
	(void)state;
	servo_prepare(state);
	world.config.stale_after_ns = 10 * SECOND;
	for (unsigned int i = 0; i < MOTORS; i++)
		world.config.servo[i].servo.stale_ns = 100 * MS;
	servo_start();
	servo_enable(SIGN);
	servo_motor(SIGN)->torque = 0.1;
	servo_run(200 * MS);
	assert_true(fabs(servo_output(SIGN)) > 0.02);
	servo_motor(SIGN)->torque = 0;
	world.watch = swallow_outputs;
	world.command.servo[SIGN].enable = 0;
	servo_run(5 * MS);
	assert_true(fabs(servo_output(SIGN)) > 0);
	servo_run(1500 * MS);
	servo_expect_off(0);
	assert_int_equal(world.event_count[EVENT_SERVO_UNHEARD], 1);
	world.watch = NULL;
	world_until(&world, world_is_running, 5 * SECOND);
	servo_expect_off(5 * MS);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(they_follow_a_path, servo_begin),
		cmocka_unit_test_setup(the_error_on_the_way_is_small, servo_begin),
		cmocka_unit_test_setup(it_is_enabled_only_after_off_and_where_it_is, servo_begin),
		cmocka_unit_test_setup(a_commander_that_does_not_read_enables_nothing, servo_begin),
		cmocka_unit_test(what_a_loss_has_ended_is_not_called_unread),
		cmocka_unit_test_setup(what_a_stop_has_ended_is_not_called_unread, servo_begin),
		cmocka_unit_test_setup(a_broken_motor_is_a_fault_until_it_is_reset, servo_begin),
		cmocka_unit_test_setup(an_encoder_that_counts_backwards_stops_it, servo_begin),
		cmocka_unit_test_setup(a_lost_device_stops_them_itself_and_they_are_not_homed,
				       servo_begin),
		cmocka_unit_test_setup(a_device_that_was_restarted_keeps_them_off, servo_begin),
		cmocka_unit_test_setup(without_a_commander_they_are_off, servo_begin),
		cmocka_unit_test_setup(an_emergency_stop_is_a_fault, servo_begin),
		cmocka_unit_test_setup(the_end_of_the_daemon_stops_them, servo_begin),
		cmocka_unit_test_setup(limits_stop_it_and_let_it_return, servo_begin),
		cmocka_unit_test(an_off_that_never_arrives_is_left_to_the_device),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
