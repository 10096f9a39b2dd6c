/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's settings: only differences are written, verified, never while
 * it moves, never to flash; what it refuses keeps it from running.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/pulse.h"

static struct world world;
static unsigned int writes[256], axis_writes, setups, emergencies;
static uint8_t last_axis[64];

/* Writes of settings, by operation. */
static void count_writes(struct world *w, const uint8_t *p)
{
	(void)w;
	switch (p[1]) {
	case 0xC0:
		writes[p[1]] += p[2] == 1 || p[3] == 2;
		break;
	case 0xC4:
	case 0xC5:
		writes[p[1]] += p[2] != 0;
		break;
	case 0xCE:
		writes[p[1]] += p[2] != 2;
		break;
	case 0x1C:
		writes[p[1]] += p[2] != 0xFF;
		break;
	case 0x85:
		axis_writes += p[2] == 0x11;
		setups += p[2] == 0x01;
		emergencies += p[2] == 0x06 && p[3];
		if (p[2] == 0x11)
			memcpy(last_axis, p, sizeof(last_axis));
		break;
	case 0x50:
	case 0x51:
	case 0x52:
	case 0x10:
	case 0x11:
		fail_msg("operation 0x%02x has no business here", p[1]);
	}
}

static unsigned int all_writes(void)
{
	unsigned int sum = axis_writes + setups + emergencies;

	for (unsigned int i = 0; i < 256; i++)
		sum += writes[i];
	return sum;
}

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world.config.settings.set = 0;
	memset(writes, 0, sizeof(writes));
	axis_writes = setups = emergencies = 0;
	world.watch = count_writes;
	return 0;
}

static void restart(void)
{
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
}

static void pin(unsigned int i, uint8_t function)
{
	world_pin(&world, i, function);
}

static void nothing_wanted_writes_nothing(void **state)
{
	(void)state;
	restart();
	assert_int_equal(all_writes(), 0);
}

static void only_pins_that_differ_are_written_and_others_stay(void **state)
{
	struct sim_device *sim = &world.rig.device;

	(void)state;
	sim->config.pins.function[3] = WIRE_PIN_INPUT | WIRE_PIN_INVERT;
	sim->config.pins.function[9] = WIRE_PIN_OUTPUT;
	pin(9, WIRE_PIN_OUTPUT);
	pin(12, WIRE_PIN_OUTPUT);
	restart();
	assert_int_equal(writes[0xC0], 1);
	assert_int_equal(all_writes(), 1);
	assert_int_equal(sim->config.pins.function[3], WIRE_PIN_INPUT | WIRE_PIN_INVERT);
	assert_int_equal(sim->config.pins.function[12], WIRE_PIN_OUTPUT);
	assert_int_equal(world.event_count[EVENT_CONFIG_CHANGED], 1);
	assert_int_equal(world.last_event[EVENT_CONFIG_CHANGED].a, WIRE_OP_PIN_ALL);
	assert_int_equal(world.last_event[EVENT_CONFIG_CHANGED].b, 13);
	assert_int_equal(world.last_event[EVENT_CONFIG_CHANGED].c, WIRE_PIN_OUTPUT);
	assert_int_equal(world.state.digital_out_owned[1], 1 << 1 | 1 << 4);
	assert_int_equal(world.state.pin_function[12], WIRE_PIN_OUTPUT);
	assert_int_equal(sim->stats.saves, 0);
	/* a second start finds all as wanted */
	restart();
	assert_int_equal(all_writes(), 1);
}

static void encoders_are_set_up(void **state)
{
	struct sim_device *sim = &world.rig.device;

	(void)state;
	/* a key mapping of somebody */
	sim->config.encoders.option[5] = 0xF0 | WIRE_ENC_ENABLE;
	world_encoder(&world, 5, WIRE_ENC_ENABLE | WIRE_ENC_2X, 10, 11);
	world_encoder(&world, 6, WIRE_ENC_ENABLE | WIRE_ENC_4X, 255, 255);
	world_fast_encoders(&world, true, true);
	restart();
	assert_int_equal(sim->config.encoders.option[5], 0xF0 | WIRE_ENC_ENABLE | WIRE_ENC_2X);
	assert_int_equal(sim->config.encoders.pins[5], 10);
	assert_int_equal(sim->config.encoders.pins[25 + 5], 11);
	assert_int_equal(sim->config.encoders.option[6], WIRE_ENC_ENABLE | WIRE_ENC_4X);
	assert_int_equal(sim->config.encoders.fast & 0x0F, WIRE_FAST_ON);
	assert_int_equal(sim->config.encoders.ultra_on, 1);
	assert_int_equal(writes[0xC4], 1);
	assert_int_equal(writes[0xC5], 1);
	assert_int_equal(writes[0xCE], 1);
	assert_int_equal(writes[0x1C], 1);
	assert_int_equal(world.state.encoder_enabled, 1u << 25 | 1u << 6 | 1u << 5 | 7);
	world_fast_encoders(&world, false, false);
	restart();
	assert_int_equal(sim->config.encoders.fast & 0x0F, 0);
	assert_int_equal(world.state.encoder_enabled, 1u << 6 | 1u << 5);
}

static void axis_block_is_read_changed_and_written_whole(void **state)
{
	struct pokeys_axis_settings *axis = world.config.settings.axis;
	struct sim_device *sim = &world.rig.device;
	uint8_t before[SIM_AXIS_BLOCK];

	(void)state;
	for (unsigned int i = 0; i < SIM_AXIS_BLOCK; i++)
		sim->config.engine.axis[1][i] = (uint8_t)(0x11 * (i % 13));
	sim->config.engine.axis[1][0] = 0;
	memcpy(before, sim->config.engine.axis[1], sizeof(before));
	world_axes(&world);
	memset(&axis[0], 0, sizeof(axis[0]));
	memset(&axis[2], 0, sizeof(axis[2]));
	axis[1].options_mask |= WIRE_AXIS_INVERTED | WIRE_AXIS_SOFT_LIMITS;
	axis[1].options |= WIRE_AXIS_INVERTED | WIRE_AXIS_SOFT_LIMITS;
	axis[1].set |= POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM;
	axis[1].soft_minimum = -5000;
	axis[1].soft_maximum = 70000;
	restart();
	assert_int_equal(axis_writes, 1);
	assert_int_equal(last_axis[3], 1);
	assert_int_equal(last_axis[8], WIRE_AXIS_ENABLED | WIRE_AXIS_INVERTED |
					       WIRE_AXIS_INTERNAL_PLANNER |
					       WIRE_AXIS_POSITION_MODE | WIRE_AXIS_SOFT_LIMITS);
	assert_true(fabsf(wire_get_f32(last_axis + 16) - 20) < 1e-6f);
	assert_true(fabsf(wire_get_f32(last_axis + 20) - 0.5f) < 1e-6f);
	assert_true(fabsf(wire_get_f32(last_axis + 24) - 0.5f) < 1e-6f);
	assert_int_equal(wire_get_i32(last_axis + 28), -5000);
	assert_int_equal(wire_get_i32(last_axis + 32), 70000);
	assert_memory_equal(last_axis + 9, before + 1, 7);
	assert_memory_equal(last_axis + 36, before + 28, 62 - 36);
	assert_int_equal(world.state.engine.axis[1].mode, POKEYS_AXIS_POSITION);
	assert_true(fabsf(world.state.engine.axis[1].max_speed - 20000) < 0.1f);
	restart();
	assert_int_equal(axis_writes, 1);
}

static void an_axis_that_is_not_known_has_no_soft_limits(void **state)
{
	(void)state;
	restart();
	assert_int_equal(world.state.engine.axis[0].mode, POKEYS_AXIS_OFF);
	assert_int_equal(world.state.engine.axis[0].soft_minimum, INT32_MIN);
	assert_int_equal(world.state.engine.axis[0].soft_maximum, INT32_MAX);
}

static void number_of_axes_and_emergency_pin_are_set(void **state)
{
	(void)state;
	world.config.settings.set = POKEYS_SET_AXES | POKEYS_SET_EMERGENCY_PIN;
	world.config.settings.axes = 4;
	world.config.settings.emergency_pin = 62;
	restart();
	assert_int_equal(setups, 1);
	assert_int_equal(emergencies, 1);
	assert_int_equal(world.rig.device.config.engine.axes, 4);
	assert_int_equal(world.rig.device.config.engine.emergency_pin, 62);
	assert_int_equal(world.state.engine.axes_enabled, 4);
	restart();
	assert_int_equal(all_writes(), 2);
}

static void the_emergency_button_is_seen_while_the_engine_stands(void **state)
{
	static const uint8_t pins[] = { 1, 62, 30 }, terminals[] = { 52, 52, 20 };

	for (unsigned int i = 0; i < sizeof(pins); i++) {
		begin(state);
		world.config.settings.set = POKEYS_SET_EMERGENCY_PIN;
		world.config.settings.emergency_pin = pins[i];
		world.rig.device.config.pins.function[terminals[i] - 1] = WIRE_PIN_INPUT;
		restart();
		world_run(&world, 20 * MS);
		assert_false(world.state.engine.emergency);
		world_emergency(&world);
		world_run(&world, 20 * MS);
		assert_int_equal(world.state.engine.state, WIRE_ENGINE_STOPPED);
		assert_true(world.state.engine.emergency);
	}
}

static void period_filter_bus_matrix_and_name_are_set_and_the_rest_of_them_stays(void **state)
{
	struct pokeys_settings *wants = &world.config.settings;
	struct sim_device *sim = &world.rig.device;

	(void)state;
	sim->config.pwm.duty[1] = 5000;
	sim->config.pwm.duty[2] = 40;
	sim->config.panel.keyboard[8 + 8] = 17; /* column 7, not used below */
	sim->config.panel.keyboard[18] = 0xA5;  /* a key macro */
	sim->bus.poext[4] = 0x5A;
	wants->set = POKEYS_SET_PWM_PERIOD | POKEYS_SET_ANALOG_FILTER | POKEYS_SET_POEXTBUS |
		     POKEYS_SET_MATRIX | POKEYS_SET_NAME;
	wants->pwm_period = 2500;
	wants->analog_filter = 77;
	wants->poextbus_connector = 1;
	wants->matrix_enable = 1;
	wants->matrix_rows = 10;
	wants->matrix_columns = 3;
	for (unsigned int i = 0; i < 10; i++)
		wants->matrix_row_pin[i] = (uint8_t)(20 + i);
	for (unsigned int i = 0; i < 3; i++)
		wants->matrix_column_pin[i] = (uint8_t)(40 + i);
	strcpy(wants->name, "Router in the cellar");
	restart();
	assert_int_equal(sim->config.pwm.period, 2500);
	assert_int_equal(sim->config.pwm.duty[1], 2500);
	assert_int_equal(sim->config.pwm.duty[2], 40);
	assert_int_equal(sim->config.bus.poext_connector, 1);
	assert_int_equal(sim->bus.poext[4], 0x5A);
	assert_int_equal(sim->config.panel.keyboard[0], 1);
	assert_int_equal(sim->config.panel.keyboard[1], 9 | 2 << 4);
	assert_int_equal(sim->config.panel.keyboard[2 + 7], 27);
	assert_int_equal(sim->config.panel.keyboard[16], 17);
	assert_int_equal(sim->config.panel.keyboard[18], 0xA5);
	assert_int_equal(sim->config.panel.keyboard[34], 28);
	assert_string_equal(world.state.identity.name, "Router in the cellar");
	assert_int_equal(world.state.matrix_enabled, 1);
	assert_int_equal(world.event_count[EVENT_CONFIG_CHANGED], 5);
	restart();
	assert_int_equal(world.event_count[EVENT_CONFIG_CHANGED], 5);
	assert_int_equal(sim->stats.saves, 0);
}

static void locked_device_runs_when_nothing_needs_to_be_written(void **state)
{
	(void)state;
	world.rig.device.config.identity.locked = 1;
	restart();
	assert_int_equal(world.state.identity.locked, 1);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(all_writes(), 0);
	/* nor does the failsafe keep it from running: it is a second net */
	world.config.settings.set = POKEYS_SET_FAILSAFE;
	restart();
	assert_int_equal(all_writes(), 0);
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_OFF);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_REFUSED);
	assert_int_equal(world.last_event[EVENT_CONFIG_REFUSED].a, WIRE_OP_FAILSAFE);
}

static void locked_device_that_differs_does_not_run_until_unlocked(void **state)
{
	(void)state;
	world.rig.device.config.identity.locked = 1;
	pin(12, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_run(&world, 5 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_LOCKED);
	assert_int_equal(all_writes(), 0);
	assert_in_range(world.event_count[EVENT_LINK], 1, 4);
	world.rig.device.config.identity.locked = 0;
	world_until(&world, world_is_running, 1500 * MS);
	assert_int_equal(world.rig.device.config.pins.function[12], WIRE_PIN_OUTPUT);
}

static void setting_that_is_not_taken_keeps_it_from_running(void **state)
{
	struct sim_device *sim = &world.rig.device;

	(void)state;
	/* lock without saying so: the writes are acknowledged and ignored */
	world.config.settings.set = POKEYS_SET_AXES;
	world.config.settings.axes = 9;
	world_start(&world);
	world_run(&world, 5 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_CONFIG_REFUSED);
	assert_int_equal(world.event_count[EVENT_CONFIG_REFUSED], 1);
	assert_int_equal(world.last_event[EVENT_CONFIG_REFUSED].a, WIRE_OP_PULSE_SETUP);
	assert_int_equal(world.last_event[EVENT_CONFIG_REFUSED].c, SETTING_UNTAKEN);
	assert_in_range(setups, 3, 18);
	assert_true(sim->config.engine.axes <= 8);
}

static void deaf_to_encoder_pins(struct world *w, const uint8_t *p)
{
	count_writes(w, p);
	w->swallow = p[1] == 0xC5;
}

static void setting_that_is_never_answered_matters_only_if_it_is_wanted(void **state)
{
	(void)state;
	world.watch = deaf_to_encoder_pins;
	world_start(&world);
	world_until(&world, world_is_running, 2 * SECOND);
	world_encoder(&world, 5, WIRE_ENC_ENABLE | WIRE_ENC_4X, 10, 11);
	world_start(&world);
	world_run(&world, 3 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_CONFIG_REFUSED);
	assert_int_equal(world.last_event[EVENT_CONFIG_REFUSED].a, WIRE_OP_ENCODER_PINS);
	assert_int_equal(world.last_event[EVENT_CONFIG_REFUSED].c, SETTING_UNANSWERED);
	assert_int_equal(world.event_count[EVENT_CONFIG_REFUSED], 1);
}

static void device_lost_while_it_is_blocked_is_found_again(void **state)
{
	locked_device_that_differs_does_not_run_until_unlocked(state);
	world.rig.device.config.identity.locked = 1;
	world.rig.device.config.pins.function[12] = 0;
	sim_rig_silence(&world.rig, world.now, 500 * MS);
	world_until(&world, world_is_lost, 1 * SECOND);
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	sim_rig_silence(&world.rig, world.now, 800 * MS);
	world_run(&world, 700 * MS);
	assert_int_equal(world.state.link, POKEYS_LINK_LOST);
	world.rig.device.config.identity.locked = 0;
	world_until(&world, world_is_running, 2 * SECOND);
}

static bool engine_moves;

static void no_write_while_moving(struct world *w, const uint8_t *p)
{
	const unsigned int before = all_writes();

	count_writes(w, p);
	if (all_writes() != before) {
		sim_rig_run(&w->rig, w->now);
		assert_int_equal(w->rig.device.engine.state, SIM_PE_STOPPED);
	}
	engine_moves = engine_moves || w->rig.device.engine.state == SIM_PE_STOPPING;
}

/* A daemon was killed in the middle of a move. */
static void engine_running_from_before_is_stopped_first(void **state)
{
	(void)state;
	world_axes(&world);
	world_commander(&world, 3);
	restart();
	world_machine_on(&world);
	world.command.axis[0] =
		(struct pokeys_axis_command){ 1000000, 0, POKEYS_AXIS_POSITION, 1, { 0 } };
	world_run(&world, 500 * MS);
	assert_int_equal(world.rig.device.engine.axis[0].state, SIM_AX_RUNNING);
	world.commanding = false;
	memset(&world.command, 0, sizeof(world.command));
	pin(12, WIRE_PIN_OUTPUT);
	world.watch = no_write_while_moving;
	engine_moves = false;
	restart();
	assert_true(engine_moves);
	assert_int_equal(world.rig.device.engine.state, SIM_PE_STOPPED);
	assert_int_equal(world.rig.device.config.pins.function[12], WIRE_PIN_OUTPUT);
}

static void settings_survive_any_loss(void **state)
{
	struct sim_device *sim = &world.rig.device;

	(void)state;
	for (unsigned int i = 0; i < 10; i++) {
		sim_rig_reboot(&world.rig, world.now, true);
		world_loss(&world, 0.33);
		world_axes(&world);
		pin(12, WIRE_PIN_OUTPUT);
		world_encoder(&world, 5, WIRE_ENC_ENABLE | WIRE_ENC_4X, 10, 11);
		world_start(&world);
		world_until(&world, world_is_running, 20 * SECOND);
		world_loss(&world, 0);
		assert_int_equal(sim->config.pins.function[12], WIRE_PIN_OUTPUT);
		assert_int_equal(sim->config.engine.axes, 3);
		assert_int_equal(sim->config.encoders.pins[5], 10);
		for (unsigned int axis = 0; axis < 3; axis++)
			assert_int_equal(sim->config.engine.axis[axis][0], 0x0D);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(nothing_wanted_writes_nothing, begin),
		cmocka_unit_test_setup(only_pins_that_differ_are_written_and_others_stay, begin),
		cmocka_unit_test_setup(encoders_are_set_up, begin),
		cmocka_unit_test_setup(axis_block_is_read_changed_and_written_whole, begin),
		cmocka_unit_test_setup(an_axis_that_is_not_known_has_no_soft_limits, begin),
		cmocka_unit_test_setup(number_of_axes_and_emergency_pin_are_set, begin),
		cmocka_unit_test_setup(the_emergency_button_is_seen_while_the_engine_stands, begin),
		cmocka_unit_test_setup(
			period_filter_bus_matrix_and_name_are_set_and_the_rest_of_them_stays,
			begin),
		cmocka_unit_test_setup(locked_device_runs_when_nothing_needs_to_be_written, begin),
		cmocka_unit_test_setup(locked_device_that_differs_does_not_run_until_unlocked,
				       begin),
		cmocka_unit_test_setup(setting_that_is_not_taken_keeps_it_from_running, begin),
		cmocka_unit_test_setup(setting_that_is_never_answered_matters_only_if_it_is_wanted,
				       begin),
		cmocka_unit_test_setup(device_lost_while_it_is_blocked_is_found_again, begin),
		cmocka_unit_test_setup(engine_running_from_before_is_stopped_first, begin),
		cmocka_unit_test_setup(settings_survive_any_loss, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
