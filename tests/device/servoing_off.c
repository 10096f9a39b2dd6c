/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * An off that finds no place among the open requests, or that the network does not take, is sent as
 * soon as it can be.
 */

#include <math.h>
#include "tests/device/servo_rig.h"

static void patient_motors(void)
{
	for (unsigned int motor = 0; motor < MOTORS; motor++) {
		struct servo_config *loop = &world.config.servo[motor].servo;

		loop->stale_ns = 100 * MS;
		loop->follow_least = loop->follow_most = 5;
	}
}

/* Pushed against, it has voltage. */
static void push(uint64_t for_ns)
{
	servo_start();
	servo_enable(TWO_PWM);
	servo_motor(TWO_PWM)->torque = 0.05;
	servo_run(for_ns);
}

static void switch_off(void)
{
	assert_true(fabs(servo_output(TWO_PWM)) > 0);
	servo_motor(TWO_PWM)->torque = 0;
	world.command.servo[TWO_PWM].enable = 0;
}

static bool lose_every_reply(struct world *w, const uint8_t *packet)
{
	(void)w;
	(void)packet;
	return true;
}

/* Questions that nobody answers may take every other place, but not that of an off. */
static void off_finds_a_place_beside_open_questions(void **state)
{
	(void)state;
	servo_prepare(NULL);
	world.config.stale_after_ns = 5 * SECOND;
	world.config.lost_after_ns = 6 * SECOND;
	world.config.mailbox.window = 4;
	world.config.mailbox.deadline_floor_ns = 40 * MS;
	world.config.mailbox.retries = 20;
	patient_motors();
	world.config.servo[TWO_PWM].servo.gains = (struct servo_gains){ .p = 0.05 };
	/* a constant duty: its place is free */
	push(1 * SECOND);
	world.lose_reply = lose_every_reply;
	servo_run(80 * MS);
	assert_int_equal(servo_shown(TWO_PWM)->state, POKEYS_SERVO_ENABLED);
	switch_off();
	servo_run(2 * MS);
	assert_true(fabs(servo_output(TWO_PWM)) <= 0);
}

static bool lose_duties(struct world *w, const uint8_t *packet)
{
	(void)w;
	return packet[1] == 0xCB;
}

/* A repetition that the network has not taken, at whatever time it was due, is no off. */
static void what_the_network_refused_is_sent_again_at_once(void **state)
{
	(void)state;
	for (unsigned int refused = 1; refused < 100; refused += 2) {
		servo_prepare(NULL);
		world.config.mailbox.deadline_floor_ns = 5 * MS;
		patient_motors();
		push(200 * MS);
		world.lose_reply = lose_duties;
		servo_run(20 * MS);
		switch_off();
		world.unplugged = true;
		servo_run(refused * MS);
		world.unplugged = false;
		servo_cycle();
		servo_cycle();
		assert_true(fabs(servo_output(TWO_PWM)) <= 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(off_finds_a_place_beside_open_questions),
		cmocka_unit_test(what_the_network_refused_is_sent_again_at_once),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
