/* SPDX-License-Identifier: MIT */
#ifndef WIRE_MODEL_H
#define WIRE_MODEL_H

/*
 * Which device is it and what can it do: firmware coding (protocol section
 * 2.2), hardware ids (2.3), capabilities (2.4), pins (2.5).
 *
 * A device does not transmit its capabilities; they follow from the hardware
 * id. Pins are 1-based here, as printed on the board, and pin bitmaps have
 * bit n - 1 for pin n, which is the bit of that pin in 0xCC.
 *
 * All functions are pure and realtime safe; the tables are constant.
 */

#include <stddef.h>
#include "wire/system.h"

/* Hardware ids, device data @18. */
enum wire_hardware {
	WIRE_HW_55_V1 = 0,
	WIRE_HW_55_V2 = 1,
	WIRE_HW_55_V3 = 2,
	WIRE_HW_55_RECOVERY = 3,
	WIRE_HW_56U = 10,
	WIRE_HW_56E = 11,
	WIRE_HW_56U_BOOT = 15,
	WIRE_HW_56E_BOOT = 16,
	WIRE_HW_27U = 20,
	WIRE_HW_27E = 21,
	WIRE_HW_57U = 28,
	WIRE_HW_57E = 29,
	WIRE_HW_57U_V11 = 30,
	WIRE_HW_57E_V11 = 31,
	WIRE_HW_57CNC = 32,
	WIRE_HW_57CNCPRO4X25 = 33,
	WIRE_HW_57U_OEM = 35,
	WIRE_HW_57E_OEM = 36,
	WIRE_HW_POPLC57NG = 37,
	WIRE_HW_57CNCDB25 = 38,
	WIRE_HW_57UTEST = 39,
	WIRE_HW_58EU = 40,
	WIRE_HW_POBOOTLOAD = 41,
	WIRE_HW_57UTEST2 = 42,
	WIRE_HW_LINITESTER_PROGRAMMER = 43,
	WIRE_HW_LINITESTER_CALIBRATOR = 44,
	WIRE_HW_57INDUSTRIAL1 = 45,
	WIRE_HW_POPLC = 50,
	WIRE_HW_16RF = 60,
	WIRE_HW_OEM = 100,
	WIRE_HW_SERIALREADER = 101,
	WIRE_HW_X15 = 102,
	WIRE_HW_ZB_BRIDGE = 103,
	WIRE_HW_SERIALREADER_RGB = 104,
	WIRE_HW_POLED = 105,
	WIRE_HW_SMARTLIGHT = 106,
	WIRE_HW_ANTENNA = 107,
	WIRE_HW_OEM_CAN = 200,
};

/* Features of a model. */
#define WIRE_HAS_ANALOG 0x00001		/* analog inputs and their filter */
#define WIRE_HAS_COUNTERS 0x00002
#define WIRE_HAS_KEYBOARD 0x00004	/* key mapping, joystick, macros: USB types */
#define WIRE_HAS_MATRIX_KB 0x00008
#define WIRE_HAS_LCD 0x00010
#define WIRE_HAS_CONNECTION_SIGNAL 0x00020
#define WIRE_HAS_PONET 0x00040
#define WIRE_HAS_STARTUP_OUTPUTS 0x00080
#define WIRE_HAS_I2C 0x00100
#define WIRE_HAS_1WIRE 0x00200
#define WIRE_HAS_NAMES 0x00400		/* options, custom name, failsafe */
#define WIRE_HAS_LOAD 0x00800
#define WIRE_HAS_SENSOR_LIST 0x01000
#define WIRE_HAS_WEB 0x02000
#define WIRE_HAS_PULSE_V2 0x04000	/* on a 56E by firmware: wire_pulse_version() */
#define WIRE_HAS_TLOG27 0x08000

#define WIRE_MODEL_PWMS 6
#define WIRE_MODEL_FASTS 3
#define WIRE_MODEL_INTERNAL_AXES 3

/* One quadrature input; 0: no pin. */
struct wire_encoder_pins {
	uint8_t a, b, index;
};

/* Which pin can do what; bit n - 1 is pin n. */
struct wire_pinmap {
	uint64_t digital_in;
	uint64_t digital_out;
	uint64_t analog_in;
	uint64_t counter;
	uint64_t pwm;
	uint8_t pwm_pin[WIRE_MODEL_PWMS]; /* of channel 1..6; 0: not brought out */
	struct wire_encoder_pins fast[WIRE_MODEL_FASTS];
	struct wire_encoder_pins fast_old[WIRE_MODEL_FASTS]; /* WIRE_FAST_OLD */
	struct wire_encoder_pins ultra;
	/* While they are in use; none where the signals have connectors of their own. */
	uint64_t generator;                          /* the external pulse generator's bus */
	uint64_t generator_io;                       /* its extended inputs and outputs */
	uint64_t poextbus;                           /* the second connector */
	uint8_t direction[WIRE_MODEL_INTERNAL_AXES]; /* the integrated generator's, by axis */
	uint8_t step[WIRE_MODEL_INTERNAL_AXES];
	uint8_t emergency, charge_pump; /* "default" */
};

struct wire_model {
	uint8_t hardware; /* enum wire_hardware */
	bool ethernet;
	bool known; /* false: only its name is documented, it has no pins */
	uint8_t pins;
	uint8_t basic_encoders; /* 8-bit values in 0xCC */
	uint8_t encoders;       /* with the ultra-fast one */
	uint8_t fast_encoders;
	uint8_t ultra_encoders;
	uint8_t pwm_channels;
	uint8_t matrix_leds;
	uint8_t poextbus_bytes;
	uint8_t easy_sensors;
	uint8_t pulse_axes; /* most the board brings out; 0: ask the status, @56 */
	uint32_t pwm_hz;
	uint32_t features; /* WIRE_HAS_ */
	const char *name;
	const struct wire_pinmap *pinmap; /* never NULL; all zero when not documented */
};

/* The model of a hardware id; never NULL, "unknown" with known == false. */
const struct wire_model *wire_model(uint8_t hardware);

/* All of them, one after the other; NULL behind the last one. */
const struct wire_model *wire_model_at(size_t number);

/* What one pin can do. */
enum wire_pin_use {
	WIRE_USE_INPUT,
	WIRE_USE_OUTPUT,
	WIRE_USE_ANALOG,
	WIRE_USE_COUNTER,
	WIRE_USE_PWM,
};

/* pin is 1-based; false for pins the model does not have. */
bool wire_pin_can(const struct wire_model *model, unsigned int pin, enum wire_pin_use use);

/* Firmware version: byte 0x37 with revision 15 is 4.7.15. */
struct wire_version {
	uint8_t major, minor, revision;
	bool boot56; /* bit 7 of the code: series-56 bootloader */
};
struct wire_version wire_firmware(uint8_t code, uint8_t revision);

/* The code of a version; major 1..8, minor 0..15. */
uint8_t wire_firmware_code(const struct wire_version *version);

/* Whether version is major.minor.revision or newer. */
bool wire_firmware_at_least(const struct wire_version *version, uint8_t major, uint8_t minor,
			    uint8_t revision);

/* What identifies a device, from the reply to 0x00 whatever its series. */
struct wire_identity {
	uint32_t serial;
	struct wire_version firmware;
	uint8_t hardware; /* 0 without extended block */
	bool extended;    /* the reply has the extended block */
	const struct wire_model *model;
};
void wire_identify(const struct wire_device_data_rep *data, struct wire_identity *identity);

/* Pulse engine: 0 none, 1 old, 2 (operation 0x85). */
int wire_pulse_version(const struct wire_identity *identity);

/*
 * The name to show: the long one if it begins with the short one, else the
 * short one. out holds at least 21 bytes and ends in a NUL.
 */
void wire_device_label(const struct wire_device_name_rep *name, char out[21]);

/* Discovery (section 1.9): request is an empty datagram, the reply one of these. */
#define WIRE_DISCOVERY_LEN 19
#define WIRE_DISCOVERY_OLD_LEN 14
struct wire_discovery {
	uint8_t user_id;
	uint8_t firmware; /* coded, see wire_firmware() */
	uint8_t revision;
	uint8_t ip[4]; /* a.b.c.d */
	uint8_t dhcp;
	uint8_t host_ip[4]; /* who asked */
	uint32_t serial;    /* 16 bits in the old format */
	uint8_t hardware;   /* 0 in the old format */
	bool old_format;
};

/* WIRE_OK, or WIRE_LENGTH: not a discovery reply. */
enum wire_reason wire_discovery_decode(const uint8_t *p, size_t len, struct wire_discovery *d);

/* Returns the length, WIRE_DISCOVERY_LEN or WIRE_DISCOVERY_OLD_LEN by old_format. */
size_t wire_discovery_encode(uint8_t p[WIRE_DISCOVERY_LEN], const struct wire_discovery *d);

#endif
