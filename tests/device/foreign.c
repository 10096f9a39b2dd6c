/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Another program writes a setting of the device while the link runs: it is seen, told
 * once, counted, and set again as soon as nothing may move, and not before.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"

enum { PIN = 30 }; /* terminal 31, which is on in the safe state */

static struct world world;
static uint64_t pin_writes, changed;

static void count(struct world *w, const uint8_t *packet)
{
	(void)w;
	pin_writes += packet[1] == 0xC0 && packet[2] == 1;
}

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	world_pin(&world, PIN, WIRE_PIN_OUTPUT);
	world_pin(&world, PIN + 1, WIRE_PIN_OUTPUT);
	world.watch = count;
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 1 * SECOND);
	world_go(&world, 0, 0, 0);
	world_run(&world, 100 * MS);
	pin_writes = 0;
	changed = world.event_count[EVENT_CONFIG_CHANGED];
	return 0;
}

static uint8_t *function(unsigned int pin)
{
	return &world.rig.device.config.pins.function[pin];
}

static void settings_are_read_and_nothing_is_said(void **state)
{
	const uint64_t before = world.sent.operation[0xC0];

	(void)state;
	world_machine_on(&world);
	for (int i = 0; i < 20000; i++) {
		world_cycle(&world);
		assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	}
	assert_in_range(world.sent.operation[0xC0] - before, 19, 21);
	assert_int_equal(world.event_count[EVENT_CONFIG_FOREIGN], 0);
	assert_int_equal(world.event_count[EVENT_CONFIG_CHANGED], changed);
	assert_int_equal(world.state.config_foreign, 0);
	assert_int_equal(pin_writes, 0);
	assert_true(world_is_machine_on(&world));
}

static void an_output_that_was_made_an_input_is_told_and_set_again(void **state)
{
	char line[256];

	(void)state;
	*function(PIN) = WIRE_PIN_INPUT;
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.event_count[EVENT_CONFIG_FOREIGN], 1);
	event_format(&world.last_event[EVENT_CONFIG_FOREIGN], "mill", line, sizeof(line));
	assert_string_equal(line, "mill: somebody else has changed terminal 31 to digital input; "
				  "until the machine is off, this applies, then it is set "
				  "again. Look for another program that uses this device");
	assert_int_equal(world.state.config_foreign, 1);
	assert_int_equal(*function(PIN), WIRE_PIN_OUTPUT);
	assert_int_equal(pin_writes, 1);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_true(world.state.digital_out_owned[PIN / 8] >> PIN % 8 & 1);
}

static bool is_seen(struct world *w)
{
	return w->state.config_foreign > 0;
}

static void nothing_is_written_while_the_machine_is_on(void **state)
{
	(void)state;
	world_machine_on(&world);
	*function(PIN) = 0;
	*function(PIN + 1) = WIRE_PIN_INPUT;
	world_until(&world, is_seen, 10 * SECOND);
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.event_count[EVENT_CONFIG_FOREIGN], 2);
	assert_int_equal(world.state.config_foreign, 2);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_WAITING);
	assert_false(world.state.digital_out_owned[PIN / 8] >> PIN % 8 & 1);
	assert_int_equal(pin_writes, 0);
	assert_true(world_is_machine_on(&world));
	world_machine_off(&world);
	world_run(&world, 2 * SECOND);
	assert_int_equal(*function(PIN), WIRE_PIN_OUTPUT);
	assert_int_equal(*function(PIN + 1), WIRE_PIN_OUTPUT);
	assert_int_equal(world.event_count[EVENT_CONFIG_FOREIGN], 2);
}

/* ... and it may be put back meanwhile, or there was nothing but one odd answer. */
static void what_is_put_back_is_ours_again(void **state)
{
	(void)state;
	world_machine_on(&world);
	world_output(&world, PIN, true);
	*function(PIN) = WIRE_PIN_INPUT;
	world_until(&world, is_seen, 10 * SECOND);
	assert_false(world.state.digital_out_owned[PIN / 8] >> PIN % 8 & 1);
	*function(PIN) = WIRE_PIN_OUTPUT;
	world_run(&world, 10 * SECOND);
	assert_true(world.state.digital_out_owned[PIN / 8] >> PIN % 8 & 1);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(pin_writes, 0);
	assert_int_equal(world.event_count[EVENT_CONFIG_CHANGED], changed);
	world_output(&world, PIN, false);
	world_run(&world, 100 * MS);
	assert_false(world_latch(&world, PIN));
	/* another one later is seen as well */
	*function(PIN + 1) = WIRE_PIN_INPUT;
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.state.config_foreign, 2);
}

static unsigned int readings;

static void damage(struct world *w, const uint8_t *packet)
{
	count(w, packet);
	if (packet[1] != 0xC0 || packet[2] == 1)
		return;
	*function(PIN) = readings++ % 2 ? WIRE_PIN_OUTPUT : WIRE_PIN_INPUT;
}

static void one_odd_answer_is_not_believed(void **state)
{
	(void)state;
	readings = 0;
	world.watch = damage;
	world_machine_on(&world);
	for (int i = 0; i < 20000; i++) {
		world_cycle(&world);
		assert_true(world.state.digital_out_owned[PIN / 8] >> PIN % 8 & 1);
	}
	assert_true(readings > 10);
	assert_int_equal(world.state.config_foreign, 0);
}

static void again_and_again_is_counted_and_told_each_time(void **state)
{
	(void)state;
	for (unsigned int i = 1; i <= 6; i++) {
		*function(PIN) = WIRE_PIN_INPUT;
		world_run(&world, 10 * SECOND);
		assert_int_equal(*function(PIN), WIRE_PIN_OUTPUT);
		assert_int_equal(world.state.config_foreign, i);
	}
	assert_int_equal(world.event_count[EVENT_CONFIG_FOREIGN], 6);
}

/* Nobody wants anything of it: it is shown as it is. */
static void what_nobody_wants_is_only_shown(void **state)
{
	struct pokeys_report report;

	(void)state;
	device_report(world.device, &report);
	*function(3) = WIRE_PIN_INPUT;
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.state.pin_function[3], WIRE_PIN_INPUT);
	assert_true(device_report(world.device, &report));
	assert_int_equal(report.device.pin_function[3], WIRE_PIN_INPUT);
	assert_int_equal(world.event_count[EVENT_CONFIG_FOREIGN], 0);
	/* a reading that brings nothing new is no report */
	device_report(world.device, &report);
	world_run(&world, 10 * SECOND);
	assert_false(device_report(world.device, &report));
}

static void any_setting_is_seen(void **state)
{
	(void)state;
	world.rig.device.config.engine.axis[1][0] ^= 0x08; /* position mode */
	world_run(&world, 15 * SECOND);
	assert_int_equal(world.state.config_foreign, 1);
	assert_int_equal(world.last_event[EVENT_CONFIG_FOREIGN].b, 1);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
}

static bool lose_all(struct world *w, const uint8_t *packet)
{
	(void)w;
	return packet[1] == 0xC0;
}

static void a_reading_without_an_answer_says_nothing(void **state)
{
	(void)state;
	world.lose_reply = lose_all;
	world_run(&world, 20 * SECOND);
	world.lose_reply = NULL;
	assert_int_equal(world.event_count[EVENT_CONFIG_REFUSED], 0);
	assert_int_equal(world.event_count[EVENT_CONFIG_FOREIGN], 0);
	*function(PIN) = WIRE_PIN_INPUT;
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.state.config_foreign, 1);
	assert_int_equal(*function(PIN), WIRE_PIN_OUTPUT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(settings_are_read_and_nothing_is_said, begin),
		cmocka_unit_test_setup(an_output_that_was_made_an_input_is_told_and_set_again,
				       begin),
		cmocka_unit_test_setup(nothing_is_written_while_the_machine_is_on, begin),
		cmocka_unit_test_setup(what_is_put_back_is_ours_again, begin),
		cmocka_unit_test_setup(one_odd_answer_is_not_believed, begin),
		cmocka_unit_test_setup(again_and_again_is_counted_and_told_each_time, begin),
		cmocka_unit_test_setup(what_nobody_wants_is_only_shown, begin),
		cmocka_unit_test_setup(any_setting_is_seen, begin),
		cmocka_unit_test_setup(a_reading_without_an_answer_says_nothing, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
