/* SPDX-License-Identifier: MIT */
#ifndef WIRE_IO_H
#define WIRE_IO_H

/*
 * Pins, digital and analog values, counters, PWM and the combined 0xCC:
 * protocol sections 3.2 to 3.7, key mapping of 3.2.
 *
 * Pins are 0-based on the wire here: pin 1 is 0, pin 55 is 54. A pin bitmap
 * is a uint64_t whose bit n is 0-based pin n; only 55 (56 with the spare one)
 * bits travel.
 */

#include "wire/op.h"

#define WIRE_PINS_MAX 55
#define WIRE_PIN_MASK ((UINT64_C(1) << WIRE_PINS_MAX) - 1)

/* Pin function byte (section 3.2); 0 is inactive. */
#define WIRE_PIN_SPECIAL 0x01
#define WIRE_PIN_INPUT 0x02
#define WIRE_PIN_OUTPUT 0x04
#define WIRE_PIN_ANALOG_IN 0x08
#define WIRE_PIN_ANALOG_OUT 0x10
#define WIRE_PIN_TRIGGERED 0x20
#define WIRE_PIN_COUNTER 0x40
#define WIRE_PIN_INVERT 0x80

/* Counter option byte. */
#define WIRE_COUNT_RISING 0x01
#define WIRE_COUNT_FALLING 0x02

/* 0x10 */
struct wire_pin_set_req {
	uint8_t pin;
	uint8_t function;
	uint8_t options; /* counter options */
};
struct wire_pin_set_rep {
	uint8_t status; /* 0 OK, 1 out of range or locked */
};

/* 0x15 */
#define WIRE_PIN_ERROR 0xFF
struct wire_pin_get_req {
	uint8_t pin;
};
struct wire_pin_get_rep {
	uint8_t pin; /* WIRE_PIN_ERROR: no such pin */
	uint8_t function;
	uint8_t options;
	uint8_t extended;
};

/* 0x1F: basic bits as the function byte, and the ones below. */
#define WIRE_CAP_1WIRE 0x0100
#define WIRE_CAP_PT1000 0x0200
#define WIRE_CAP_0_10V 0x0400
#define WIRE_CAP_4_20MA 0x0800
#define WIRE_CAP_FAST_ENCODER 0x1000
#define WIRE_CAP_PWM 0x2000
struct wire_pin_caps_req {
	uint8_t range; /* 13 pins each */
};
struct wire_pin_caps_rep {
	uint32_t mask[13]; /* entry size is not documented, 32 bits assumed */
};

/* 0x30, 0x31, 0x32 */
struct wire_input_req {
	uint8_t pin;
};
struct wire_input_rep {
	uint8_t status; /* 0 OK */
	uint8_t value;
};
struct wire_inputs_low_rep {
	uint32_t inputs; /* pins 1..32, bit 0 = pin 1 */
};
struct wire_inputs_high_rep {
	uint8_t inputs[3]; /* pins 33..55, bit 0 of [0] = pin 33 */
};

/* 0x35, 0x36, 0x37 */
struct wire_analog_one_req {
	uint8_t pin;
};
struct wire_analog_one_rep {
	uint8_t status; /* 0 OK */
	uint8_t value8;
	uint8_t high; /* bits 8..11 */
	uint8_t low;  /* bits 0..7 */
};
struct wire_analog_4x8_req {
	uint8_t pin[4];
};
struct wire_analog_4x8_rep {
	uint8_t value[4];
};
struct wire_analog_3x10_req {
	uint8_t pin[3];
};
struct wire_analog_3x10_rep {
	uint8_t packed[4]; /* 3 x 10 bits; the packing is not documented */
};

/* 0x38, 0x39: y = y*RC/(RC+1) + u/(RC+1); 0 is off. */
struct wire_filter_rep {
	uint32_t rc;
};
struct wire_filter_set_req {
	uint32_t rc;
};

/* 0x3A */
#define WIRE_ANALOGS 7
#define WIRE_ANALOG_FIRST_PIN 41	/* 1-based pin of value[0] */
#define WIRE_ANALOG_MAX 4095
struct wire_analog_req {
	uint8_t first; /* 0 default; the vendor's library sends 1 */
	uint8_t count; /* 0 default: all */
};
struct wire_analog_rep {
	uint16_t value[WIRE_ANALOGS]; /* pins 41..47, 0..4095 */
};

/* 0x40, 0x42, 0x43 */
struct wire_output_req {
	uint8_t pin;
	uint8_t value; /* 0 or 1 */
};
struct wire_output_rep {
	uint8_t status; /* 0 OK */
};
struct wire_outputs_low_req {
	uint32_t outputs; /* pins 1..32 */
};
struct wire_outputs_high_req {
	uint8_t outputs[3]; /* pins 33..55 */
};

/* 0x41, PoKeys55 only. */
struct wire_analog_out_req {
	uint8_t pin;    /* 42 */
	uint16_t value; /* upper ten bits count */
};
struct wire_analog_out_rep {
	uint8_t status;
};

/* 0xC0: (option1, option2) = (0,0) functions, (1,0) set, (0,1) options, (0,2) set. */
struct wire_pin_all_req {
	uint8_t option1;
	uint8_t option2;
	uint8_t value[WIRE_PINS_MAX];
};
struct wire_pin_all_rep {
	uint8_t settings; /* additional settings */
	uint8_t option2;  /* not documented; kept so that a reply can be repeated */
	uint8_t value[WIRE_PINS_MAX];
};

/* 0xC1, 0xC2, 0xC3 (1 = write) and 0xD7 (option); devices without keyboard: zeros. */
struct wire_key_map_req {
	uint8_t option;
	uint8_t value[WIRE_PINS_MAX];
};
struct wire_key_map_rep {
	uint8_t value[WIRE_PINS_MAX];
};

/* 0xCB (section 3.7); channel 1 is pin 22 .. channel 6 is pin 17 on a 57E. */
#define WIRE_PWMS 6
#define WIRE_PWM_HZ 25000000	/* clock of duty and period */
#define WIRE_PWM_TICK_NS (1000000000 / WIRE_PWM_HZ)
struct wire_pwm_req {
	uint8_t write;
	uint8_t duties_only;      /* 1: change the duties, nothing else */
	uint8_t enabled;          /* bit 0 = channel 1 */
	uint32_t duty[WIRE_PWMS]; /* ticks, 0..period */
	uint32_t period;          /* ticks, common to all channels */
};
struct wire_pwm_rep {
	uint8_t enabled;
	uint32_t duty[WIRE_PWMS];
	uint32_t period;
};

/* 0xCC (section 3.4) */
#define WIRE_IO_ANALOGS 5	/* pins 43..47 */
#define WIRE_IO_ANALOG_FIRST_PIN 43
#define WIRE_BASIC_ENCODERS 25
struct wire_io_req {
	uint8_t write;       /* 0 read only, 1 write outputs */
	uint64_t outputs;    /* bit = 0-based pin */
	uint16_t analog_out; /* PoKeys55 only */
	uint64_t ignore;     /* bit set: leave this output alone */
};
struct wire_io_rep {
	uint64_t inputs;                      /* bit = 0-based pin */
	uint16_t analog[WIRE_IO_ANALOGS];     /* pins 43..47, 0..4095 */
	uint8_t encoder[WIRE_BASIC_ENCODERS]; /* low byte of the counter */
	uint8_t matrix[8];                    /* rows 0..7, bit = column */
	uint32_t ultra;                       /* ultra-fast encoder */
};

/* 0xD8, 0xD9 (section 3.5) */
#define WIRE_COUNTERS 13
struct wire_counters_req {
	uint8_t pin[WIRE_COUNTERS];
};
struct wire_counters_rep {
	uint32_t value[WIRE_COUNTERS]; /* in the order asked for */
};
struct wire_counter_dirs_req {
	uint8_t write;
	uint8_t pin[WIRE_PINS_MAX]; /* direction pin of each pin, 0 none */
};
struct wire_counter_dirs_rep {
	uint8_t pin[WIRE_PINS_MAX]; /* not documented, assumed as the request */
};

WIRE_OPS_IO(WIRE_TYPED)

#endif
