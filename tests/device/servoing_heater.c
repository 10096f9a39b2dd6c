/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A heater's fault stops the servo motors of its device, if it is to. */

#include <string.h>
#include "tests/device/servo_rig.h"
#include "wire/io.h"

enum { SENSOR = 2, HEATER_PIN = 12, WARM = 3911, HOT = 100, OPEN = 4095 };

static void read_as(uint16_t reading)
{
	world.rig.device.bench.analog[SENSOR].low = reading;
}

static int prepare(bool stops_machine)
{
	struct heating_config *config = &world.config.heater[0];

	servo_prepare(NULL);
	*config = (struct heating_config){
		.heater = heater_usual,
		.sensor = SENSOR,
		.kind = HEATING_PIN,
		.output = HEATER_PIN,
		.least_ns = 100 * MS,
		.within = 3,
		.stops_machine = stops_machine,
	};
	strcpy(config->name, "bed");
	config->heater.lease_ns = HEATER_PERIOD_NS;
	world.config.heaters = 1;
	world_pin(&world, WIRE_ANALOG_FIRST_PIN - 1 + SENSOR, WIRE_PIN_ANALOG_IN);
	world_pin(&world, HEATER_PIN, WIRE_PIN_OUTPUT);
	read_as(WARM);
	servo_start();
	world.command.heater_mask = 1;
	servo_run(300 * MS);
	assert_int_equal(world.state.heater[0].condition, POKEYS_HEATER_FINE);
	assert_int_equal(world.state.heater[0].stops_machine, stops_machine);
	servo_enable_all();
	return 0;
}

static enum pokeys_outcome reset_heater(void)
{
	return servo_do(POKEYS_ONE_SHOT_HEATER_RESET, 0, 0, 0);
}

static enum pokeys_outcome reset_motor(unsigned int motor)
{
	return servo_do(POKEYS_ONE_SHOT_SERVO_RESET, motor, 0, 0);
}

static void its_fault_stops_all_motors_until_both_are_reset(void **state)
{
	(void)state;
	prepare(true);
	world.command.heater_target[0] = 60;
	servo_push_all();
	assert_int_equal(world.state.heater[0].state, POKEYS_HEATER_HEATING);
	read_as(OPEN);
	servo_run(150 * MS);
	assert_int_equal(world.state.heater[0].fault, POKEYS_HEATER_OPEN);
	servo_expect_off(2 * MS);
	for (unsigned int i = 0; i < MOTORS; i++) {
		assert_int_equal(servo_shown(i)->fault, POKEYS_SERVO_HEATER);
		assert_int_equal(reset_motor(i), POKEYS_OUTCOME_REFUSED);
	}
	/* the cause alone is not enough: somebody has to look at it */
	read_as(WARM);
	servo_run(300 * MS);
	assert_int_equal(reset_motor(SIGN), POKEYS_OUTCOME_REFUSED);
	world.command.heater_target[0] = 0;
	assert_int_equal(reset_heater(), POKEYS_OUTCOME_DONE);
	servo_expect_off(0);
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_int_equal(reset_motor(i), POKEYS_OUTCOME_DONE);
	servo_enable_all();
}

static void one_that_is_too_hot_while_it_is_off_stops_them_as_well(void **state)
{
	(void)state;
	prepare(true);
	servo_push_all();
	read_as(HOT);
	servo_run(150 * MS);
	assert_int_equal(world.state.heater[0].fault, POKEYS_HEATER_OVER);
	servo_expect_off(2 * MS);
	assert_int_equal(servo_shown(TWO_PWM)->fault, POKEYS_SERVO_HEATER);
}

static void otherwise_it_is_a_fault_of_the_heater_alone(void **state)
{
	(void)state;
	prepare(false);
	read_as(HOT);
	servo_run(300 * MS);
	assert_int_equal(world.state.heater[0].fault, POKEYS_HEATER_OVER);
	for (unsigned int i = 0; i < MOTORS; i++)
		assert_int_equal(servo_shown(i)->state, POKEYS_SERVO_ENABLED);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(its_fault_stops_all_motors_until_both_are_reset),
		cmocka_unit_test(one_that_is_too_hot_while_it_is_off_stops_them_as_well),
		cmocka_unit_test(otherwise_it_is_a_fault_of_the_heater_alone),
	};

	return cmocka_run_group_tests_name("motors and a heater", tests, NULL, NULL);
}
