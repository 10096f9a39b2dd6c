/* SPDX-License-Identifier: MIT */
/*
 * One row per device type: protocol sections 2.3 to 2.5.
 *
 * The device transmits its hardware id and nothing of this. The numbers are
 * those the vendor's newest library computes; where the documentation
 * contradicts itself (ids 28 to 31) even is U and odd is E. Types which only
 * have a name there are listed without pins: a daemon then says what it found
 * instead of guessing, and drives nothing.
 */

#include "wire/model.h"
#include "wire/io.h"

#define P(n) (UINT64_C(1) << ((n) - 1))
#define R(first, last) ((P((last) + 1) - 1) & ~(P(first) - 1))

static const struct wire_pinmap pins_none;

static const struct wire_pinmap pins_57e = {
	.digital_in = R(1, 55),
	.digital_out = R(1, 55),
	.analog_in = R(41, 47),
	.counter = R(1, 2) | R(5, 6) | P(9) | P(11) | R(15, 16) | R(19, 28) | R(41, 44) | P(46) |
		   R(48, 49),
	.pwm = R(17, 22),
	.pwm_pin = { 22, 21, 20, 19, 18, 17 },
	.fast = { { 1, 2, 9 }, { 5, 6, 11 }, { 15, 16, 27 } },
	.fast_old = { { 1, 2, 9 }, { 3, 4, 11 }, { 15, 16, 27 } },
	.ultra = { 8, 12, 13 },
	.generator = P(9) | P(11) | P(51),
	.generator_io = R(35, 38),
	.poextbus = R(35, 37),
	.direction = { 38, 39, 40 },
	.step = { 46, 48, 49 },
	.emergency = 52,
	.charge_pump = 53,
};

/* Pin 20 counts although its own list of capabilities lacks that. */
static const struct wire_pinmap pins_57cnc = {
	.digital_in = R(1, 6) | R(8, 16) | R(18, 20) | R(23, 26) | R(28, 38) | R(41, 45) | P(52),
	.digital_out = R(1, 2) | P(8) | R(12, 13) | R(17, 18) | R(20, 26) | R(28, 38) | R(41, 45),
	.analog_in = R(41, 45),
	.counter = R(1, 6) | R(9, 11) | R(15, 16) | R(19, 20) | R(33, 38) | R(41, 44),
	.pwm = R(17, 18) | R(20, 22),
	.pwm_pin = { 22, 21, 20, 0, 18, 17 },
	.fast = { { 1, 2, 0 }, { 3, 4, 0 }, { 5, 6, 0 } },
	.fast_old = { { 1, 2, 0 }, { 3, 4, 0 }, { 5, 6, 0 } },
	.ultra = { 8, 12, 13 },
	.poextbus = R(35, 37),
	.emergency = 52,
};

static const struct wire_pinmap pins_pro4x25 = {
	.digital_in = P(8) | R(12, 14) | R(18, 19) | R(23, 26) | R(28, 38) | R(41, 44) | P(52),
	.digital_out = P(8) | R(12, 13) | P(17) | P(20) | R(31, 38),
	.analog_in = R(41, 44),
	.counter = P(19),
	.pwm = P(17) | P(20),
	.pwm_pin = { 0, 0, 20, 0, 0, 17 },
	.ultra = { 8, 12, 13 },
	.poextbus = R(35, 37),
	.emergency = 52,
};

static const struct wire_pinmap pins_db25 = {
	.digital_in = R(10, 13) | P(15),
	.digital_out = R(1, 9) | P(14) | R(16, 17),
	.pwm = R(1, 3) | P(14) | R(16, 17),
	.pwm_pin = { 17, 1, 14, 2, 3, 16 },
};

/* What every current type has but those without documentation. */
#define COMMON (WIRE_HAS_CONNECTION_SIGNAL | WIRE_HAS_PONET | WIRE_HAS_STARTUP_OUTPUTS | \
		WIRE_HAS_I2C | WIRE_HAS_NAMES | WIRE_HAS_LOAD)
#define FULL (COMMON | WIRE_HAS_ANALOG | WIRE_HAS_COUNTERS | WIRE_HAS_MATRIX_KB | \
	      WIRE_HAS_LCD | WIRE_HAS_1WIRE)

/* A 55-pin board with everything; more follows as designated initialisers. */
#define BOARD(id, name_, ethernet_, pinmap_, features_) \
	.hardware = (id), .name = (name_), .ethernet = (ethernet_), .known = true, \
	.pins = 55, .basic_encoders = 25, .encoders = 26, .fast_encoders = 3, \
	.ultra_encoders = 1, .pwm_channels = 6, .pwm_hz = WIRE_PWM_HZ, .matrix_leds = 2, \
	.poextbus_bytes = 10, .pinmap = &(pinmap_), .features = (features_)

#define NAMED(id, name_, ethernet_) \
	{ .hardware = (id), .name = (name_), .ethernet = (ethernet_), .pinmap = &pins_none }

#define ANALOG_ONLY(id, name_, ethernet_) \
	{ .hardware = (id), .name = (name_), .ethernet = (ethernet_), .pinmap = &pins_none, \
	  .features = WIRE_HAS_ANALOG | WIRE_HAS_LOAD }

static const struct wire_model models[] = {
	NAMED(WIRE_HW_55_V1, "PoKeys55", false),
	NAMED(WIRE_HW_55_V2, "PoKeys55", false),
	NAMED(WIRE_HW_55_V3, "PoKeys55", false),
	NAMED(WIRE_HW_55_RECOVERY, "PoKeys55 recovery", false),
	NAMED(WIRE_HW_56U, "PoKeys56U", false),
	{ BOARD(WIRE_HW_56E, "PoKeys56E", true, pins_none,
		FULL | WIRE_HAS_WEB | WIRE_HAS_SENSOR_LIST | WIRE_HAS_TLOG27) },
	NAMED(WIRE_HW_56U_BOOT, "PoKeys56U bootloader", false),
	NAMED(WIRE_HW_56E_BOOT, "PoKeys56E bootloader", true),
	NAMED(WIRE_HW_27U, "PoTLog27U", false),
	NAMED(WIRE_HW_27E, "PoTLog27E", true),
	{ BOARD(WIRE_HW_57U, "PoKeys57U", false, pins_57e,
		FULL | WIRE_HAS_KEYBOARD | WIRE_HAS_PULSE_V2),
	  .easy_sensors = 100, .pulse_axes = 8 },
	{ BOARD(WIRE_HW_57E, "PoKeys57E", true, pins_57e, FULL | WIRE_HAS_WEB | WIRE_HAS_PULSE_V2),
	  .easy_sensors = 100, .pulse_axes = 8 },
	{ BOARD(WIRE_HW_57U_V11, "PoKeys57U", false, pins_57e,
		FULL | WIRE_HAS_KEYBOARD | WIRE_HAS_PULSE_V2),
	  .easy_sensors = 100, .pulse_axes = 8 },
	{ BOARD(WIRE_HW_57E_V11, "PoKeys57E", true, pins_57e,
		FULL | WIRE_HAS_WEB | WIRE_HAS_PULSE_V2),
	  .easy_sensors = 100, .pulse_axes = 8 },
	{ BOARD(WIRE_HW_57CNC, "PoKeys57CNC", true, pins_57cnc,
		FULL | WIRE_HAS_KEYBOARD | WIRE_HAS_WEB | WIRE_HAS_PULSE_V2),
	  .easy_sensors = 100, .pulse_axes = 8 },
	{ BOARD(WIRE_HW_57CNCPRO4X25, "PoKeys57CNCpro4x25", true, pins_pro4x25,
		FULL | WIRE_HAS_KEYBOARD | WIRE_HAS_WEB | WIRE_HAS_PULSE_V2),
	  .easy_sensors = 100, .pulse_axes = 4 },
	ANALOG_ONLY(WIRE_HW_57U_OEM, "PoKeys57U OEM", false),
	ANALOG_ONLY(WIRE_HW_57E_OEM, "PoKeys57E OEM", true),
	ANALOG_ONLY(WIRE_HW_POPLC57NG, "PoPLC57NG", false),
	{ .hardware = WIRE_HW_57CNCDB25,
	  .name = "PoKeys57CNCdb25",
	  .known = true,
	  .pins = 17,
	  .pwm_channels = 6,
	  .pwm_hz = WIRE_PWM_HZ,
	  .poextbus_bytes = 10,
	  .easy_sensors = 100,
	  .pinmap = &pins_db25,
	  .features = COMMON | WIRE_HAS_KEYBOARD | WIRE_HAS_MATRIX_KB | WIRE_HAS_PULSE_V2 },
	{ .hardware = WIRE_HW_57UTEST,
	  .name = "PoKeys57Utest",
	  .known = true,
	  .pins = 55,
	  .pinmap = &pins_none,
	  .features = WIRE_HAS_SENSOR_LIST },
	NAMED(WIRE_HW_58EU, "PoKeys58EU", true),
	NAMED(WIRE_HW_POBOOTLOAD, "PoBootload", true),
	ANALOG_ONLY(WIRE_HW_57UTEST2, "PoKeys57Utest", false),
	NAMED(WIRE_HW_LINITESTER_PROGRAMMER, "LiniTester programmer", false),
	NAMED(WIRE_HW_LINITESTER_CALIBRATOR, "LiniTester calibrator", false),
	ANALOG_ONLY(WIRE_HW_57INDUSTRIAL1, "PoKeys57Industrial1", true),
	{ .hardware = WIRE_HW_POPLC,
	  .name = "PoPLC v1.0",
	  .ethernet = true,
	  .known = true,
	  .pins = 27,
	  .pinmap = &pins_none },
	{ .hardware = WIRE_HW_16RF,
	  .name = "PoKeys16",
	  .known = true,
	  .pins = 16,
	  .pinmap = &pins_none },
	{ .hardware = WIRE_HW_OEM,
	  .name = "OEM",
	  .ethernet = true,
	  .known = true,
	  .pins = 55,
	  .basic_encoders = 5,
	  .encoders = 5,
	  .fast_encoders = 3,
	  .ultra_encoders = 1,
	  .matrix_leds = 2,
	  .poextbus_bytes = 10,
	  .easy_sensors = 100,
	  .pinmap = &pins_none,
	  .features = FULL | WIRE_HAS_WEB | WIRE_HAS_PULSE_V2 },
	{ .hardware = WIRE_HW_SERIALREADER,
	  .name = "SerialReader",
	  .known = true,
	  .pins = 55,
	  .encoders = 5,
	  .pwm_channels = 3,
	  .pinmap = &pins_none },
	{ .hardware = WIRE_HW_X15,
	  .name = "X15-02-24",
	  .ethernet = true,
	  .known = true,
	  .pins = 55,
	  .basic_encoders = 25,
	  .encoders = 26,
	  .pwm_channels = 6,
	  .pwm_hz = WIRE_PWM_HZ,
	  .poextbus_bytes = 10,
	  .easy_sensors = 100,
	  .pinmap = &pins_none,
	  .features = COMMON | WIRE_HAS_WEB | WIRE_HAS_PULSE_V2 },
	NAMED(WIRE_HW_ZB_BRIDGE, "ZB-Bridge", false),
	NAMED(WIRE_HW_SERIALREADER_RGB, "SerialReader RGB", false),
	NAMED(WIRE_HW_POLED, "PoLED", false),
	NAMED(WIRE_HW_SMARTLIGHT, "SmartLight", false),
	NAMED(WIRE_HW_ANTENNA, "Antenna rotator", false),
	NAMED(WIRE_HW_OEM_CAN, "OEM CAN node", false),
};

static const struct wire_model unknown = { .name = "unknown device", .pinmap = &pins_none };

const struct wire_model *wire_model(uint8_t hardware)
{
	for (size_t i = 0; i < sizeof(models) / sizeof(models[0]); i++) {
		if (models[i].hardware == hardware)
			return &models[i];
	}
	return &unknown;
}

const struct wire_model *wire_model_at(size_t number)
{
	return number < sizeof(models) / sizeof(models[0]) ? &models[number] : NULL;
}

bool wire_pin_can(const struct wire_model *model, unsigned int pin, enum wire_pin_use use)
{
	const struct wire_pinmap *map = model->pinmap;
	const uint64_t masks[] = {
		[WIRE_USE_INPUT] = map->digital_in, [WIRE_USE_OUTPUT] = map->digital_out,
		[WIRE_USE_ANALOG] = map->analog_in, [WIRE_USE_COUNTER] = map->counter,
		[WIRE_USE_PWM] = map->pwm,
	};

	if (pin < 1 || pin > model->pins)
		return false;
	return (masks[use] & P(pin)) != 0;
}
