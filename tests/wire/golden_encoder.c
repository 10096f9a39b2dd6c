/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Encoders: encoder k stands at -5000 + 1000 k, the ultra-fast one at 20000
 * after nine index pulses.
 */

#include "tests/wire/golden.h"

const struct golden golden_encoder[] = {
	G("EncoderConfigurationGet/1:0xC4", ENCODER_OPTIONS, V(encoder_options_req, .write = 0),
	  V(encoder_options_rep, .option = { 0 })),
	G("EncoderConfigurationGet/2:0xC5", ENCODER_PINS, V(encoder_pins_req, .write = 0),
	  V(encoder_pins_rep, .a = { 0 })),
	G("EncoderConfigurationGet/3:0xC6", ENCODER_KEYS_A, V(encoder_keys_req, .write = 0),
	  V(encoder_keys_rep, .code = { 0 })),
	G("EncoderConfigurationGet/4:0xC7", ENCODER_KEYS_B, V(encoder_keys_req, .write = 0),
	  V(encoder_keys_rep, .code = { 0 })),
	G("EncoderConfigurationGet/5:0xCE", FAST_ENCODERS, V(fast_encoders_req, .option = 2),
	  V(fast_encoders_rep, .status = 10, .index = 0)),
	G("EncoderConfigurationGet/6:0x1C", ULTRA_ENCODER, V(ultra_encoder_req, .mode = 0xFF),
	  V(ultra_encoder_rep, .status = 1, .options = 4, .filter = 300, .status_copy = 1,
	    .options_copy = 4)),
	/* encoder 3 (0-based): enabled, four edges, pins 7 and 8 */
	G("EncoderConfigurationSet/1:0xC4", ENCODER_OPTIONS,
	  V(encoder_options_req, .write = 1, .option = { 0, 0, 0, 3 }),
	  V(encoder_options_rep, .option = { 0, 0, 0, 3 })),
	G("EncoderConfigurationSet/2:0xC5", ENCODER_PINS,
	  V(encoder_pins_req, .write = 1, .a = { 0, 0, 0, 6 }, .b = { 0, 0, 0, 7 }),
	  V(encoder_pins_rep, .a = { 0, 0, 0, 6 }, .b = { 0, 0, 0, 7 })),
	G("EncoderConfigurationSet/3:0xC6", ENCODER_KEYS_A, V(encoder_keys_req, .write = 1),
	  V(encoder_keys_rep, .code = { 0 })),
	G("EncoderConfigurationSet/4:0xC7", ENCODER_KEYS_B, V(encoder_keys_req, .write = 1),
	  V(encoder_keys_rep, .code = { 0 })),
	G("EncoderConfigurationSet/5:0xCE", FAST_ENCODERS,
	  V(fast_encoders_req, .option = 10, .index = 1),
	  V(fast_encoders_rep, .status = 10, .index = 1)),
	G("EncoderConfigurationSet/6:0x1C", ULTRA_ENCODER,
	  V(ultra_encoder_req, .mode = 1, .options = 4, .filter = 100),
	  V(ultra_encoder_rep, .status = 1, .options = 4, .filter = 100, .status_copy = 1,
	    .options_copy = 4)),
	G("EncoderValuesGet/1:0xCD/0x00", ENCODERS, V(encoders_req, .option = 0),
	  V(encoders_rep, .value = { -5000, -4000, -3000, -2000, -1000, 0, 1000, 2000, 3000, 4000,
				     5000, 6000, 7000 })),
	G("EncoderValuesGet/2:0xCD/0x01", ENCODERS, V(encoders_req, .option = 1),
	  V(encoders_rep, .value = { 8000, 9000, 10000, 11000, 12000, 13000, 14000, 15000, 16000,
				     17000, 18000, 19000, 20000 })),
	G("EncoderValuesGet/3:0x85/0x37", ULTRA_TEST, NULL,
	  V(ultra_test_rep, .position = 20000, .index_count = 9, .ticks = 4000, .speed = 250)),
	G("EncoderValuesSet/1:0xCD/0x0A", ENCODERS,
	  V(encoders_req, .option = 10, .value = { 0, -2, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12 }),
	  V(encoders_rep, .value = { 0 })),
	G("EncoderValuesSet/2:0xCD/0x0B", ENCODERS,
	  V(encoders_req, .option = 11,
	    .value = { 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25 }),
	  V(encoders_rep, .value = { 0 })),
	{ .name = NULL },
};
