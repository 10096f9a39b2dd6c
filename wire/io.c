/* SPDX-License-Identifier: MIT */
/*
 * Where the fields of wire/io.h stand in the packet: protocol sections 3.2 to
 * 3.7.
 *
 * Analog values are the only big-endian values of the runtime commands, and
 * the duties of 0xCB are 32-bit values at odd offsets.
 */

#include "wire/io.h"
#include "wire/layout.h"

WIRE_LAYOUT(pin_set_req,
	WIRE_F(pin_set_req, pin, 2),
	WIRE_F(pin_set_req, function, 3),
	WIRE_F(pin_set_req, options, 4));
WIRE_LAYOUT(pin_set_rep,
	WIRE_F(pin_set_rep, status, 2));

WIRE_LAYOUT(pin_get_req,
	WIRE_F(pin_get_req, pin, 2));
WIRE_LAYOUT(pin_get_rep,
	WIRE_F(pin_get_rep, pin, 2),
	WIRE_F(pin_get_rep, function, 3),
	WIRE_F(pin_get_rep, options, 4),
	WIRE_F(pin_get_rep, extended, 5));

WIRE_LAYOUT(pin_caps_req,
	WIRE_F(pin_caps_req, range, 2));
WIRE_LAYOUT(pin_caps_rep,
	WIRE_F(pin_caps_rep, mask, 8));

WIRE_LAYOUT(input_req,
	WIRE_F(input_req, pin, 2));
WIRE_LAYOUT(input_rep,
	WIRE_F(input_rep, status, 2),
	WIRE_F(input_rep, value, 3));
WIRE_LAYOUT(inputs_low_rep,
	WIRE_F(inputs_low_rep, inputs, 2));
WIRE_LAYOUT(inputs_high_rep,
	WIRE_F(inputs_high_rep, inputs, 2));

WIRE_LAYOUT(analog_one_req,
	WIRE_F(analog_one_req, pin, 2));
WIRE_LAYOUT(analog_one_rep,
	WIRE_F(analog_one_rep, status, 2),
	WIRE_F(analog_one_rep, value8, 3),
	WIRE_F(analog_one_rep, high, 4),
	WIRE_F(analog_one_rep, low, 5));
WIRE_LAYOUT(analog_4x8_req,
	WIRE_F(analog_4x8_req, pin, 2));
WIRE_LAYOUT(analog_4x8_rep,
	WIRE_F(analog_4x8_rep, value, 2));
WIRE_LAYOUT(analog_3x10_req,
	WIRE_F(analog_3x10_req, pin, 2));
WIRE_LAYOUT(analog_3x10_rep,
	WIRE_F(analog_3x10_rep, packed, 2));

WIRE_LAYOUT(filter_rep,
	WIRE_F(filter_rep, rc, 2));
WIRE_LAYOUT(filter_set_req,
	WIRE_F(filter_set_req, rc, 2));

WIRE_LAYOUT(analog_req,
	WIRE_F(analog_req, first, 2),
	WIRE_F(analog_req, count, 3));
WIRE_LAYOUT(analog_rep,
	WIRE_BE(analog_rep, value, 8));

WIRE_LAYOUT(output_req,
	WIRE_F(output_req, pin, 2),
	WIRE_F(output_req, value, 3));
WIRE_LAYOUT(output_rep,
	WIRE_F(output_rep, status, 2));
WIRE_LAYOUT(outputs_low_req,
	WIRE_F(outputs_low_req, outputs, 2));
WIRE_LAYOUT(outputs_high_req,
	WIRE_F(outputs_high_req, outputs, 2));

WIRE_LAYOUT(analog_out_req,
	WIRE_F(analog_out_req, pin, 2),
	WIRE_BE(analog_out_req, value, 3));
WIRE_LAYOUT(analog_out_rep,
	WIRE_F(analog_out_rep, status, 2));

WIRE_LAYOUT(pin_all_req,
	WIRE_F(pin_all_req, option1, 2),
	WIRE_F(pin_all_req, option2, 3),
	WIRE_F(pin_all_req, value, 8));
WIRE_LAYOUT(pin_all_rep,
	WIRE_F(pin_all_rep, settings, 2),
	WIRE_F(pin_all_rep, option2, 3),
	WIRE_F(pin_all_rep, value, 8));

WIRE_LAYOUT(key_map_req,
	WIRE_F(key_map_req, option, 2),
	WIRE_F(key_map_req, value, 8));
WIRE_LAYOUT(key_map_rep,
	WIRE_F(key_map_rep, value, 8));

WIRE_LAYOUT(pwm_req,
	WIRE_F(pwm_req, write, 2),
	WIRE_F(pwm_req, duties_only, 3),
	WIRE_F(pwm_req, enabled, 8),
	WIRE_F(pwm_req, duty, 9),
	WIRE_F(pwm_req, period, 33));
WIRE_LAYOUT(pwm_rep,
	WIRE_F(pwm_rep, enabled, 8),
	WIRE_F(pwm_rep, duty, 9),
	WIRE_F(pwm_rep, period, 33));

WIRE_LAYOUT(io_req,
	WIRE_F(io_req, write, 2),
	WIRE_PINS(io_req, outputs, 8),
	WIRE_BE(io_req, analog_out, 15),
	WIRE_PINS(io_req, ignore, 20));
WIRE_LAYOUT(io_rep,
	WIRE_PINS(io_rep, inputs, 8),
	WIRE_BE(io_rep, analog, 15),
	WIRE_F(io_rep, encoder, 25),
	WIRE_F(io_rep, matrix, 50),
	WIRE_F(io_rep, ultra, 58));

WIRE_LAYOUT(counters_req,
	WIRE_F(counters_req, pin, 8));
WIRE_LAYOUT(counters_rep,
	WIRE_F(counters_rep, value, 8));
WIRE_LAYOUT(counter_dirs_req,
	WIRE_F(counter_dirs_req, write, 2),
	WIRE_F(counter_dirs_req, pin, 8));
WIRE_LAYOUT(counter_dirs_rep,
	WIRE_F(counter_dirs_rep, pin, 8));
