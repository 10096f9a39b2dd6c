/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Analog inputs, and PWM outputs.
 *
 * adc value = volts * scale - offset, as LinuxCNC's canonical analog input. PWM
 * follows pwmgen: duty = value / scale + offset, limited to min-dc..max-dc. The
 * period is one for all channels; it is the device's setting.
 */
#include "halbridge/table_rows.h"

static const struct table_row rows[] = {
	ROWS("adc.%02u.value", PIN, OUT, READ, analog, value,
	     "analog input: volts * scale - offset; adc.00 is pin 41"),
	ROWS("adc.%02u.raw", PIN, OUT, READ, analog, raw, "0..4095 = 0..3.3 V at the pin"),
	ROWS("adc.%02u.scale", PARAM, RW, READ, analog, scale, "units per volt",
	     PARAMETER(1, 0, 0)),
	ROWS("adc.%02u.offset", PARAM, RW, READ, analog, offset, "units, subtracted"),
	ROW("adc.filter", PARAM, RW, READ, set.analog_filter,
	    "device setting: constant RC of the low-pass of all analog inputs "
	    "(y = y * RC / (RC + 1) + u / (RC + 1)), 0 none",
	    SETTING(0, INT32_MAX)),

	ROWS("pwm.%02u.value", PIN, IN, WRITE, pwm, value,
	     "duty = value / scale + offset; pwm.00 is pin 22, pwm.05 is pin 17"),
	ROWS("pwm.%02u.enable", PIN, IN, WRITE, pwm, enable, "false: duty 0"),
	ROWS("pwm.%02u.duty", PIN, OUT, READ, pwm, duty, "as the device has it, 0..1"),
	ROWS("pwm.%02u.enabled", PIN, OUT, READ, pwm, enabled, "the device has the channel on"),
	ROWS("pwm.%02u.scale", PARAM, RW, WRITE, pwm, scale, "units at full duty, not 0",
	     PARAMETER(1, 0, 0)),
	ROWS("pwm.%02u.offset", PARAM, RW, WRITE, pwm, offset, "duty, added"),
	ROWS("pwm.%02u.min-dc", PARAM, RW, WRITE, pwm, min_dc, "minimum duty", PARAMETER(0, 0, 1)),
	ROWS("pwm.%02u.max-dc", PARAM, RW, WRITE, pwm, max_dc, "maximum duty", PARAMETER(1, 0, 1)),
	ROW("pwm.frequency", PARAM, RW, WRITE, set.pwm_frequency,
	    "device setting: of all channels, Hz", SETTING_FLOAT(0.01, 1e6)),
};

TABLE_GROUP(table_analog, rows);
