/* SPDX-License-Identifier: MIT */
#ifndef WIRE_ENCODER_H
#define WIRE_ENCODER_H

/*
 * Encoders, protocol section 3.8. Encoder 0..24 are normal ones (0, 1, 2 are
 * the fast ones when those are on), 25 is the ultra-fast one. Pins 0-based.
 */

#include "wire/op.h"

#define WIRE_ENCODERS 26
#define WIRE_ENCODER_ULTRA 25
#define WIRE_ENCODER_BASIC 25
#define WIRE_ENCODER_BANK 13	/* values in one 0xCD packet */

/* Option byte. */
#define WIRE_ENC_ENABLE 0x01
#define WIRE_ENC_4X 0x02
#define WIRE_ENC_2X 0x04

/* 0x11, 0x16 */
struct wire_encoder_set_req {
	uint8_t encoder;
	uint8_t options;
	uint8_t pin_a, pin_b;
};
struct wire_encoder_set_rep {
	uint8_t status; /* 0 OK, 1 error */
};
struct wire_encoder_get_req {
	uint8_t encoder;
};
struct wire_encoder_get_rep {
	uint8_t encoder;
	uint8_t options;
	uint8_t pin_a, pin_b;
};

/* 0x19, 0x1A */
struct wire_encoder_raw_req {
	uint8_t encoder;
};
struct wire_encoder_raw_rep {
	uint8_t encoder;
	uint8_t value;
};

/* 0x1C */
#define WIRE_ULTRA_OFF 0
#define WIRE_ULTRA_ON 1
#define WIRE_ULTRA_READ 0xFF
#define WIRE_ULTRA_INVERT 0x01
#define WIRE_ULTRA_CLOCK_DIR 0x02	/* A is direction, B is clock */
#define WIRE_ULTRA_4X 0x04
struct wire_ultra_encoder_req {
	uint8_t mode; /* WIRE_ULTRA_OFF, _ON, _READ */
	uint8_t options;
	uint8_t reset_on_index; /* 1: zero at the next index, firmware >= 4.2.19 */
	uint32_t filter;        /* delay; unit not documented */
};
struct wire_ultra_encoder_rep {
	uint8_t status; /* 1 on */
	uint8_t options;
	uint32_t filter;
	uint8_t status_copy;
	uint8_t options_copy;
};

/* 0x85/0x37 */
struct wire_ultra_test_rep {
	uint32_t position;
	uint32_t index_count;
	uint32_t ticks; /* in the last rotation */
	uint32_t speed;
};

/* 0xC4, 0xC5, 0xC6, 0xC7 */
struct wire_encoder_options_req {
	uint8_t write;
	uint8_t option[WIRE_ENCODER_BASIC];
};
struct wire_encoder_options_rep {
	uint8_t option[WIRE_ENCODER_BASIC];
};
struct wire_encoder_pins_req {
	uint8_t write;
	uint8_t a[WIRE_ENCODER_BASIC];
	uint8_t b[WIRE_ENCODER_BASIC];
};
struct wire_encoder_pins_rep {
	uint8_t a[WIRE_ENCODER_BASIC];
	uint8_t b[WIRE_ENCODER_BASIC];
};
struct wire_encoder_keys_req {
	uint8_t write;
	uint8_t code[WIRE_ENCODER_BASIC];
	uint8_t modifier[WIRE_ENCODER_BASIC];
};
struct wire_encoder_keys_rep {
	uint8_t code[WIRE_ENCODER_BASIC];
	uint8_t modifier[WIRE_ENCODER_BASIC];
};

/* 0xCD; value[12] of the high bank is the ultra-fast encoder. */
#define WIRE_ENCODERS_READ_LOW 0	/* encoders 0..12 */
#define WIRE_ENCODERS_READ_HIGH 1	/* encoders 13..25 */
#define WIRE_ENCODERS_WRITE_LOW 10
#define WIRE_ENCODERS_WRITE_HIGH 11
struct wire_encoders_req {
	uint8_t option;
	int32_t value[WIRE_ENCODER_BANK]; /* used when writing, all at once */
};
struct wire_encoders_rep {
	int32_t value[WIRE_ENCODER_BANK];
};

/* 0xCE */
#define WIRE_FAST_OFF 0
#define WIRE_FAST_OLD 1		/* pins 1-2, 3-4, 15-16 */
#define WIRE_FAST_READ 2
#define WIRE_FAST_ON 10		/* pins 1-2, 5-6, 15-16 */
#define WIRE_FAST_NO_4X 0x10
#define WIRE_FAST_INVERT(n) (0x20 << (n))	/* n = 0..2 */
struct wire_fast_encoders_req {
	uint8_t option; /* WIRE_FAST_ configuration and flags */
	uint8_t index;  /* bit 0: index inputs zero the counter */
};
struct wire_fast_encoders_rep {
	uint8_t status; /* configuration and flags as set */
	uint8_t index;
};

WIRE_OPS_ENCODER(WIRE_TYPED)

#endif
