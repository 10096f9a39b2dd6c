/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Settings that a commander wishes, and the report of them: part by part,
 * only differences, only while nothing moves, without leaving the fast
 * requests alone.
 */

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/pulse.h"

static struct world world;
static struct pokeys_wish wish;
static struct pokeys_report report;
static unsigned int writes, tries;
static bool held_back; /* only the last try of a write arrives */

/* No write of a setting while the engine moves. */
static void count(struct world *w, const uint8_t *p)
{
	const bool write = (p[1] == 0xC0 && p[2] == 1) || (p[1] == 0xC4 && p[2]) ||
			   (p[1] == 0xC5 && p[2]) || (p[1] == 0x85 && (p[2] == 1 || p[2] == 0x11));

	if (!write)
		return;
	w->swallow = held_back && tries++ % 4 < 3;
	if (w->swallow)
		return;
	writes++;
	sim_rig_run(&w->rig, w->now);
	assert_int_equal(w->rig.device.engine.state, SIM_PE_STOPPED);
}

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	world_commander(&world, 5);
	memset(&wish, 0, sizeof(wish));
	wish.session = 5;
	memset(&report, 0, sizeof(report));
	writes = tries = 0;
	held_back = false;
	world.watch = count;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	device_report(world.device, &report);
	writes = 0;
	return 0;
}

static void send_wish(void)
{
	wish.generation++;
	device_wish(world.device, &wish);
}

static bool is_applied(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_APPLIED ||
	       w->state.config_state == POKEYS_CONFIG_REFUSED;
}

static void settle(uint64_t limit_ns)
{
	world_cycle(&world);
	world_until(&world, is_applied, limit_ns);
}

static void wish_pin(unsigned int pin, uint8_t function)
{
	wish.settings.pin_set[pin / 8] |= (uint8_t)(1u << pin % 8);
	wish.settings.pin_function[pin] = function;
}

static void device_s_own_settings_are_reported_though_nobody_wants_them(void **state)
{
	(void)state;
	world.rig.device.config.pins.function[30] = WIRE_PIN_INPUT | WIRE_PIN_INVERT;
	world.rig.device.config.encoders.option[7] = 0xF0;
	world.rig.device.config.engine.emergency_pin = 62;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_true(device_report(world.device, &report));
	assert_int_equal(report.state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(report.device.pin_function[30], WIRE_PIN_INPUT | WIRE_PIN_INVERT);
	assert_int_equal(report.device.pin_set[6], 0x7f);
	assert_int_equal(report.device.encoder[7].options, 0xF0);
	assert_int_equal(report.device.emergency_pin, 62);
	assert_int_equal(report.device.axes, 3);
	assert_true(fabsf(report.device.axis[1].max_speed - 20000) < 0.1f);
	assert_int_equal(report.device.axis[1].options, 0x0D);
	assert_int_equal(report.wanted.axes, 3);
	assert_int_equal(report.generation, 0);
}

static void report_comes_when_something_changed_and_only_then(void **state)
{
	struct pokeys_report again;

	(void)state;
	assert_int_equal(report.count, world.state.report_count + 1);
	world_run(&world, 500 * MS);
	assert_false(device_report(world.device, &again));
	assert_int_equal(world.state.report_count, report.count);
	wish_pin(12, WIRE_PIN_OUTPUT);
	send_wish();
	assert_true(device_report(world.device, &again));
	assert_int_equal(again.generation, 1);
	assert_int_equal(again.wanted.pin_function[12], WIRE_PIN_OUTPUT);
	assert_true(again.count > report.count);
}

static void wish_is_applied_while_running_and_only_differences_are_written(void **state)
{
	struct sim_device *sim = &world.rig.device;

	(void)state;
	wish_pin(12, WIRE_PIN_OUTPUT);
	wish.settings.encoder[5] = (struct pokeys_encoder_settings){
		.options = WIRE_ENC_ENABLE | WIRE_ENC_4X,
		.options_mask = 7,
		.pins_set = 1,
		.pin_a = 10,
		.pin_b = 11,
	};
	wish.settings.axis[1].set = POKEYS_AXIS_SET_PIN_HOME | POKEYS_AXIS_SET_HOMING_SPEED |
				    POKEYS_AXIS_SET_MAX_SPEED;
	wish.settings.axis[1].pin_home = 21;
	wish.settings.axis[1].homing_speed = 33;
	wish.settings.axis[1].max_speed = 20000; /* as it is */
	send_wish();
	world_cycle(&world);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLYING);
	settle(200 * MS);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(world.state.config_generation, 1);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_int_equal(world.state.statistics.reconnects, 0);
	assert_int_equal(sim->config.pins.function[12], WIRE_PIN_OUTPUT);
	assert_int_equal(sim->config.encoders.pins[5], 10);
	assert_int_equal(sim->config.engine.axis[1][10 - 8], 21);
	assert_int_equal(sim->config.engine.axis[1][13 - 8], 33);
	assert_int_equal(writes, 4);
	assert_int_equal(sim->stats.saves, 0);
	assert_true(world.state.encoder_enabled >> 5 & 1);
	assert_true(world.state.digital_out_owned[1] & 1 << 4);
	/* once more, and from the beginning: all is there already */
	send_wish();
	world_run(&world, 100 * MS);
	assert_int_equal(writes, 4);
	assert_true(device_report(world.device, &report));
	assert_int_equal(report.state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(report.device.axis[1].pin_home, 21);
}

static void fast_requests_go_out_in_every_cycle_meanwhile(void **state)
{
	uint64_t io, status;

	(void)state;
	wish_pin(12, WIRE_PIN_OUTPUT);
	wish.settings.axis[0].set = POKEYS_AXIS_SET_HOMING_SPEED;
	wish.settings.axis[0].homing_speed = 44;
	send_wish();
	io = world.sent.operation[0xCC];
	status = world.sent.pulse[0];
	for (unsigned int i = 0; i < 60; i++)
		world_cycle(&world);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(world.sent.operation[0xCC] - io, 60);
	assert_in_range(world.sent.pulse[0] - status, 60, 62);
}

static void parts_out_of_range_are_refused_one_by_one(void **state)
{
	struct pokeys_axis_settings *axis = wish.settings.axis;

	(void)state;
	wish.settings.set = POKEYS_SET_AXES | POKEYS_SET_EMERGENCY_PIN | POKEYS_SET_NAME;
	wish.settings.axes = 2;
	wish.settings.emergency_pin = 62;
	strcpy(wish.settings.name, "Router");
	send_wish();
	settle(300 * MS);
	assert_int_equal(world.event_count[EVENT_WISH_REFUSED], 0);
	wish.settings.axes = 9;
	wish.settings.emergency_pin = 66;
	axis[0].set = POKEYS_AXIS_SET_MAX_SPEED | POKEYS_AXIS_SET_HOMING_SPEED;
	axis[0].max_speed = NAN;
	axis[0].homing_speed = 25;
	axis[2].set = POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM;
	axis[2].soft_minimum = 10;
	axis[2].soft_maximum = 5;
	wish_pin(54, WIRE_PIN_ANALOG_IN);
	wish_pin(12, WIRE_PIN_OUTPUT);
	send_wish();
	settle(300 * MS);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_REFUSED);
	assert_int_equal(world.event_count[EVENT_WISH_REFUSED], 5);
	assert_int_equal(world.state.engine.axes_enabled, 2);
	assert_true(device_report(world.device, &report));
	assert_int_equal(report.wanted.axes, 2);
	assert_int_equal(report.wanted.emergency_pin, 62);
	assert_true(fabsf(report.wanted.axis[0].max_speed - 20000) < 0.1f);
	assert_int_equal(report.device.axis[0].homing_speed, 25);
	assert_int_equal(report.wanted.pin_set[6] & 0x40, 0);
	assert_int_equal(report.device.pin_function[12], WIRE_PIN_OUTPUT);
	assert_int_equal(report.refused, POKEYS_SETTING_AXIS);
	assert_int_equal(report.refused_index, 2);
}

/* A refused part takes its old value; it must not meet a new one that it contradicts. */
static void soft_limits_are_refused_together(void **state)
{
	struct pokeys_axis_settings *axis = &wish.settings.axis[2];
	char text[200];

	(void)state;
	axis->set = POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM;
	axis->soft_minimum = 10;
	axis->soft_maximum = 100;
	send_wish();
	settle(300 * MS);
	axis->soft_minimum = 500;
	send_wish();
	settle(300 * MS);
	assert_int_equal(world.event_count[EVENT_WISH_REFUSED], 1);
	event_format(&world.last_event[EVENT_WISH_REFUSED], "mill", text, sizeof(text));
	assert_string_equal(text, "mill: requested setting axis of number 2, soft-maximum, is out "
				  "of range for this device; the previous value stays in use");
	assert_true(device_report(world.device, &report));
	assert_int_equal(report.wanted.axis[2].soft_minimum, 10);
	assert_int_equal(report.wanted.axis[2].soft_maximum, 100);
	assert_int_equal(report.device.axis[2].soft_minimum, 10);
	assert_int_equal(report.device.axis[2].soft_maximum, 100);
}

static void wish_waits_until_the_machine_is_off(void **state)
{
	(void)state;
	world_go(&world, 0, 100000, 0);
	world_machine_on(&world);
	wish.settings.axis[0].set = POKEYS_AXIS_SET_MAX_SPEED;
	wish.settings.axis[0].max_speed = 5000;
	send_wish();
	world_run(&world, 500 * MS);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_WAITING);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_int_equal(writes, 0);
	assert_true(world.state.engine.axis[0].max_speed > 19999);
	world.command.flags = 0;
	settle(500 * MS);
	assert_int_equal(writes, 1);
	assert_true(fabsf(world.state.engine.axis[0].max_speed - 5000) < 0.1f);
}

/* The edge comes in the very cycle in which a write goes out. */
static void nothing_begins_to_move_while_a_setting_is_written(void **state)
{
	const struct sim_link_faults slow = { .delay = { .low_ns = 300 * US } };

	(void)state;
	held_back = true;
	world_faults(&world, &slow);
	for (unsigned int delay = 0; delay < 30; delay++) {
		world.command.flags = 0;
		world_run(&world, 100 * MS);
		world_go(&world, 0, world.state.engine.axis[0].position + 500, 0);
		wish.settings.axis[1].set = POKEYS_AXIS_SET_HOMING_SPEED;
		wish.settings.axis[1].homing_speed = (uint8_t)(1 + delay);
		wish_pin(12, delay & 1 ? WIRE_PIN_OUTPUT : WIRE_PIN_INPUT);
		send_wish();
		for (unsigned int i = 0; i < delay; i++)
			world_cycle(&world);
		world.command.flags = POKEYS_COMMAND_MACHINE_ON;
		world_until(&world, world_is_machine_on, 1 * SECOND);
	}
}

static void generator_takes_effect_by_a_reboot_of_the_engine(void **state)
{
	const uint64_t reboots = world.sent.pulse[0x05];

	(void)state;
	wish.settings.set = POKEYS_SET_POWER_STATES | POKEYS_SET_AXES;
	wish.settings.power_states = 0x01;
	wish.settings.axes = 3;
	send_wish();
	settle(4 * SECOND);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(world.sent.pulse[0x05] - reboots, 1);
	assert_int_equal(world.state.engine.power_states, 0x01);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	/* what needs no reboot gets none */
	wish.settings.set |= POKEYS_SET_EMERGENCY_INVERT;
	wish.settings.emergency_invert = 1;
	send_wish();
	settle(1 * SECOND);
	assert_int_equal(world.rig.device.config.engine.emergency_invert, 1);
	assert_int_equal(world.sent.pulse[0x05] - reboots, 1);
}

static bool is_settled(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_APPLIED;
}

/* Machine-on between the write and the reboot: what is permitted moves, the reboot waits. */
static void machine_on_is_not_held_up_by_a_reboot_that_is_due(void **state)
{
	unsigned int moved = 0;

	for (unsigned int i = 0; i < 5; i++) {
		begin(state);
		world_go(&world, 0, 500, 0);
		world_run(&world, 20 * MS);
		wish.settings.set = POKEYS_SET_POWER_STATES;
		wish.settings.power_states = 0x01;
		send_wish();
		while (!world.sent.pulse[0x01])
			world_cycle(&world);
		for (unsigned int cycle = 0; cycle < i; cycle++)
			world_cycle(&world);
		world.command.flags |= POKEYS_COMMAND_MACHINE_ON;
		world_run(&world, SECOND);
		if (world.state.flags & POKEYS_STATE_MACHINE_ON) {
			assert_int_equal(world_pulses(&world, 0), 500);
			assert_int_equal(world.sent.pulse[0x05], 0);
			assert_int_equal(world.state.config_state, POKEYS_CONFIG_WAITING);
			moved++;
		}
		world.command.flags &= ~(uint32_t)POKEYS_COMMAND_MACHINE_ON;
		world_until(&world, is_settled, 5 * SECOND);
		assert_int_equal(world.state.engine.power_states, 0x01);
		assert_int_equal(world.sent.pulse[0x05], 1);
	}
	assert_true(moved);
}

static void wish_that_the_device_does_not_take_is_reported_and_the_link_runs_on(void **state)
{
	(void)state;
	world.rig.device.config.identity.locked = 1;
	world_run(&world, 3 * SECOND); /* seen */
	wish_pin(12, WIRE_PIN_OUTPUT);
	send_wish();
	settle(500 * MS);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_REFUSED);
	assert_in_range(world.event_count[EVENT_CONFIG_REFUSED], 1, 2);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_true(device_report(world.device, &report));
	assert_int_equal(report.refused, POKEYS_SETTING_PIN);
	assert_int_equal(report.refused_index, 12);
	/* nor does it keep the link from running when the device is found again */
	sim_rig_silence(&world.rig, world.now, 500 * MS);
	world_until(&world, world_is_lost, 1 * SECOND);
	world_until(&world, world_is_running, 2 * SECOND);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_REFUSED);
	/* unlocked, and somebody says so */
	world.rig.device.config.identity.locked = 0;
	world_run(&world, 3 * SECOND);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_APPLY), 0);
	settle(500 * MS);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
}

static void wish_outlives_a_restart_of_the_device(void **state)
{
	(void)state;
	wish_pin(12, WIRE_PIN_OUTPUT);
	send_wish();
	settle(500 * MS);
	sim_rig_reboot(&world.rig, world.now, false);
	world_run(&world, 1 * SECOND);
	world_until(&world, world_is_running, 3 * SECOND);
	settle(500 * MS);
	assert_int_equal(world.rig.device.config.pins.function[12], WIRE_PIN_OUTPUT);
}

static void wish_ends_with_its_commander(void **state)
{
	(void)state;
	wish_pin(12, WIRE_PIN_OUTPUT);
	send_wish();
	settle(500 * MS);
	/* the next one has wished before its first command is seen */
	wish.session = 6;
	wish_pin(16, WIRE_PIN_OUTPUT);
	send_wish();
	world_commander(&world, 6);
	world_run(&world, 100 * MS);
	settle(500 * MS);
	assert_int_equal(world.state.config_generation, 2);
	/* and the one after that wishes nothing: what is applied stays, and is not wanted */
	world_commander(&world, 7);
	world_run(&world, 100 * MS);
	assert_int_equal(world.state.config_generation, 0);
	assert_int_equal(world.rig.device.config.pins.function[16], WIRE_PIN_OUTPUT);
	sim_rig_reboot(&world.rig, world.now, false);
	world_run(&world, 1 * SECOND);
	world_until(&world, world_is_running, 3 * SECOND);
	assert_int_equal(world.rig.device.config.pins.function[12], 0);
	assert_int_equal(world.rig.device.config.pins.function[16], 0);
	assert_true(device_report(world.device, &report));
	assert_int_equal(report.wanted.pin_set[1], 0);
	assert_int_equal(report.wanted.axes, 3);
}

static void what_pokeysd_conf_wants_can_be_replaced(void **state)
{
	struct pokeys_settings wanted = world.config.settings;

	(void)state;
	wanted.pin_set[1] = 1 << 4;
	wanted.pin_function[12] = WIRE_PIN_OUTPUT;
	device_wanted(world.device, &wanted);
	settle(500 * MS);
	assert_int_equal(world.rig.device.config.pins.function[12], WIRE_PIN_OUTPUT);
}

static void orders_of_a_terminal_are_done_only_while_nothing_moves(void **state)
{
	(void)state;
	assert_int_equal(device_order(world.device, (enum device_order)77), -EINVAL);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_SAVE), 0);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_SAVE), -EALREADY);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.rig.device.stats.saves, 1);
	assert_int_equal(world.last_event[EVENT_ONE_SHOT].c, POKEYS_OUTCOME_DONE);
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_SAVE), -EBUSY);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_REBOOT), -EBUSY);
	world.command.flags = 0;
	world_run(&world, 100 * MS);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_REBOOT), 0);
	while (world.state.link == POKEYS_LINK_RUNNING)
		world_cycle(&world);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_SAVE), -ENOTCONN);
	world_until(&world, world_is_running, 5 * SECOND);
}

/* Each save wears the flash, whoever wants it. */
static void flash_is_not_written_again_within_two_seconds(void **state)
{
	const struct pokeys_one_shot save = { .operation = POKEYS_ONE_SHOT_SAVE_CONFIG };
	const struct event *said = &world.last_event[EVENT_ONE_SHOT];

	(void)state;
	assert_int_equal(device_order(world.device, DEVICE_ORDER_SAVE), 0);
	world_run(&world, 1 * SECOND);
	assert_int_equal(said->b, EVENT_ORDERED);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_SAVE), -EAGAIN);
	assert_int_equal(world_do(&world, &save, 1 * SECOND), POKEYS_OUTCOME_REFUSED);
	assert_int_not_equal(said->b, EVENT_ORDERED);
	assert_int_equal(world.rig.device.stats.saves, 1);
	world_run(&world, 2 * SECOND);
	assert_int_equal(world_do(&world, &save, 4 * SECOND), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.rig.device.stats.saves, 2);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_SAVE), -EAGAIN);
	world_run(&world, 2 * SECOND);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_SAVE), 0);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.rig.device.stats.saves, 3);
}

static void wishes_are_applied_under_any_loss(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 2 * MS, 0 },
		.loss = 0.1,
		.duplicate = 0.1,
	};
	uint64_t seed = world_seed();

	(void)state;
	world_faults(&world, &faults);
	for (unsigned int i = 0; i < 20; i++) {
		seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407u;
		wish_pin((unsigned int)(seed >> 33) % 40, WIRE_PIN_OUTPUT);
		wish.settings.axis[i % 3].set |= POKEYS_AXIS_SET_HOMING_SPEED;
		wish.settings.axis[i % 3].homing_speed = (uint8_t)(seed >> 40) % 100;
		send_wish();
		world_run(&world, 1 * MS);
		settle(20 * SECOND);
		assert_int_equal(world.rig.device.config.engine.axis[i % 3][13 - 8],
				 wish.settings.axis[i % 3].homing_speed);
	}
	device_report(world.device, &report);
	assert_memory_equal(report.device.pin_function, world.rig.device.config.pins.function, 55);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(device_s_own_settings_are_reported_though_nobody_wants_them,
				       begin),
		cmocka_unit_test_setup(report_comes_when_something_changed_and_only_then, begin),
		cmocka_unit_test_setup(
			wish_is_applied_while_running_and_only_differences_are_written, begin),
		cmocka_unit_test_setup(fast_requests_go_out_in_every_cycle_meanwhile, begin),
		cmocka_unit_test_setup(parts_out_of_range_are_refused_one_by_one, begin),
		cmocka_unit_test_setup(soft_limits_are_refused_together, begin),
		cmocka_unit_test_setup(wish_waits_until_the_machine_is_off, begin),
		cmocka_unit_test_setup(nothing_begins_to_move_while_a_setting_is_written, begin),
		cmocka_unit_test_setup(generator_takes_effect_by_a_reboot_of_the_engine, begin),
		cmocka_unit_test(machine_on_is_not_held_up_by_a_reboot_that_is_due),
		cmocka_unit_test_setup(
			wish_that_the_device_does_not_take_is_reported_and_the_link_runs_on, begin),
		cmocka_unit_test_setup(wish_outlives_a_restart_of_the_device, begin),
		cmocka_unit_test_setup(wish_ends_with_its_commander, begin),
		cmocka_unit_test_setup(what_pokeysd_conf_wants_can_be_replaced, begin),
		cmocka_unit_test_setup(flash_is_not_written_again_within_two_seconds, begin),
		cmocka_unit_test_setup(orders_of_a_terminal_are_done_only_while_nothing_moves,
				       begin),
		cmocka_unit_test_setup(wishes_are_applied_under_any_loss, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
