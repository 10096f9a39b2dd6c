/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Spot checks of the capability table against protocol sections 2.3 to 2.5,
 * and what must hold for every model.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "wire/model.h"

#define CNC wire_model(WIRE_HW_57CNC)
#define PKE wire_model(WIRE_HW_57E_V11)
#define PRO wire_model(WIRE_HW_57CNCPRO4X25)
#define DB25 wire_model(WIRE_HW_57CNCDB25)

static void counts_are_those_of_section_2_4(void **state)
{
	/* pins, basic, encoders, fast, ultra, PWM, LED, PoExtBus, EasySensors */
	static const struct {
		uint8_t hardware, n[9];
	} want[] = {
		{ 29, { 55, 25, 26, 3, 1, 6, 2, 10, 100 } },
		{ 31, { 55, 25, 26, 3, 1, 6, 2, 10, 100 } },
		{ 28, { 55, 25, 26, 3, 1, 6, 2, 10, 100 } },
		{ 30, { 55, 25, 26, 3, 1, 6, 2, 10, 100 } },
		{ 32, { 55, 25, 26, 3, 1, 6, 2, 10, 100 } },
		{ 33, { 55, 25, 26, 3, 1, 6, 2, 10, 100 } },
		{ 38, { 17, 0, 0, 0, 0, 6, 0, 10, 100 } },
		{ 11, { 55, 25, 26, 3, 1, 6, 2, 10, 0 } },
		{ 100, { 55, 5, 5, 3, 1, 0, 2, 10, 100 } },
		{ 102, { 55, 25, 26, 0, 0, 6, 0, 10, 100 } },
		{ 39, { 55, 0, 0, 0, 0, 0, 0, 0, 0 } },
		{ 50, { 27, 0, 0, 0, 0, 0, 0, 0, 0 } },
		{ 60, { 16, 0, 0, 0, 0, 0, 0, 0, 0 } },
		{ 37, { 0, 0, 0, 0, 0, 0, 0, 0, 0 } },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(want) / sizeof(want[0]); i++) {
		const struct wire_model *m = wire_model(want[i].hardware);
		const uint8_t got[] = { m->pins,          m->basic_encoders, m->encoders,
					m->fast_encoders, m->ultra_encoders, m->pwm_channels,
					m->matrix_leds,   m->poextbus_bytes, m->easy_sensors };

		for (size_t k = 0; k < sizeof(got); k++) {
			if (got[k] != want[i].n[k])
				fail_msg("%s: count %zu is %u, expected %u", m->name, k, got[k],
					 want[i].n[k]);
		}
	}
}

static void features_are_those_of_section_2_4(void **state)
{
	(void)state;
	assert_false(PKE->features & WIRE_HAS_KEYBOARD);
	assert_true(CNC->features & WIRE_HAS_KEYBOARD);
	assert_true(PRO->features & WIRE_HAS_KEYBOARD);
	assert_true(DB25->features & WIRE_HAS_MATRIX_KB);
	assert_false(DB25->features & (WIRE_HAS_LCD | WIRE_HAS_ANALOG | WIRE_HAS_COUNTERS |
				       WIRE_HAS_1WIRE | WIRE_HAS_WEB));
	assert_true(CNC->features & WIRE_HAS_WEB);
	assert_false(wire_model(WIRE_HW_57U)->features & WIRE_HAS_WEB);
	assert_false(wire_model(WIRE_HW_X15)->features & WIRE_HAS_ANALOG);
	assert_true(wire_model(WIRE_HW_57INDUSTRIAL1)->features & WIRE_HAS_ANALOG);
	assert_false(wire_model(WIRE_HW_57INDUSTRIAL1)->features & WIRE_HAS_PONET);
	assert_true(wire_model(WIRE_HW_56E)->features & WIRE_HAS_SENSOR_LIST);
	assert_false(wire_model(WIRE_HW_56E)->features & WIRE_HAS_PULSE_V2);
	assert_int_equal(CNC->pwm_hz, 25000000);
	assert_int_equal(wire_model(WIRE_HW_OEM)->pwm_hz, 0);
	assert_int_equal(CNC->pulse_axes, 8);
	assert_int_equal(PRO->pulse_axes, 4);
}

static void ethernet_types_are_those_of_section_2_3(void **state)
{
	static const uint8_t ethernet[] = { 11, 21, 29, 31, 32, 33, 40, 41, 45, 50, 100, 102 };
	static const uint8_t usb[] = { 0, 1, 2, 3, 10, 20, 28, 30, 38, 39, 42, 60 };

	(void)state;
	for (size_t i = 0; i < sizeof(ethernet); i++)
		assert_true(wire_model(ethernet[i])->ethernet);
	for (size_t i = 0; i < sizeof(usb); i++)
		assert_false(wire_model(usb[i])->ethernet);
	assert_string_equal(CNC->name, "PoKeys57CNC");
	assert_string_equal(PRO->name, "PoKeys57CNCpro4x25");
	/* the documentation contradicts itself here: even is U, odd is E */
	assert_string_equal(wire_model(30)->name, "PoKeys57U");
	assert_string_equal(wire_model(31)->name, "PoKeys57E");
}

static void unlisted_hardware_is_unknown_and_has_no_pins(void **state)
{
	const struct wire_model *m = wire_model(99);

	(void)state;
	assert_false(m->known);
	assert_int_equal(m->pins, 0);
	assert_non_null(m->name);
	for (unsigned int pin = 0; pin < 64; pin++)
		assert_false(wire_pin_can(m, pin, WIRE_USE_INPUT));
}

/* pins is a list ended by 0, in ascending order. */
static void can_exactly(const struct wire_model *m, enum wire_pin_use use, const uint8_t *pins)
{
	for (unsigned int pin = 0; pin < 80; pin++) {
		const bool want = *pins == pin && pin != 0;

		if (wire_pin_can(m, pin, use) != want)
			fail_msg("%s: pin %u use %d", m->name, pin, use);
		if (want)
			pins++;
	}
	assert_int_equal(*pins, 0);
}

static void pins_of_a_57cnc_are_those_of_section_2_5(void **state)
{
	static const uint8_t in[] = { 1,  2,  3,  4,  5,  6,  8,  9,  10, 11, 12, 13, 14, 15,
				      16, 18, 19, 20, 23, 24, 25, 26, 28, 29, 30, 31, 32, 33,
				      34, 35, 36, 37, 38, 41, 42, 43, 44, 45, 52, 0 };
	static const uint8_t out[] = { 1,  2,  8,  12, 13, 17, 18, 20, 21, 22, 23,
				       24, 25, 26, 28, 29, 30, 31, 32, 33, 34, 35,
				       36, 37, 38, 41, 42, 43, 44, 45, 0 };
	static const uint8_t analog[] = { 41, 42, 43, 44, 45, 0 };
	static const uint8_t pwm[] = { 17, 18, 20, 21, 22, 0 };
	static const uint8_t channels[] = { 22, 21, 20, 0, 18, 17 };

	(void)state;
	can_exactly(CNC, WIRE_USE_INPUT, in);
	can_exactly(CNC, WIRE_USE_OUTPUT, out);
	can_exactly(CNC, WIRE_USE_ANALOG, analog);
	can_exactly(CNC, WIRE_USE_PWM, pwm);
	assert_memory_equal(CNC->pinmap->pwm_pin, channels, sizeof(channels));
	assert_int_equal(CNC->pinmap->fast[1].a, 3);
	assert_int_equal(CNC->pinmap->fast[2].b, 6);
	assert_int_equal(CNC->pinmap->ultra.a, 8);
	assert_int_equal(CNC->pinmap->ultra.index, 13);
}

static void pins_of_a_57e_are_those_of_section_2_5(void **state)
{
	static const uint8_t analog[] = { 41, 42, 43, 44, 45, 46, 47, 0 };
	static const uint8_t pwm[] = { 17, 18, 19, 20, 21, 22, 0 };
	static const uint8_t channels[] = { 22, 21, 20, 19, 18, 17 };

	(void)state;
	for (unsigned int pin = 1; pin <= 55; pin++) {
		assert_true(wire_pin_can(PKE, pin, WIRE_USE_INPUT));
		assert_true(wire_pin_can(PKE, pin, WIRE_USE_OUTPUT));
	}
	assert_false(wire_pin_can(PKE, 56, WIRE_USE_INPUT));
	can_exactly(PKE, WIRE_USE_ANALOG, analog);
	can_exactly(PKE, WIRE_USE_PWM, pwm);
	assert_memory_equal(PKE->pinmap->pwm_pin, channels, sizeof(channels));
	assert_int_equal(PKE->pinmap->fast[1].a, 5);
	assert_int_equal(PKE->pinmap->fast[2].index, 27);
}

static void pins_of_the_small_boards_are_those_of_section_2_5(void **state)
{
	static const uint8_t pro_in[] = { 8,  12, 13, 14, 18, 19, 23, 24, 25, 26, 28, 29, 30, 31,
					  32, 33, 34, 35, 36, 37, 38, 41, 42, 43, 44, 52, 0 };
	static const uint8_t pro_out[] = { 8, 12, 13, 17, 20, 31, 32, 33, 34, 35, 36, 37, 38, 0 };
	static const uint8_t pro_pwm[] = { 0, 0, 20, 0, 0, 17 };
	static const uint8_t db_in[] = { 10, 11, 12, 13, 15, 0 };
	static const uint8_t db_out[] = { 1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 16, 17, 0 };
	static const uint8_t db_pwm[] = { 17, 1, 14, 2, 3, 16 };
	static const uint8_t none[] = { 0 };

	(void)state;
	can_exactly(PRO, WIRE_USE_INPUT, pro_in);
	can_exactly(PRO, WIRE_USE_OUTPUT, pro_out);
	assert_memory_equal(PRO->pinmap->pwm_pin, pro_pwm, sizeof(pro_pwm));
	can_exactly(DB25, WIRE_USE_INPUT, db_in);
	can_exactly(DB25, WIRE_USE_OUTPUT, db_out);
	can_exactly(DB25, WIRE_USE_ANALOG, none);
	assert_memory_equal(DB25->pinmap->pwm_pin, db_pwm, sizeof(db_pwm));
}

static void counter_pins_are_those_the_library_asks_for(void **state)
{
	/* both requests of row DigitalCounterGet, 1-based */
	static const uint8_t cnc[] = { 1,  2,  3,  4,  5,  6,  9,  10, 11, 15, 16, 19,
				       20, 33, 34, 35, 36, 37, 38, 41, 42, 43, 44, 0 };
	static const uint8_t pke[] = { 1,  2,  5,  6,  9,  11, 15, 16, 19, 20, 21, 22, 23,
				       24, 25, 26, 27, 28, 41, 42, 43, 44, 46, 48, 49, 0 };
	static const uint8_t pro[] = { 19, 0 };

	(void)state;
	can_exactly(CNC, WIRE_USE_COUNTER, cnc);
	can_exactly(PKE, WIRE_USE_COUNTER, pke);
	can_exactly(PRO, WIRE_USE_COUNTER, pro);
}

static void models_are_consistent(void **state)
{
	(void)state;
	for (unsigned int hardware = 0; hardware < 256; hardware++) {
		const struct wire_model *m = wire_model((uint8_t)hardware);
		const struct wire_pinmap *map = m->pinmap;
		const uint64_t all = map->digital_in | map->digital_out | map->analog_in |
				     map->counter | map->pwm;

		assert_non_null(m->name);
		assert_true(m->pins <= 55);
		if (m->pins < 55)
			assert_int_equal(all >> m->pins, 0);
		assert_true(m->basic_encoders <= m->encoders);
		assert_true(m->pwm_channels <= WIRE_MODEL_PWMS);
		/* a channel's pin is a PWM pin, and every PWM pin has a channel */
		for (unsigned int ch = 0; ch < WIRE_MODEL_PWMS; ch++) {
			if (map->pwm_pin[ch])
				assert_true(wire_pin_can(m, map->pwm_pin[ch], WIRE_USE_PWM));
		}
		if (!m->known)
			assert_int_equal(m->pins, 0);
	}
}

/* Signals that have terminals only while they are in use are at terminals of the board. */
static void signals_are_at_terminals_that_there_are(void **state)
{
	const struct wire_model *m;
	size_t count = 0;

	(void)state;
	for (; (m = wire_model_at(count)); count++) {
		const struct wire_pinmap *map = m->pinmap;
		const uint64_t all = map->digital_in | map->digital_out;

		assert_ptr_equal(wire_model(m->hardware), m);
		assert_int_equal((map->generator | map->generator_io | map->poextbus) & ~all, 0);
		if (map->emergency)
			assert_true(wire_pin_can(m, map->emergency, WIRE_USE_INPUT));
		if (map->charge_pump)
			assert_true(wire_pin_can(m, map->charge_pump, WIRE_USE_OUTPUT));
		for (int i = 0; i < WIRE_MODEL_INTERNAL_AXES; i++) {
			assert_int_equal(!map->step[i], !map->direction[i]);
			if (map->step[i])
				assert_true(wire_pin_can(m, map->step[i], WIRE_USE_OUTPUT) &&
					    wire_pin_can(m, map->direction[i], WIRE_USE_OUTPUT));
		}
	}
	assert_true(count > 30);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(counts_are_those_of_section_2_4),
		cmocka_unit_test(features_are_those_of_section_2_4),
		cmocka_unit_test(ethernet_types_are_those_of_section_2_3),
		cmocka_unit_test(unlisted_hardware_is_unknown_and_has_no_pins),
		cmocka_unit_test(pins_of_a_57cnc_are_those_of_section_2_5),
		cmocka_unit_test(pins_of_a_57e_are_those_of_section_2_5),
		cmocka_unit_test(pins_of_the_small_boards_are_those_of_section_2_5),
		cmocka_unit_test(counter_pins_are_those_the_library_asks_for),
		cmocka_unit_test(models_are_consistent),
		cmocka_unit_test(signals_are_at_terminals_that_there_are),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
