/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Servo motors when it is not certain which device answers, what its counters count, what its
 * outputs are, or who commands.
 */

#include <math.h>
#include "tests/device/servo_rig.h"
#include "wire/encoder.h"
#include "wire/system.h"

static void home(unsigned int motor)
{
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_PLACE, motor, 400, POKEYS_SERVO_HOMED),
			 POKEYS_OUTCOME_DONE);
	servo_run(5 * MS);
	assert_true(servo_shown(motor)->homed);
}

/* No duty arrives, nor is one read back. */
static void swallow_pwm(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCB;
}

static unsigned int identities;

/* Who it is is asked, and answered once. */
static void answer_who_once(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCF || (packet[1] == 0x00 && identities++ > 0);
}

/* Motors that bear old readings. */
static void begin_patient(void **state)
{
	servo_prepare(state);
	for (unsigned int i = 0; i < MOTORS; i++)
		world.config.servo[i].servo.stale_ns = 100 * MS;
	servo_start();
}

/* They have voltage, and everything is answered but who it is: once that was another one. */
static void begin_doubt(void **state)
{
	begin_patient(state);
	servo_enable_all();
	servo_push_all();
	world.rig.device.config.identity.locked = 1;
	identities = 0;
	world.watch = answer_who_once;
	while (!identities)
		servo_cycle();
}

static void a_motor_does_not_go_on_while_its_device_is_in_doubt(void **state)
{
	begin_doubt(state);
	servo_run(90 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	servo_run(20 * MS);
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_int_equal(servo_shown(i)->fault, POKEYS_SERVO_STALE);
	servo_expect_off(0);
	assert_int_equal(world.event_count[EVENT_SERVO_UNHEARD], 0);
}

/* So is what is switched off meanwhile; nothing else is written. */
static void off_is_written_in_a_doubt(void **state)
{
	uint32_t duty;

	begin_doubt(state);
	servo_cycle();
	duty = world.rig.device.config.pwm.duty[0];
	world_output(&world, LAMP, true);
	world.command.servo[TWO_PWM].enable = 0;
	world.command.servo[SIGN].position += 0.1;
	servo_run(3 * MS);
	assert_true(fabs(servo_output(TWO_PWM)) <= 0);
	assert_int_equal(world.rig.device.config.pwm.duty[0], duty);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	world.command.flags |= POKEYS_COMMAND_EMERGENCY;
	servo_run(3 * MS);
	servo_expect_off(0);
	assert_false(world_latch(&world, LAMP));
}

static bool lose_all(struct world *w, const uint8_t *packet)
{
	(void)w;
	(void)packet;
	return true;
}

static void swallow_all(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCB || packet[1] == 0xCC;
}

/* The device hears us: off arrives, or, if only questions do, there are none soon. */
static void without_answers_it_stops_all_the_same(void **state)
{
	(void)state;
	servo_enable_all();
	servo_push_all();
	world.lose_reply = lose_all;
	servo_expect_off(20 * MS);
	servo_begin(state);
	servo_enable_all();
	servo_push_all();
	world.lose_reply = lose_all;
	world.watch = swallow_all;
	/* lost-after-ms, failsafe-timeout-ms */
	servo_expect_off(1250 * MS);
}

/* Switched off and on again while no duty arrives. */
static void none_is_enabled_over_a_duty_that_is_not_known(void **state)
{
	(void)state;
	servo_enable_all();
	servo_push_all();
	world.watch = swallow_pwm;
	world.command.servo[SIGN].enable = 0;
	servo_run(3 * MS);
	assert_false(world_latch(&world, servo_enable_pin[SIGN]));
	for (unsigned int i = 0; i < 50; i++) {
		world.command.servo[SIGN].position = servo_shown(SIGN)->position;
		world.command.servo[SIGN].enable = 1;
		servo_cycle();
		assert_false(world_latch(&world, servo_enable_pin[SIGN]));
	}
	world.watch = NULL;
	servo_enable(SIGN);
}

static void another_period_is_refused(void **state)
{
	(void)state;
	servo_enable_all();
	servo_push_all();
	world.command.pwm_period = 500000;
	servo_run(20 * MS);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_PWM_PERIOD);
	assert_int_equal(world.rig.device.config.pwm.period, PWM_PERIOD);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	world.command.pwm_period = PWM_PERIOD;
	servo_run(20 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
}

static void a_short_doubt_stops_nothing(void **state)
{
	begin_patient(state);
	servo_enable_all();
	for (unsigned int i = 0; i < 20; i++) {
		sim_rig_silence(&world.rig, world.now, 20 * MS);
		servo_run(200 * MS);
	}
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_int_equal(servo_shown(i)->state, POKEYS_SERVO_ENABLED);
	assert_true(world.state.link == POKEYS_LINK_RUNNING);
}

/* The device's failsafe has made its duty 0 (servo_cycle() judges). */
static void antiphase_is_enabled_at_standstill_only(void **state)
{
	servo_prepare(state);
	world.config.lost_after_ns = 2 * SECOND;
	world.config.settings.failsafe_timeout = 2;
	servo_start();
	servo_enable(ANTIPHASE);
	world.command.servo[ANTIPHASE].enable = 0;
	servo_run(10 * MS);
	sim_rig_silence(&world.rig, world.now, 500 * MS);
	servo_run(490 * MS);
	assert_int_equal(world.rig.device.config.pwm.duty[1], 0);
	world.watch = swallow_pwm;
	for (unsigned int i = 0; i < 200; i++) {
		world.command.servo[ANTIPHASE].enable = i % 2;
		servo_run(1 * MS);
	}
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	servo_enable(ANTIPHASE);
}

/* Another program has set it up, and it is set up again. */
static void an_encoder_that_is_set_up_again_is_another_place(void **state)
{
	(void)state;
	home(SIGN);
	home(TWO_PWM);
	world.rig.device.config.encoders.option[servo_encoder[SIGN]] ^= WIRE_ENC_4X;
	servo_run(8 * SECOND);
	assert_true(world.rig.device.config.encoders.option[servo_encoder[SIGN]] & WIRE_ENC_4X);
	assert_false(servo_shown(SIGN)->homed);
	assert_true(servo_shown(TWO_PWM)->homed);
	servo_enable(SIGN);
}

/* Samples of eight bits cannot see that. */
static void a_count_that_was_wrong_is_a_jump(void **state)
{
	(void)state;
	home(SIGN);
	sim_encoder_turn(&world.rig.device, servo_encoder[SIGN], 256);
	servo_run(2 * SECOND);
	assert_false(servo_shown(SIGN)->homed);
	home(SIGN);
	servo_enable(SIGN);
	sim_encoder_turn(&world.rig.device, servo_encoder[SIGN], -256);
	servo_expect_fault(SIGN, POKEYS_SERVO_JUMP, 2 * SECOND);
}

static void an_index_that_resets_its_counter_keeps_it_off(void **state)
{
	servo_prepare(state);
	world_fast_encoders(&world, true, false);
	world.config.servo[TWO_PWM].encoder = 1;
	servo_start();
	assert_int_equal(servo_shown(TWO_PWM)->condition, POKEYS_SERVO_FINE);
	world.rig.device.config.encoders.fast_index = 1;
	world_start(&world);
	world.config.settings.fast_options |= 1;
	servo_start();
	assert_int_equal(servo_shown(TWO_PWM)->condition, POKEYS_SERVO_DEVICE);
	assert_int_equal(servo_shown(TWO_PWM)->obstacle, POKEYS_OBSTACLE_INDEX);
	assert_int_equal(servo_shown(SIGN)->obstacle, POKEYS_OBSTACLE_NONE);
	assert_int_equal(servo_shown(SIGN)->condition, POKEYS_SERVO_FINE);
}

static void another_commander_finds_them_off(void **state)
{
	(void)state;
	servo_enable_all();
	servo_push_all();
	world_commander(&world, 6);
	for (unsigned int i = 0; i < MOTORS; i++)
		world.command.servo[i].enable = 1;
	servo_cycle();
	servo_expect_off(1 * MS);
	assert_int_equal(world.event_count[EVENT_SERVO_LEFT], MOTORS);
	assert_int_equal(servo_shown(SIGN)->refused, POKEYS_SERVO_OFF_FIRST);
}

/* Enabled for one cycle only: whether that has arrived, nobody knows. */
static void an_off_is_followed_however_short_it_was_on(void **state)
{
	servo_prepare(state);
	world.config.stale_after_ns = 10 * SECOND;
	for (unsigned int i = 0; i < MOTORS; i++)
		world.config.servo[i].servo.stale_ns = 100 * MS;
	servo_start();
	world.command.servo[SIGN].enable = 0;
	servo_run(10 * MS);
	world.command.servo[SIGN].enable = 1;
	servo_cycle();
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	world.watch = swallow_all;
	world_commander(&world, 6);
	servo_run(1500 * MS);
	servo_expect_off(0);
	assert_int_equal(world.event_count[EVENT_SERVO_UNHEARD], 1);
}

static bool is_identifying(struct world *w)
{
	return w->state.link == POKEYS_LINK_IDENTIFYING;
}

/* It has switched them off itself, however long it takes until it runs again. */
static void a_restarted_device_is_not_lost_for_them(void **state)
{
	servo_prepare(state);
	world.config.lost_after_ns = 2 * SECOND;
	servo_start();
	servo_enable_all();
	servo_push_all();
	sim_device_reboot(&world.rig.device, world_device_time(&world), false);
	world_until(&world, is_identifying, 1 * SECOND);
	sim_rig_silence(&world.rig, world.now, 400 * MS);
	world_until(&world, world_is_running, 3 * SECOND);
	servo_expect_off(0);
	assert_int_equal(world.event_count[EVENT_SERVO_UNHEARD], 0);
}

/* Whatever else the device is asked: the duty is that of the output in each cycle. */
static void the_output_is_sent_in_its_cycle(void **state)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_SET_ENCODER,
		.index = 14,
		.value = { 7 },
	};

	(void)state;
	servo_enable(TWO_PWM);
	for (unsigned int i = 0; i < 2000; i++) {
		if (i % 20 == 0)
			world_one_shot(&world, &shot);
		world.command.servo[TWO_PWM].position = sin(i * 0.001 * 4 * M_PI);
		servo_cycle();
		assert_true(fabs(servo_output(TWO_PWM) - (double)servo_shown(TWO_PWM)->output) <
			    1.0 / PWM_PERIOD);
	}
}

/* Something is always on its way then, but hardly ever anything else for this motor. */
static void it_turns_back_although_answers_are_slow(void **state)
{
	const struct sim_link_faults slow = { .delay = { .low_ns = 550 * US } };
	unsigned int turns = 0, without = 0;
	uint64_t before;

	servo_prepare(state);
	for (unsigned int i = 0; i < MOTORS; i++) {
		struct servo_config *loop = &world.config.servo[i].servo;

		loop->follow_least = loop->follow_most = 5;
		loop->gains.p = 0.3;
	}
	servo_start();
	sim_link_set_faults(&world.rig.link, 0, &slow);
	sim_link_set_faults(&world.rig.link, 1, &slow);
	servo_run(100 * MS);
	servo_enable(SIGN);
	servo_enable(TWO_PWM);
	before = world.rig.device.pins.latch;
	for (unsigned int i = 0; i < 3000; i++) {
		world.command.servo[SIGN].position = sin(i * 0.001 * 2 * M_PI);
		world.command.servo[TWO_PWM].position = sin(i * 0.001 * 6 * M_PI);
		servo_cycle();
		turns += (world.rig.device.pins.latch ^ before) >> DIRECTION_PIN & 1;
		before = world.rig.device.pins.latch;
		without = world.rig.device.config.pwm.duty[0] ? 0 : without + 1;
		assert_in_range(without, 0, 20); /* cycles: there and back, twice */
	}
	assert_true(turns >= 6);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	assert_int_equal(world.event_count[EVENT_SERVO_UNHEARD], 0);
}

static void set_delay(unsigned int direction, uint64_t delay_ns)
{
	const struct sim_link_faults slow = { .delay = { .low_ns = delay_ns } };

	sim_link_set_faults(&world.rig.link, direction, &slow);
}

/* A cycle in which all of them move: they have voltage. */
static void move_all(void)
{
	for (unsigned int i = 0; i < MOTORS; i++)
		world.command.servo[i].position += 0.001;
	servo_cycle();
}

/*
 * It arrives as soon as a packet can, whenever in a round trip it is commanded; also if outputs are
 * asked for less often, and if the network takes no packet for a moment.
 */
static void off_does_not_wait_for_an_answer(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < 24; i++) {
		servo_prepare(NULL);
		world.config.fast_divider = i % 3 == 2 ? 4 : 1;
		for (unsigned int motor = 0; motor < MOTORS; motor++) {
			struct servo_config *loop = &world.config.servo[motor].servo;

			loop->stale_ns = 100 * MS;
			loop->follow_least = loop->follow_most = 5;
			loop->gains = (struct servo_gains){ .p = 0.001, .velocity = 0.1 };
		}
		servo_start();
		servo_enable_all();
		set_delay(0, 5 * MS);
		set_delay(1, 5 * MS);
		/* until the deadlines are as long */
		servo_run(500 * MS);
		for (unsigned int cycle = 0; cycle < 100 + i; cycle++)
			move_all();
		for (unsigned int motor = 0; motor < MOTORS; motor++) {
			assert_int_equal(servo_shown(motor)->state, POKEYS_SERVO_ENABLED);
			assert_true(fabs(servo_output(motor)) > 0);
			world.command.servo[motor].enable = 0;
		}
		world.unplugged = i % 3 == 1;
		servo_cycle();
		world.unplugged = false;
		servo_run(6 * MS);
		assert_false(world_latch(&world, servo_enable_pin[SIGN]));
		assert_false(world_latch(&world, servo_enable_pin[ANTIPHASE]));
		servo_expect_off(0);
	}
}

/* A duty of before a gap may be that of another device, which has not acknowledged anything. */
static void an_answer_from_before_a_gap_is_no_acknowledgement(void **state)
{
	begin_patient(state);
	servo_enable(TWO_PWM);
	world.command.servo[TWO_PWM].position += 0.02;
	servo_run(2 * MS);
	assert_true(fabs(servo_output(TWO_PWM)) > 0);
	set_delay(1, 11 * MS);
	world.command.servo[TWO_PWM].enable = 0;
	servo_run(2 * MS);
	assert_true(fabs(servo_output(TWO_PWM)) <= 0);
	servo_run(7 * MS);
	world.watch = swallow_all;
	for (unsigned int i = 0; i < 40; i++) {
		servo_cycle();
		assert_int_equal(servo_shown(TWO_PWM)->state, POKEYS_SERVO_STOPPING);
	}
	world.watch = NULL;
	set_delay(1, 0);
	servo_run(200 * MS);
	assert_int_equal(servo_shown(TWO_PWM)->state, POKEYS_SERVO_OFF);
	assert_int_equal(world.event_count[EVENT_SERVO_UNHEARD], 0);
}

/* Also where the request that is under way had nothing to write, as nothing was to be off. */
static void off_does_not_wait_in_a_doubt(void **state)
{
	begin_doubt(state);
	set_delay(0, 5 * MS);
	set_delay(1, 5 * MS);
	servo_run(20 * MS);
	assert_int_equal(servo_shown(SIGN)->state, POKEYS_SERVO_ENABLED);
	assert_true(world_latch(&world, servo_enable_pin[SIGN]));
	world.command.servo[SIGN].enable = 0;
	world.lose_reply = lose_all;
	servo_run(7 * MS);
	assert_false(world_latch(&world, servo_enable_pin[SIGN]));
}

/* Another device has its address: ours is left alone, and no motor is stopping for ever. */
static void a_device_whose_address_is_taken_is_left_alone(void **state)
{
	servo_prepare(state);
	world.config.serial = 65432;
	servo_start();
	servo_enable_all();
	for (unsigned int i = 0; i < 100; i++)
		move_all();
	world.rig.device.options.serial = 777;
	for (unsigned int i = 0; i < 3000 && world.state.link == POKEYS_LINK_RUNNING; i++)
		move_all();
	world.watch = swallow_all;
	servo_run(2 * SECOND);
	assert_int_equal(world.state.fault, POKEYS_FAULT_WRONG_SERIAL);
	servo_expect_off(0);
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_int_equal(servo_shown(i)->state, POKEYS_SERVO_FAULT);
}

static unsigned int clocks_to_damage;

/* Its clock seems to have gone on by a quarter of an hour. */
static bool damage_clock(struct world *w, const uint8_t *packet)
{
	uint8_t other[WIRE_PK];

	if (packet[1] != 0xCF || !clocks_to_damage)
		return false;
	clocks_to_damage--;
	memcpy(other, packet, sizeof(other));
	other[4] ^= 0x10;
	wire_finish(other, packet[WIRE_AT_ID]);
	device_deliver(w->device, other, sizeof(other), NULL, w->now);
	return true;
}

/* Three clock answers that were damaged alike do not show that the outputs are off. */
static void another_clock_is_not_a_device_that_is_off(void **state)
{
	(void)state;
	servo_enable_all();
	world.lose_reply = damage_clock;
	clocks_to_damage = 3;
	for (unsigned int i = 0; i < 1500 && clocks_to_damage; i++)
		move_all();
	assert_int_equal(clocks_to_damage, 0);
	world.watch = swallow_all;
	servo_run(2 * MS);
	assert_int_equal(world.event_count[EVENT_REBOOTED], 1);
	servo_expect_off(1250 * MS);
}

static void emergency_of_the_engine(struct pokeys_settings *settings)
{
	settings->set |= POKEYS_SET_AXES | POKEYS_SET_EMERGENCY_PIN | POKEYS_SET_EMERGENCY_INVERT;
	settings->axes = 3;
	settings->emergency_pin = 62;
	settings->emergency_invert = 1;
	settings->pin_set[51 / 8] |= 1 << 51 % 8;
	settings->pin_function[51] = WIRE_PIN_INPUT;
}

static void the_engines_emergency_input_is_an_emergency_stop(void **state)
{
	servo_prepare(state);
	emergency_of_the_engine(&world.config.settings);
	sim_bench_emergency(&world.rig.device, true);
	servo_start();
	servo_enable_all();
	servo_push_all();
	sim_bench_emergency(&world.rig.device, false);
	servo_run(4 * MS);
	servo_expect_off(0);
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_int_equal(servo_shown(i)->fault, POKEYS_SERVO_EMERGENCY);
	sim_bench_emergency(&world.rig.device, true);
	servo_run(10 * MS);
	assert_int_equal(servo_do(POKEYS_ONE_SHOT_SERVO_RESET, SIGN, 0, 0), POKEYS_OUTCOME_DONE);
	servo_enable(SIGN);
}

/* The enable wire or the PWM is enough, but not with antiphase. */
static void a_failsafe_that_ends_the_pwm_is_enough(void **state)
{
	servo_prepare(state);
	world.config.settings.failsafe_peripherals = WIRE_FAILSAFE_PWM;
	servo_start();
	assert_int_equal(servo_shown(SIGN)->condition, POKEYS_SERVO_FINE);
	assert_int_equal(servo_shown(TWO_PWM)->condition, POKEYS_SERVO_FINE);
	assert_int_equal(servo_shown(ANTIPHASE)->condition, POKEYS_SERVO_DEVICE);
	servo_prepare(state);
	world.config.settings.failsafe_peripherals = WIRE_FAILSAFE_DIGITAL;
	servo_start();
	assert_int_equal(servo_shown(SIGN)->condition, POKEYS_SERVO_FINE);
	assert_int_equal(servo_shown(TWO_PWM)->condition, POKEYS_SERVO_DEVICE);
	assert_int_equal(servo_shown(ANTIPHASE)->condition, POKEYS_SERVO_FINE);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_motor_does_not_go_on_while_its_device_is_in_doubt),
		cmocka_unit_test(off_is_written_in_a_doubt),
		cmocka_unit_test_setup(without_answers_it_stops_all_the_same, servo_begin),
		cmocka_unit_test_setup(none_is_enabled_over_a_duty_that_is_not_known, servo_begin),
		cmocka_unit_test_setup(another_period_is_refused, servo_begin),
		cmocka_unit_test(a_short_doubt_stops_nothing),
		cmocka_unit_test(antiphase_is_enabled_at_standstill_only),
		cmocka_unit_test_setup(an_encoder_that_is_set_up_again_is_another_place,
				       servo_begin),
		cmocka_unit_test_setup(a_count_that_was_wrong_is_a_jump, servo_begin),
		cmocka_unit_test(an_index_that_resets_its_counter_keeps_it_off),
		cmocka_unit_test_setup(another_commander_finds_them_off, servo_begin),
		cmocka_unit_test(an_off_is_followed_however_short_it_was_on),
		cmocka_unit_test(a_restarted_device_is_not_lost_for_them),
		cmocka_unit_test_setup(the_output_is_sent_in_its_cycle, servo_begin),
		cmocka_unit_test(it_turns_back_although_answers_are_slow),
		cmocka_unit_test(off_does_not_wait_for_an_answer),
		cmocka_unit_test(off_does_not_wait_in_a_doubt),
		cmocka_unit_test(a_device_whose_address_is_taken_is_left_alone),
		cmocka_unit_test(an_answer_from_before_a_gap_is_no_acknowledgement),
		cmocka_unit_test_setup(another_clock_is_not_a_device_that_is_off, servo_begin),
		cmocka_unit_test(the_engines_emergency_input_is_an_emergency_stop),
		cmocka_unit_test(a_failsafe_that_ends_the_pwm_is_enough),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
