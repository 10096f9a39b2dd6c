/* SPDX-License-Identifier: MIT */
/*
 * Where the fields of wire/encoder.h stand in the packet: protocol section
 * 3.8. 0xCD moves thirteen counters at once and knows no mask, so a write of
 * one encoder is a write of its twelve neighbours too.
 */

#include "wire/encoder.h"
#include "wire/layout.h"

WIRE_LAYOUT(encoder_set_req,
	WIRE_F(encoder_set_req, encoder, 2),
	WIRE_F(encoder_set_req, options, 3),
	WIRE_F(encoder_set_req, pin_a, 4),
	WIRE_F(encoder_set_req, pin_b, 5));
WIRE_LAYOUT(encoder_set_rep,
	WIRE_F(encoder_set_rep, status, 2));
WIRE_LAYOUT(encoder_get_req,
	WIRE_F(encoder_get_req, encoder, 2));
WIRE_LAYOUT(encoder_get_rep,
	WIRE_F(encoder_get_rep, encoder, 2),
	WIRE_F(encoder_get_rep, options, 3),
	WIRE_F(encoder_get_rep, pin_a, 4),
	WIRE_F(encoder_get_rep, pin_b, 5));

WIRE_LAYOUT(encoder_raw_req,
	WIRE_F(encoder_raw_req, encoder, 2));
WIRE_LAYOUT(encoder_raw_rep,
	WIRE_F(encoder_raw_rep, encoder, 2),
	WIRE_F(encoder_raw_rep, value, 3));

WIRE_LAYOUT(ultra_encoder_req,
	WIRE_F(ultra_encoder_req, mode, 2),
	WIRE_F(ultra_encoder_req, options, 3),
	WIRE_F(ultra_encoder_req, reset_on_index, 4),
	WIRE_F(ultra_encoder_req, filter, 8));
WIRE_LAYOUT(ultra_encoder_rep,
	WIRE_F(ultra_encoder_rep, status, 2),
	WIRE_F(ultra_encoder_rep, options, 3),
	WIRE_F(ultra_encoder_rep, filter, 8),
	WIRE_F(ultra_encoder_rep, status_copy, 12),
	WIRE_F(ultra_encoder_rep, options_copy, 13));

WIRE_LAYOUT(ultra_test_rep,
	WIRE_F(ultra_test_rep, position, 8),
	WIRE_F(ultra_test_rep, index_count, 12),
	WIRE_F(ultra_test_rep, ticks, 16),
	WIRE_F(ultra_test_rep, speed, 20));

WIRE_LAYOUT(encoder_options_req,
	WIRE_F(encoder_options_req, write, 2),
	WIRE_F(encoder_options_req, option, 8));
WIRE_LAYOUT(encoder_options_rep,
	WIRE_F(encoder_options_rep, option, 8));
WIRE_LAYOUT(encoder_pins_req,
	WIRE_F(encoder_pins_req, write, 2),
	WIRE_F(encoder_pins_req, a, 8),
	WIRE_F(encoder_pins_req, b, 33));
WIRE_LAYOUT(encoder_pins_rep,
	WIRE_F(encoder_pins_rep, a, 8),
	WIRE_F(encoder_pins_rep, b, 33));
WIRE_LAYOUT(encoder_keys_req,
	WIRE_F(encoder_keys_req, write, 2),
	WIRE_F(encoder_keys_req, code, 8),
	WIRE_F(encoder_keys_req, modifier, 33));
WIRE_LAYOUT(encoder_keys_rep,
	WIRE_F(encoder_keys_rep, code, 8),
	WIRE_F(encoder_keys_rep, modifier, 33));

WIRE_LAYOUT(encoders_req,
	WIRE_F(encoders_req, option, 2),
	WIRE_F(encoders_req, value, 8));
WIRE_LAYOUT(encoders_rep,
	WIRE_F(encoders_rep, value, 8));

WIRE_LAYOUT(fast_encoders_req,
	WIRE_F(fast_encoders_req, option, 2),
	WIRE_F(fast_encoders_req, index, 3));
WIRE_LAYOUT(fast_encoders_rep,
	WIRE_F(fast_encoders_rep, status, 2),
	WIRE_F(fast_encoders_rep, index, 3));
