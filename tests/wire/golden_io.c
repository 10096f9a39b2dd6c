/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pins, digital and analog values, counters, PWM. In the rows pins 1..16 are
 * digital inputs, 17..40 outputs, 41..47 analog inputs and 52 an input.
 */

#include "tests/wire/golden.h"

#define FUNCTIONS(first) \
	{ first, X4(2), X4(2), X4(2), 2, 2, 2, X8(4), X8(4), X8(4), X4(8), 8, 8, 8, \
	  X4(0), 2 }

#define INPUTS (PIN(1) | PIN(3) | PIN(16) | PIN(17) | PIN(25) | PIN(45) | PIN(52) | PIN(55))
#define ANALOG43 { 0x0789, 0x0ABC, 0x0DEF, 0x0FFF, 0 }
/* encoder k stands at -5000 + 1000 k */
#define E(k) (uint8_t)(-5000 + 1000 * (k))
#define ENCODERS \
	{ E(0), E(1), E(2), E(3), E(4), E(5), E(6), E(7), E(8), E(9), E(10), E(11), E(12), \
	  E(13), E(14), E(15), E(16), E(17), E(18), E(19), E(20), E(21), E(22), E(23), E(24) }
#define IO_REPLY \
	V(io_rep, .inputs = INPUTS, .analog = ANALOG43, .encoder = ENCODERS, \
	  .matrix = { [0] = 0x01, [4] = 0x80 }, .ultra = 20000)

#define DUTIES(last) { 0, 100, 200, 300, 400, last }

#define NO_KEYS(name, OP, option_) \
	G(name, OP, V(key_map_req, .option = (option_)), V(key_map_rep, .value = { 0 }))

const struct golden golden_io[] = {
	G("PinConfigurationGet/1:0xC0/0x00", PIN_ALL, V(pin_all_req, .option1 = 0),
	  V(pin_all_rep, .settings = 0, .value = FUNCTIONS(2))),
	G("PinConfigurationGet/2:0xC0/0x00", PIN_ALL, V(pin_all_req, .option2 = 1),
	  V(pin_all_rep, .option2 = 1)),
	NO_KEYS("PinConfigurationGet/3:0xC1", KEY_MAP, 0),
	NO_KEYS("PinConfigurationGet/4:0xC2", KEY_CODES, 0),
	NO_KEYS("PinConfigurationGet/5:0xC3", KEY_MODIFIERS, 0),
	NO_KEYS("PinConfigurationGet/6:0xD7", KEY_TRIGGERED, 11),
	NO_KEYS("PinConfigurationGet/7:0xD7", KEY_TRIGGERED, 12),
	NO_KEYS("PinConfigurationGet/8:0xD7", KEY_TRIGGERED, 13),
	NO_KEYS("PinConfigurationGet/9:0xD7", KEY_TRIGGERED, 14),
	/* pin 1 becomes an inverted input */
	G("PinConfigurationSet/1:0xC0/0x01", PIN_ALL,
	  V(pin_all_req, .option1 = 1, .value = FUNCTIONS(0x82)),
	  V(pin_all_rep, .settings = 1, .value = FUNCTIONS(0x82))),
	/* pin 1 counts both edges */
	G("PinConfigurationSet/2:0xC0/0x00", PIN_ALL, V(pin_all_req, .option2 = 2, .value = { 3 }),
	  V(pin_all_rep, .option2 = 2, .value = { 3 })),
	NO_KEYS("PinConfigurationSet/3:0xC1", KEY_MAP, 1),
	NO_KEYS("PinConfigurationSet/4:0xC2", KEY_CODES, 1),
	NO_KEYS("PinConfigurationSet/5:0xC3", KEY_MODIFIERS, 1),
	NO_KEYS("PinConfigurationSet/6:0xD7", KEY_TRIGGERED, 1),
	NO_KEYS("PinConfigurationSet/7:0xD7", KEY_TRIGGERED, 2),
	NO_KEYS("PinConfigurationSet/8:0xD7", KEY_TRIGGERED, 3),
	NO_KEYS("PinConfigurationSet/9:0xD7", KEY_TRIGGERED, 4),
	G("DigitalIOSet/1:0xCC/0x01", IO,
	  V(io_req, .write = 1, .outputs = PIN(17) | PIN(25) | PIN(55), .ignore = PIN(31)),
	  IO_REPLY),
	G("DigitalIOGet/1:0xCC/0x00", IO, V(io_req, .write = 0), IO_REPLY),
	G("DigitalIOSetGet/1:0xCC/0x01", IO,
	  V(io_req, .write = 1, .outputs = PIN(17) | PIN(25) | PIN(55), .ignore = PIN(31)),
	  IO_REPLY),
	G("DigitalIOSetSingle/1:0x40", OUTPUT, V(output_req, .pin = 16, .value = 1),
	  V(output_rep, .status = 0)),
	G("DigitalIOGetSingle/1:0x30", INPUT, V(input_req, .pin = 2),
	  V(input_rep, .status = 0, .value = 1)),
	G("AnalogIOGet/1:0x3A", ANALOG, V(analog_req, .first = 1, .count = 0),
	  V(analog_rep, .value = { 0x0123, 0x0456, 0x0789, 0x0ABC, 0x0DEF, 0x0FFF, 0 })),
	G("AnalogRCFilterGet/1:0x38", FILTER_GET, NULL, V(filter_rep, .rc = 50)),
	G("AnalogRCFilterSet/1:0x39", FILTER_SET, V(filter_set_req, .rc = 1000),
	  V(filter_rep, .rc = 1000)),
	/* the counter of 0-based pin p stands at 10 p */
	G("DigitalCounterGet/1:0xD8", COUNTERS,
	  V(counters_req, .pin = { 0, 1, 2, 3, 4, 5, 8, 9, 10, 14, 15, 18, 19 }),
	  V(counters_rep, .value = { 0, 10, 20, 30, 40, 50, 80, 90, 100, 140, 150, 180, 190 })),
	/* the last three are left over from the request before */
	G("DigitalCounterGet/2:0xD8", COUNTERS,
	  V(counters_req, .pin = { 32, 33, 34, 35, 36, 37, 40, 41, 42, 43, 15, 18, 19 }),
	  V(counters_rep,
	    .value = { 320, 330, 340, 350, 360, 370, 400, 410, 420, 430, 150, 180, 190 })),
	G("DigitalCounterClear/1:0x1D", COUNTER_RESET, NULL, NULL),
	G("PWMConfigurationGet/1:0xCB/0x00", PWM, V(pwm_req, .write = 0), V(pwm_rep, .enabled = 0)),
	/* channels 3 and 6, 10 kHz */
	G("PWMConfigurationSet/1:0xCB/0x01", PWM,
	  V(pwm_req, .write = 1, .enabled = 0x24, .duty = DUTIES(500), .period = 2500),
	  V(pwm_rep, .enabled = 0x24, .duty = DUTIES(500), .period = 2500)),
	G("PWMUpdate/1:0xCB/0x01", PWM,
	  V(pwm_req, .write = 1, .duties_only = 1, .enabled = 0x24, .duty = DUTIES(1250),
	    .period = 2500),
	  V(pwm_rep, .enabled = 0x24, .duty = DUTIES(1250), .period = 2500)),
	{ .name = NULL },
};
