/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every setting, once.
 *
 * The daemon's configuration file, its documentation, pokeysctl and the tests
 * walk this table. So what pokeysctl prints of a device is what pokeysd.conf
 * takes, and a member of struct pokeys_settings that nobody can write is one
 * row away from being known everywhere.
 *
 * Terminals are numbered as they are printed on the board, from 1. Axes and
 * encoders are numbered from 0, as in the HAL and in the protocol.
 */
#include "settings/key.h"

#define AT(member) \
	.offset = offsetof(struct pokeys_settings, member), \
	.size = sizeof(((struct pokeys_settings *)0)->member)
#define SET(bit) \
	.set_offset = offsetof(struct pokeys_settings, set), .set_size = 4, \
	.set_bits = POKEYS_SET_##bit

#define OF_AXIS(member) \
	(offsetof(struct pokeys_settings, axis) + offsetof(struct pokeys_axis_settings, member))
#define AXIS_AT(member) \
	.offset = OF_AXIS(member), .size = sizeof(((struct pokeys_axis_settings *)0)->member), \
	.count = POKEYS_AXES, .stride = sizeof(struct pokeys_axis_settings)
#define AXIS_SET(bit) \
	.set_offset = OF_AXIS(set), .set_size = 4, .set_bits = POKEYS_AXIS_SET_##bit
/* A bit field that has a mask of its own. */
#define AXIS_FLAG(member, flag) \
	AXIS_AT(member), .bits = (flag), .set_offset = OF_AXIS(member##_mask), .set_size = 1, \
	.set_bits = (flag)

#define OF_ENCODER(member) \
	(offsetof(struct pokeys_settings, encoder) + \
	 offsetof(struct pokeys_encoder_settings, member))
#define ENCODER_AT(member) \
	.offset = OF_ENCODER(member), .count = 25, \
	.stride = sizeof(struct pokeys_encoder_settings)
#define ENCODER_FLAG(flag) \
	ENCODER_AT(options), .size = 1, .bits = (flag), \
	.set_offset = OF_ENCODER(options_mask), .set_size = 1, .set_bits = (flag)

#define WORDS(...) .words = (const struct settings_word[]){ __VA_ARGS__, { NULL, 0 } }
#define RANGE(low, high) .minimum = (low), .maximum = (high)
#define WORDS_ONLY RANGE(1, 0)
#define TERMINALS RANGE(1, POKEYS_PINS)
#define FLAG(flag) WORDS_ONLY, WORDS({ "off", 0 }, { "on", (flag) })

#define KEY(name_, type_, ...) { .name = (name_), .type = (type_), __VA_ARGS__ }
#define SWITCH_PIN(member, bit, name_, help_) \
	KEY(name_, SETTINGS_NUMBER, AXIS_AT(member), AXIS_SET(bit), TERMINALS, \
	    WORDS({ "dedicated", 0 }), .help = (help_))
#define SWITCH_FILTER(member, bit, name_, help_) \
	KEY(name_, SETTINGS_NUMBER, AXIS_AT(member), AXIS_SET(bit), RANGE(0, 254), .help = (help_))
#define PERCENT(member, bit, name_, help_) \
	KEY(name_, SETTINGS_NUMBER, AXIS_AT(member), AXIS_SET(bit), RANGE(0, 100), .unit = "%", \
	    .help = (help_))
#define PULSES(member, bit, name_, help_) \
	KEY(name_, SETTINGS_NUMBER, AXIS_AT(member), AXIS_SET(bit), RANGE(INT32_MIN, INT32_MAX), \
	    .is_signed = true, .unit = "pulses", .help = (help_))
#define RATE(member, bit, name_, low, high, unit_, help_) \
	KEY(name_, SETTINGS_REAL, AXIS_AT(member), AXIS_SET(bit), RANGE(low, high), \
	    .unit = (unit_), .help = (help_))

const struct settings_key settings_keys[] = {
	KEY("digital-inputs", SETTINGS_PIN_FUNCTION, AT(pin_function), .bits = 0x02, TERMINALS,
	    .help = "Terminals to use as digital inputs. Terminal 1 is pin.00 in HAL. Terminals "
		    "that are in no list keep the device's setting."),
	KEY("digital-outputs", SETTINGS_PIN_FUNCTION, AT(pin_function), .bits = 0x04, TERMINALS,
	    .help = "Terminals to use as digital outputs."),
	KEY("analog-inputs", SETTINGS_PIN_FUNCTION, AT(pin_function), .bits = 0x08, RANGE(41, 47),
	    .help = "Terminals to use as analog inputs. Terminal 41 is adc.00 in HAL."),
	KEY("counter-inputs", SETTINGS_PIN_FUNCTION, AT(pin_function), .bits = 0x42, TERMINALS,
	    .help = "Digital inputs whose edges the device counts. Not every terminal supports "
		    "this."),
	KEY("inverted-pins", SETTINGS_PIN_FLAG, AT(pin_function), .bits = 0x80, TERMINALS,
	    .help = "Terminals in digital-inputs, digital-outputs and counter-inputs that are "
		    "inverted in the device."),

	KEY("axes", SETTINGS_NUMBER, AT(axes), SET(AXES), RANGE(0, POKEYS_AXES),
	    .help = "Number of axes that the pulse engine drives."),
	KEY("generator", SETTINGS_NUMBER, AT(generator), SET(GENERATOR), .bits = 0x0f, WORDS_ONLY,
	    WORDS({ "external", 0 }, { "internal", 1 }, { "smart", 2 }),
	    .help = "Where the pulses are generated: external, 8 axes of at most 125 kHz; "
		    "internal, 3 axes of at most 25 kHz. The three generator keys are written "
		    "together."),
	KEY("generator-swap", SETTINGS_NUMBER, AT(generator), SET(GENERATOR), .bits = 0x40,
	    FLAG(0x40), .help = "Step and direction outputs are exchanged."),
	KEY("generator-extended-io", SETTINGS_NUMBER, AT(generator), SET(GENERATOR), .bits = 0x80,
	    FLAG(0x80), .help = "Extended inputs and outputs of the external pulse generator."),
	KEY("charge-pump", SETTINGS_NUMBER, AT(charge_pump), SET(CHARGE_PUMP), TERMINALS,
	    .bias = 10, WORDS({ "off", 0 }, { "default", 1 }),
	    .help = "Terminal of the charge pump signal; default is the device's default "
		    "terminal."),
	KEY("emergency-pin", SETTINGS_NUMBER, AT(emergency_pin), SET(EMERGENCY_PIN), TERMINALS,
	    .bias = 10, WORDS({ "off", 0 }, { "default", 1 }),
	    .help = "Terminal of the emergency stop switch; default is the device's default "
		    "terminal."),
	KEY("emergency-invert", SETTINGS_NUMBER, AT(emergency_invert), SET(EMERGENCY_INVERT),
	    FLAG(1), .help = "Emergency stop switch is inverted."),
	KEY("power-states", SETTINGS_NUMBER, AT(power_states), SET(POWER_STATES), RANGE(0, 119),
	    .help = "States of the pulse engine in which the power stays on, as a sum: 1 stopped, "
		    "2 stopped by a limit, 4 stopped by emergency; 16, 32 and 64 are the same for "
		    "the charge pump."),
	KEY("backlash", SETTINGS_NUMBER, AT(backlash_enable), SET(BACKLASH), FLAG(1),
	    .help = "The device compensates the backlash of its axes, see axis.N.backlash-width. "
		    "From firmware 4.1.26 on."),
	KEY("backlash-speed", SETTINGS_NUMBER, AT(backlash_speed), SET(BACKLASH_SPEED),
	    RANGE(0, UINT8_MAX),
	    .help = "Highest speed of the backlash compensation, as stored in the device; its unit "
		    "is not documented."),
	KEY("postep", SETTINGS_NUMBER, AT(postep_enable), SET(POSTEP), FLAG(1),
	    .help = "The device communicates with PoStep motor drivers, and the daemon reads their "
		    "status. PoKeys57CNC only, from firmware 4.1.42 on."),
	KEY("synced-pwm", SETTINGS_NUMBER, AT(sync_pwm_enable), SET(SYNC_PWM), FLAG(1),
	    .help = "A PWM output follows an axis in buffered mode: the number of pulses in a "
		    "millisecond is the duty cycle in percent. The three synced-pwm keys are "
		    "written together."),
	KEY("synced-pwm-axis", SETTINGS_NUMBER, AT(sync_pwm_axis), SET(SYNC_PWM),
	    RANGE(0, POKEYS_AXES - 1), .help = "Axis that the PWM output follows."),
	KEY("synced-pwm-channel", SETTINGS_NUMBER, AT(sync_pwm_channel), SET(SYNC_PWM),
	    RANGE(0, POKEYS_PWM - 1), .help = "PWM output; 0 to 5 are pwm.00 to pwm.05 in HAL."),
	KEY("synced-outputs", SETTINGS_NUMBER, AT(sync_out_enable), SET(SYNC_OUTPUTS), FLAG(1),
	    .help = "Eight outputs follow an axis in buffered mode: the byte of the axis for each "
		    "millisecond contains their bits. The three synced-outputs keys are written "
		    "together."),
	KEY("synced-outputs-axis", SETTINGS_NUMBER, AT(sync_out_axis), SET(SYNC_OUTPUTS),
	    RANGE(0, POKEYS_AXES - 1), .help = "Axis that the outputs follow."),
	KEY("synced-outputs-pins", SETTINGS_BYTES, AT(sync_out_pin), SET(SYNC_OUTPUTS),
	    RANGE(0, 99),
	    .help = "Terminals of the outputs, starting with bit 0: 1 to 55 is a terminal, 92 to "
		    "99 an output of the pulse engine's connector, 0 none."),
	KEY("threading-mode", SETTINGS_NUMBER, AT(threading_mode), SET(THREADING), WORDS_ONLY,
	    WORDS({ "index", 0 }, { "encoder", 1 }, { "fast-index", 2 }, { "fast-encoder", 3 }),
	    .help = "What the device's own threading follows (docs/motion.md): the spindle's index "
		    "alone, or its encoder and index. The fast modes are the vendor's \"high "
		    "speed\" modes. The threading keys are written together and cannot be read "
		    "back."),
	KEY("threading-ticks", SETTINGS_NUMBER, AT(threading_ticks), SET(THREADING),
	    RANGE(1, UINT16_MAX), .unit = "counts",
	    .help = "Counts of the ultra-fast encoder per turn of the spindle."),
	KEY("threading-rpm", SETTINGS_NUMBER, AT(threading_rpm), SET(THREADING),
	    RANGE(1, UINT16_MAX), .unit = "rpm",
	    .help = "Spindle speed for which the path is commanded. The spindle must never turn "
		    "faster."),
	KEY("threading-speed-gain", SETTINGS_NUMBER, AT(threading_speed_gain), SET(THREADING),
	    RANGE(0, UINT16_MAX),
	    .help = "Gain with which the device follows the spindle's speed; no unit, range or "
		    "usual value is documented."),
	KEY("threading-position-gain", SETTINGS_NUMBER, AT(threading_position_gain), SET(THREADING),
	    RANGE(0, UINT16_MAX),
	    .help = "Gain with which the device corrects its position lag; no unit, range or usual "
		    "value is documented."),
	KEY("threading-ignore-axes", SETTINGS_NUMBER, AT(threading_ignore), SET(THREADING),
	    RANGE(0, UINT8_MAX),
	    .help = "Axes in buffered mode that stand still during threading, as a sum: 1 axis 0, "
		    "2 axis 1, 4 axis 2 ...; 0 if not set."),

#define AXIS(name) "axis.#." name
	KEY(AXIS("mode"), SETTINGS_NUMBER, AXIS_FLAG(options, 13), WORDS_ONLY,
	    WORDS({ "off", 0 }, { "position", 13 }, { "velocity", 5 }, { "buffered", 1 }),
	    .help = "What the axis follows: position, absolute positions, for which the device "
		    "generates the ramps; velocity, speeds; buffered, the steps of each "
		    "millisecond, streamed into the motion buffer of the device. off: the axis is "
		    "not driven."),
	KEY(AXIS("invert"), SETTINGS_NUMBER, AXIS_FLAG(options, 2), FLAG(2),
	    .help = "Direction is inverted."),
	KEY(AXIS("max-speed"), SETTINGS_REAL, AXIS_AT(max_speed), AXIS_SET(MAX_SPEED),
	    RANGE(1, 125000), .unit = "pulses/s",
	    .help = "Highest speed. The limit of an integrated pulse generator is 25000."),
	RATE(max_acceleration, MAX_ACCELERATION, AXIS("max-acceleration"), 1, 1e9, "pulses/s^2",
	     "Highest acceleration."),
	RATE(max_deceleration, MAX_DECELERATION, AXIS("max-deceleration"), 1, 1e9, "pulses/s^2",
	     "Highest deceleration; leave uses max-acceleration if that is set."),
	KEY(AXIS("soft-limits"), SETTINGS_NUMBER, AXIS_FLAG(options, 32), FLAG(32),
	    .help = "Limits of travel that the device itself enforces; on needs both soft-minimum "
		    "and soft-maximum."),
	PULSES(soft_minimum, SOFT_MINIMUM, AXIS("soft-minimum"), "Lowest position."),
	PULSES(soft_maximum, SOFT_MAXIMUM, AXIS("soft-maximum"), "Highest position."),
	KEY(AXIS("limit-minus"), SETTINGS_NUMBER, AXIS_FLAG(switches, 1), FLAG(1),
	    .help = "There is a limit switch at the lower end."),
	KEY(AXIS("limit-plus"), SETTINGS_NUMBER, AXIS_FLAG(switches, 2), FLAG(2),
	    .help = "There is a limit switch at the upper end."),
	KEY(AXIS("home"), SETTINGS_NUMBER, AXIS_FLAG(switches, 4), FLAG(4),
	    .help = "There is a home switch."),
	KEY(AXIS("home-shared"), SETTINGS_NUMBER, AXIS_FLAG(switches, 24), WORDS_ONLY,
	    WORDS({ "off", 0 }, { "limit-minus", 8 }, { "limit-plus", 16 }),
	    .help = "The selected limit switch is also the home switch, for homing by the device."),
	KEY(AXIS("limit-minus-invert"), SETTINGS_NUMBER, AXIS_FLAG(switches, 32), FLAG(32),
	    .help = "Lower limit switch is inverted: on for a switch that closes when it is hit."),
	KEY(AXIS("limit-plus-invert"), SETTINGS_NUMBER, AXIS_FLAG(switches, 64), FLAG(64),
	    .help = "Upper limit switch is inverted."),
	KEY(AXIS("home-invert"), SETTINGS_NUMBER, AXIS_FLAG(switches, 128), FLAG(128),
	    .help = "Home switch is inverted."),
	SWITCH_PIN(pin_limit_minus, PIN_LIMIT_MINUS, AXIS("limit-minus-pin"),
		   "Terminal of the lower limit switch, or the device's dedicated input."),
	SWITCH_PIN(pin_limit_plus, PIN_LIMIT_PLUS, AXIS("limit-plus-pin"),
		   "Terminal of the upper limit switch, or the device's dedicated input."),
	SWITCH_PIN(pin_home, PIN_HOME, AXIS("home-pin"),
		   "Terminal of the home switch, or the device's dedicated input."),
	SWITCH_FILTER(filter_limit_minus, FILTER_LIMIT_MINUS, AXIS("limit-minus-filter"),
		      "Filter of the lower limit switch; 0 is off."),
	SWITCH_FILTER(filter_limit_plus, FILTER_LIMIT_PLUS, AXIS("limit-plus-filter"),
		      "Filter of the upper limit switch; 0 is off."),
	SWITCH_FILTER(filter_home, FILTER_HOME, AXIS("home-filter"),
		      "Filter of the home switch; 0 is off."),
	SWITCH_FILTER(filter_probe, FILTER_PROBE, AXIS("probe-filter"),
		      "Filter of the probe; 0 is off."),
	SWITCH_PIN(pin_enable, PIN_ENABLE, AXIS("enable-pin"),
		   "Terminal that enables the motor driver, or the device's dedicated output."),
	KEY(AXIS("enable-invert"), SETTINGS_NUMBER, AXIS_AT(invert_enable), AXIS_SET(INVERT_ENABLE),
	    FLAG(1), .help = "Enable output is inverted."),
	KEY(AXIS("enable-masked"), SETTINGS_NUMBER, AXIS_FLAG(options, 128), FLAG(128),
	    .help = "The enable output follows a mask of the host instead of the engine's state."),
	KEY(AXIS("homing-invert"), SETTINGS_NUMBER, AXIS_FLAG(options, 16), FLAG(16),
	    .help = "Homing starts in the opposite direction."),
	KEY(AXIS("homing-algorithm"), SETTINGS_NUMBER, AXIS_AT(homing_algorithm),
	    AXIS_SET(HOMING_ALGORITHM), RANGE(0, 255),
	    .help = "What homing does when the switch closes (value modulo 16) and opens (value / "
		    "16), as a sum: 1 slows down, 2 reverses, 4 waits for the encoder's index; or "
		    "8 alone: the position is reset there. 131 is usual."),
	PERCENT(homing_speed, HOMING_SPEED, AXIS("homing-speed"),
		"Speed towards the home switch, in percent of max-speed."),
	PERCENT(homing_return, HOMING_RETURN, AXIS("homing-return-speed"),
		"Speed off the home switch, in percent of homing-speed."),
	PULSES(back_off, BACK_OFF, AXIS("homing-back-off"),
	       "How far the axis moves off the switch at the end of homing."),
	KEY(AXIS("mpg-encoder"), SETTINGS_NUMBER, AXIS_AT(mpg_encoder), AXIS_SET(MPG_ENCODER),
	    RANGE(0, POKEYS_ENCODERS - 1), .scale = 1, .bias = 1, WORDS({ "none", 0 }),
	    .help = "Encoder of the hand wheel."),
	KEY(AXIS("mpg-multiplier"), SETTINGS_NUMBER, AXIS_AT(mpg_multiplier),
	    AXIS_SET(MPG_MULTIPLIER), RANGE(INT16_MIN, INT16_MAX), .is_signed = true,
	    .help = "Pulses for mpg-divider counts of the hand wheel."),
	KEY(AXIS("mpg-divider"), SETTINGS_NUMBER, AXIS_AT(mpg_divider), AXIS_SET(MPG_DIVIDER),
	    RANGE(0, UINT16_MAX), .help = "See mpg-multiplier."),
	KEY(AXIS("step-invert"), SETTINGS_NUMBER, AXIS_AT(signals), AXIS_SET(SIGNALS), .bits = 1,
	    FLAG(1),
	    .help = "Step signal is inverted. The three signal keys (step-invert, "
		    "direction-invert, index-falling) are written together."),
	KEY(AXIS("direction-invert"), SETTINGS_NUMBER, AXIS_AT(signals), AXIS_SET(SIGNALS),
	    .bits = 2, FLAG(2), .help = "Direction signal is inverted, in addition to invert."),
	KEY(AXIS("index-falling"), SETTINGS_NUMBER, AXIS_AT(signals), AXIS_SET(SIGNALS), .bits = 4,
	    FLAG(4), .help = "Homing uses the falling edge of the index signal."),
	KEY(AXIS("backlash-width"), SETTINGS_NUMBER, AXIS_AT(backlash_half),
	    AXIS_SET(BACKLASH_WIDTH), RANGE(0, 2 * UINT16_MAX), .scale = 2, .unit = "pulses",
	    .help = "Backlash that the device compensates at each change of direction, in steps of "
		    "2 (the device stores half of it). It needs backlash = on. Do not set it in "
		    "LinuxCNC's INI file as well: both would compensate."),
	KEY(AXIS("backlash-acceleration"), SETTINGS_NUMBER, AXIS_AT(backlash_acceleration),
	    AXIS_SET(BACKLASH_ACCELERATION), RANGE(0, 255000000), .scale = 1000000,
	    .unit = "pulses/s^2",
	    .help = "Acceleration of the backlash compensation, in steps of 1000000."),
	KEY(AXIS("postep-type"), SETTINGS_NUMBER, AXIS_AT(postep_type), AXIS_SET(POSTEP_TYPE),
	    RANGE(1, UINT8_MAX), WORDS({ "none", 0 }),
	    .help = "Type of this axis' PoStep motor driver, as named by the driver's own tool. It "
		    "needs postep = on, as do the next three keys."),
	KEY(AXIS("postep-address"), SETTINGS_NUMBER, AXIS_AT(postep_address),
	    AXIS_SET(POSTEP_ADDRESS), RANGE(0, UINT8_MAX),
	    .help = "I2C address of the PoStep driver."),
	KEY(AXIS("postep-microsteps"), SETTINGS_NUMBER, AXIS_AT(postep_step), AXIS_SET(POSTEP_STEP),
	    WORDS_ONLY,
	    WORDS({ "1", 0 }, { "2", 1 }, { "4", 2 }, { "8", 3 }, { "16", 4 }, { "32", 5 },
		  { "64", 6 }, { "128", 7 }, { "256", 8 }),
	    .help = "Microsteps per step of the PoStep driver. The driver must have power when the "
		    "daemon configures the device; nothing is saved in the driver."),
	KEY(AXIS("postep-temperature-limit"), SETTINGS_NUMBER, AXIS_AT(postep_temperature),
	    AXIS_SET(POSTEP_TEMPERATURE), RANGE(0, UINT8_MAX), .unit = "degrees C",
	    .help = "Temperature at which the PoStep driver counts as too hot."),

#define ENCODER(name) "encoder.#." name
	KEY(ENCODER("enable"), SETTINGS_NUMBER, ENCODER_FLAG(1), FLAG(1),
	    .help = "Count this encoder; on if any other key of this encoder is set. If no key of "
		    "an encoder is set, it keeps the device's setting."),
	KEY(ENCODER("sampling"), SETTINGS_NUMBER, ENCODER_FLAG(6), WORDS_ONLY,
	    WORDS({ "1", 0 }, { "2", 4 }, { "4", 2 }), .unit = "counts a line",
	    .help = "Edges that are counted; 4 if another key of this encoder is set."),
	KEY(ENCODER("pins"), SETTINGS_PIN_PAIR, ENCODER_AT(pin_a), .size = 2,
	    .set_offset = OF_ENCODER(pins_set), .set_size = 1, .set_bits = 1, TERMINALS,
	    .help = "Terminals of channel A and channel B. If not set, the device keeps its "
		    "terminals."),
	KEY("fast-encoders", SETTINGS_NUMBER, AT(fast_configuration), SET(FAST_ENCODERS),
	    .bits = 0x0f, WORDS_ONLY, WORDS({ "off", 0 }, { "on", 10 }, { "alternative", 1 }),
	    .help = "Encoders 0 to 2 are counted in hardware, at terminals 1 and 2, 5 and 6, 15 "
		    "and 16; with alternative, on older devices, at 3 and 4 instead of 5 and 6. "
		    "The fast-encoder keys are written together: keys that are not set are off "
		    "(sampling: 4)."),
	KEY("fast-encoder-sampling", SETTINGS_NUMBER, AT(fast_options), SET(FAST_ENCODERS),
	    .bits = 0x10, WORDS_ONLY, WORDS({ "1", 0x10 }, { "4", 0 }), .unit = "counts a line",
	    .help = "Edges that the fast encoders count."),
	KEY("fast-encoder.0.invert", SETTINGS_NUMBER, AT(fast_options), SET(FAST_ENCODERS),
	    .bits = 0x20, FLAG(0x20),
	    .help = "First fast encoder counts in the opposite "
		    "direction."),
	KEY("fast-encoder.1.invert", SETTINGS_NUMBER, AT(fast_options), SET(FAST_ENCODERS),
	    .bits = 0x40, FLAG(0x40),
	    .help = "Second fast encoder counts in the opposite "
		    "direction."),
	KEY("fast-encoder.2.invert", SETTINGS_NUMBER, AT(fast_options), SET(FAST_ENCODERS),
	    .bits = 0x80, FLAG(0x80),
	    .help = "Third fast encoder counts in the opposite "
		    "direction."),
	KEY("fast-encoder-index", SETTINGS_NUMBER, AT(fast_options), SET(FAST_ENCODERS), .bits = 1,
	    FLAG(1), .help = "Terminals 9, 11 and 27 reset the fast encoders to zero."),
	KEY("ultra-fast-encoder", SETTINGS_NUMBER, AT(ultra_enable), SET(ULTRA_FAST), FLAG(1),
	    .help = "Encoder 25, at terminals 8 (A), 12 (B) and 13 (index). The ultra-fast-encoder "
		    "keys are written together: keys that are not set are off (sampling: 4)."),
	KEY("ultra-fast-encoder-sampling", SETTINGS_NUMBER, AT(ultra_options), SET(ULTRA_FAST),
	    .bits = 4, WORDS_ONLY, WORDS({ "1", 0 }, { "4", 4 }), .unit = "counts a line",
	    .help = "Edges that are counted."),
	KEY("ultra-fast-encoder-mode", SETTINGS_NUMBER, AT(ultra_options), SET(ULTRA_FAST),
	    .bits = 2, WORDS_ONLY, WORDS({ "quadrature", 0 }, { "direction", 2 }),
	    .help = "With direction, A is the direction and B is the clock."),
	KEY("ultra-fast-encoder-invert", SETTINGS_NUMBER, AT(ultra_options), SET(ULTRA_FAST),
	    .bits = 1, FLAG(1), .help = "The encoder counts in the opposite direction."),
	KEY("ultra-fast-encoder-filter", SETTINGS_NUMBER, AT(ultra_filter), SET(ULTRA_FAST),
	    RANGE(0, UINT32_MAX), .help = "Delay of the encoder's input filter; 0 is off."),

	KEY("pwm-period", SETTINGS_NUMBER, AT(pwm_period), SET(PWM_PERIOD), RANGE(1, UINT32_MAX),
	    .unit = "ticks",
	    .help = "Period of all PWM outputs in ticks of the device's 25 MHz clock: 2500 is 10 "
		    "kHz."),
	KEY("analog-filter", SETTINGS_NUMBER, AT(analog_filter), SET(ANALOG_FILTER),
	    RANGE(0, UINT32_MAX),
	    .help = "Smoothing of all analog inputs: each sample keeps n/(n+1) of the old value; 0 "
		    "is off."),
	KEY("poextbus-connector", SETTINGS_NUMBER, AT(poextbus_connector), SET(POEXTBUS),
	    WORDS_ONLY, WORDS({ "dedicated", 0 }, { "terminals", 1 }),
	    .help = "Where PoExtBus is connected: at its own connector, or at terminals 35 to 37."),
	KEY("poextbus-crc", SETTINGS_NUMBER, AT(poextbus_no_crc), SET(POEXTBUS), WORDS_ONLY,
	    WORDS({ "on", 0 }, { "off", 1 }), .help = "PoExtBus sends a checksum."),
	KEY("matrix-keyboard", SETTINGS_NUMBER, AT(matrix_enable), SET(MATRIX), FLAG(1),
	    .help = "The device scans a matrix keyboard. The three matrix keys are written "
		    "together."),
	KEY("matrix-rows", SETTINGS_PIN_ROW, AT(matrix_row_pin), SET(MATRIX), TERMINALS,
	    .counted = offsetof(struct pokeys_settings, matrix_rows),
	    .help = "Terminals of the keyboard's rows, starting with the first."),
	KEY("matrix-columns", SETTINGS_PIN_ROW, AT(matrix_column_pin), SET(MATRIX), TERMINALS,
	    .counted = offsetof(struct pokeys_settings, matrix_columns),
	    .help = "Terminals of the keyboard's columns."),
	KEY("failsafe-timeout-ms", SETTINGS_NUMBER, AT(failsafe_timeout), SET(FAILSAFE),
	    RANGE(100, 25500), .scale = 100, WORDS({ "off", 0 }), .unit = "ms",
	    .help = "How long the device waits for the daemon before it brings its outputs into "
		    "the failsafe state by itself, in steps of 100. 1000 if not set; off switches "
		    "the device's failsafe off."),
	KEY("failsafe-parts", SETTINGS_NUMBER, AT(failsafe_peripherals), SET(FAILSAFE),
	    RANGE(0, 15),
	    .help = "What the device's failsafe acts on, as a sum: 1 digital outputs, 2 PoExtBus, "
		    "4 PWM, 8 pulse engine; 15 if not set."),
	KEY("failsafe-on", SETTINGS_PIN_BITS, AT(failsafe_outputs), SET(FAILSAFE), TERMINALS,
	    .help = "Outputs that are on in the device's failsafe state; all others are off. If "
		    "not set, the outputs in safe-on."),
	KEY("failsafe-poextbus", SETTINGS_BYTES, AT(failsafe_poextbus), SET(FAILSAFE),
	    RANGE(0, 255),
	    .help = "Bytes of PoExtBus in the device's failsafe state; 0 if not "
		    "set."),
	KEY("failsafe-pwm", SETTINGS_BYTES, AT(failsafe_pwm), SET(FAILSAFE), RANGE(0, 100),
	    .unit = "%",
	    .help = "Duty cycles of the PWM outputs in the device's failsafe state; 0 if not set."),
	KEY("device-name", SETTINGS_TEXT, AT(name), SET(NAME),
	    .help = "Name that is stored in the device."),
};

const size_t settings_key_count = sizeof(settings_keys) / sizeof(settings_keys[0]);
