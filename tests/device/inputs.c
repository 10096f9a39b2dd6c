/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Inputs that are read now and then: the dedicated ones, the matrix' upper rows, counters,
 * the emergency input; and how often that is.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/bus_rig.h"
#include "wire/io.h"

static void dedicated_inputs_upper_rows_and_new_counters_are_read(void **state)
{
	struct pokeys_settings wanted = world.config.settings;

	(void)state;
	sim->bench.machine.raw_minus = 0x05;
	sim->bench.machine.raw_plus = 0x02;
	sim->bench.machine.raw_home = 0x81;
	sim->bench.keys[2] = 0x11;
	sim->bench.keys[9] = 0x5A;
	wanted.set |= POKEYS_SET_MATRIX;
	wanted.matrix_enable = 1;
	wanted.matrix_rows = 10;
	wanted.matrix_columns = 8;
	wanted.pin_set[0] |= 1 << 5;
	wanted.pin_function[5] = WIRE_PIN_COUNTER;
	sim->pins.counter[5] = 4711;
	device_wanted(world.device, &wanted);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(world.state.engine.dedicated_limit_minus, 0x05);
	assert_int_equal(world.state.engine.dedicated_limit_plus, 0x02);
	assert_int_equal(world.state.engine.dedicated_home, 0x81);
	assert_int_equal(world.state.matrix[9], 0x5A);
	assert_int_equal(world.state.matrix[2], 0x11);
	assert_int_equal(world.state.counter[5], 4711);
}

/* Asked for less often than the pins' functions are read again. */
static void every_counter_has_its_turn(void **state)
{
	enum { COUNTERS = 30 };

	(void)state;
	world_init(&world, NULL);
	sim = &world.rig.device;
	world.config.slow_hz = 0.2;
	for (unsigned int i = 0; i < COUNTERS; i++)
		sim->config.pins.function[i] = WIRE_PIN_COUNTER;
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 5 * SECOND);
	for (unsigned int i = 0; i < COUNTERS; i++)
		sim->pins.counter[i] = 100 + i;
	world_run(&world, 10 * SECOND);
	for (unsigned int i = 0; i < COUNTERS; i++)
		assert_int_equal(world.state.counter[i], 100 + i);
}

static void emergency_input_is_shown_while_the_engine_stands(void **state)
{
	(void)state;
	for (unsigned int way = 0; way < 4; way++) {
		struct pokeys_settings wanted = world.config.settings;

		wanted.set |= POKEYS_SET_EMERGENCY_PIN | POKEYS_SET_EMERGENCY_INVERT;
		wanted.emergency_pin = 62;
		wanted.emergency_invert = way & 1;
		wanted.pin_set[51 / 8] |= 1 << 51 % 8;
		wanted.pin_function[51] = (uint8_t)(WIRE_PIN_INPUT |
						    (way & 2 ? WIRE_PIN_INVERT : 0));
		device_wanted(world.device, &wanted);
		sim_bench_emergency(sim, way & 1);
		world_run(&world, 200 * MS);
		assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
		assert_int_equal(world.state.engine.emergency, 0);
		sim_bench_emergency(sim, !(way & 1));
		world_run(&world, 20 * MS);
		assert_int_equal(world.state.engine.state, SIM_PE_STOPPED);
		assert_int_equal(world.state.engine.emergency, 1);
	}
}

static void rates_are_measured(void **state)
{
	(void)state;
	world_run(&world, 3 * SECOND);
	assert_in_range(world.state.slow_millihertz[POKEYS_SLOW_TICK], 4500, 5500);
	assert_in_range(world.state.slow_millihertz[POKEYS_SLOW_POEXTBUS], 18000, 21000);
	assert_in_range(world.state.slow_millihertz[POKEYS_SLOW_DEDICATED], 45000, 52000);
	assert_in_range(world.state.slow_millihertz[POKEYS_SLOW_PONET], 80000, 105000);
	assert_int_equal(world.state.slow_millihertz[POKEYS_SLOW_MATRIX], 0);
	sim_rig_silence(&world.rig, world.now, 2 * SECOND);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.slow_millihertz[POKEYS_SLOW_TICK], 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(dedicated_inputs_upper_rows_and_new_counters_are_read,
				       begin),
		cmocka_unit_test(every_counter_has_its_turn),
		cmocka_unit_test_setup(emergency_input_is_shown_while_the_engine_stands, begin),
		cmocka_unit_test_setup(rates_are_measured, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
