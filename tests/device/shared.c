/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Terminals that two parts of the device use, on the board that is there: told once, with
 * both keys, whoever wants the one and the other, and told again when it comes back.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"
#include "wire/model.h"
#include "wire/pulse.h"

static struct world world;
static struct pokeys_wish wish;
static struct pokeys_report report;

static void begin(uint8_t hardware)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US,
		.device.hardware = hardware,
	};

	world_init(&world, &options);
	memset(&wish, 0, sizeof(wish));
	wish.session = 5;
}

static void settle(struct world *w)
{
	world_until(w, world_is_running, 10 * SECOND);
	for (int i = 0; i < 500; i++) {
		world_cycle(w);
		device_report(w->device, &report);
	}
	assert_int_equal(report.state, POKEYS_CONFIG_APPLIED);
}

static void send_wish(void)
{
	wish.generation++;
	device_wish(world.device, &wish);
	settle(&world);
}

static void assert_told(unsigned int times, const char *expected)
{
	char line[256];

	assert_int_equal(world.event_count[EVENT_TERMINALS_SHARED], times);
	event_format(&world.last_event[EVENT_TERMINALS_SHARED], "mill", line, sizeof(line));
	assert_string_equal(line, expected);
}

static void what_the_device_has_from_somebody_else_is_told(void **state)
{
	(void)state;
	begin(WIRE_HW_57CNC);
	world.rig.device.config.encoders.ultra_on = 1;
	world_pin(&world, 11, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_commander(&world, 5);
	settle(&world);
	assert_told(1, "mill: terminal 12 is used by digital-outputs and by ultra-fast-encoder on "
		       "this board, and can only be used by one of them; remove "
		       "the other in pokeysd.conf or in HAL");
	/* what else is configured does not tell it again */
	wish.settings.set = POKEYS_SET_ANALOG_FILTER;
	wish.settings.analog_filter = 3;
	send_wish();
	assert_int_equal(world.event_count[EVENT_TERMINALS_SHARED], 1);
}

static void a_commanders_wish_is_told_when_it_begins(void **state)
{
	(void)state;
	begin(WIRE_HW_57CNC);
	world_pin(&world, 7, WIRE_PIN_OUTPUT);
	world_pin(&world, 12, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_commander(&world, 5);
	settle(&world);
	assert_int_equal(world.event_count[EVENT_TERMINALS_SHARED], 0);
	for (unsigned int i = 1; i <= 2; i++) {
		wish.settings.set = POKEYS_SET_ULTRA_FAST;
		wish.settings.ultra_enable = 1;
		send_wish();
		assert_told(i, "mill: terminals 8 and 13 are used by digital-outputs and by "
			       "ultra-fast-encoder on this board, and can only be used by one of "
			       "them; remove the other in pokeysd.conf or in HAL");
		wish.settings.ultra_enable = 0;
		send_wish();
		assert_int_equal(world.event_count[EVENT_TERMINALS_SHARED], i);
	}
}

/* The bus of the external generator is at terminals of a PoKeys57E only. */
static void it_is_judged_by_the_board_that_is_there(void **state)
{
	static const uint8_t boards[] = { WIRE_HW_57CNC, WIRE_HW_57E };

	(void)state;
	for (unsigned int i = 0; i < 2; i++) {
		begin(boards[i]);
		world_axes(&world);
		world.config.settings.set |= POKEYS_SET_GENERATOR;
		world.config.settings.generator = WIRE_GENERATOR_EXTENDED_IO;
		world_pin(&world, 35, WIRE_PIN_OUTPUT);
		world_start(&world);
		world_commander(&world, 5);
		settle(&world);
		assert_int_equal(world.event_count[EVENT_TERMINALS_SHARED], i);
	}
	assert_told(1, "mill: terminal 36 is used by digital-outputs and by generator-extended-io "
		       "on this board, and can only be used by one of them; remove "
		       "the other in pokeysd.conf or in HAL");
}

static void what_the_board_lacks_is_told_once(void **state)
{
	char line[256];

	(void)state;
	for (unsigned int i = 0; i < 2; i++) {
		begin(i ? WIRE_HW_57E : WIRE_HW_57CNC);
		world_pin(&world, 2, WIRE_PIN_OUTPUT);
		world_pin(&world, 6, WIRE_PIN_INPUT);
		world_pin(&world, 26, WIRE_PIN_INPUT | WIRE_PIN_INVERT);
		world_pin(&world, 8, WIRE_PIN_INPUT);
		world_start(&world);
		world_commander(&world, 5);
		settle(&world);
		assert_int_equal(world.event_count[EVENT_TERMINALS_ABSENT], i ? 0 : 2);
		if (i)
			break;
		event_format(&world.last_event[EVENT_TERMINALS_ABSENT], "mill", line, sizeof(line));
		assert_string_equal(line, "mill: terminal 3 cannot be a digital output on this "
					  "board; choose another one in pokeysd.conf or in HAL "
					  "(pokeysctl terminals MODEL lists them)");
		wish.settings.set = POKEYS_SET_ANALOG_FILTER;
		wish.settings.analog_filter = 3;
		send_wish();
		assert_int_equal(world.event_count[EVENT_TERMINALS_ABSENT], 2);
		wish.settings.pin_set[6] = 1;
		wish.settings.pin_function[48] = WIRE_PIN_COUNTER | WIRE_PIN_INPUT;
		send_wish();
		event_format(&world.last_event[EVENT_TERMINALS_ABSENT], "mill", line, sizeof(line));
		assert_non_null(strstr(line, "terminal 49 cannot be a counter on this board; "));
	}
}

static void a_commanders_pwm_is_told_when_it_begins(void **state)
{
	(void)state;
	begin(WIRE_HW_57CNC);
	world_pin(&world, 21, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_commander(&world, 5);
	settle(&world);
	world.command.pwm_enable = 1u << 1;
	settle(&world);
	assert_int_equal(world.event_count[EVENT_TERMINALS_SHARED], 0);
	for (unsigned int i = 0; i < 3; i++) {
		world.command.pwm_enable = i % 2 ? 0 : 1;
		settle(&world);
		assert_told(1, "mill: terminal 22 is used by digital-outputs and by pwm.0.enable "
			       "on this board, and can only be used by one of them; remove the "
			       "other in pokeysd.conf or in HAL");
	}
}

/* Nothing is known of the terminals of these boards. */
static void a_board_without_a_map_is_not_told_that_it_lacks_all(void **state)
{
	static const uint8_t boards[] = { WIRE_HW_OEM, WIRE_HW_X15 };

	(void)state;
	for (size_t i = 0; i < sizeof(boards); i++) {
		begin(boards[i]);
		world_pin(&world, 2, WIRE_PIN_OUTPUT);
		world_pin(&world, 6, WIRE_PIN_INPUT);
		world_start(&world);
		world_commander(&world, 5);
		settle(&world);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
		assert_int_equal(world.event_count[EVENT_TERMINALS_ABSENT], 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_board_without_a_map_is_not_told_that_it_lacks_all),
		cmocka_unit_test(what_the_device_has_from_somebody_else_is_told),
		cmocka_unit_test(what_the_board_lacks_is_told_once),
		cmocka_unit_test(a_commanders_pwm_is_told_when_it_begins),
		cmocka_unit_test(a_commanders_wish_is_told_when_it_begins),
		cmocka_unit_test(it_is_judged_by_the_board_that_is_there),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
