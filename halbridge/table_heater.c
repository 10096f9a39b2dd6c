/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Heaters that the daemon controls, [heater NAME] in pokeysd.conf. What they are is configured
 * there; here they have a target, and say what they do. Three devices would have no room for their
 * names in HAL's memory, so they are there on request (names=heaters).
 */
#include "halbridge/table_rows.h"

#define OUT_PIN(name, member, help)	\
	ROWS("heater.%02u." name, PIN, OUT, READ, heater, member, help, OF_HEATERS)

#define GAIN(name, which, help)								\
	ROWS("heater.%02u." name, PARAM, RW, WRITE, heater, gain[POKEYS_GAIN_##which],	\
	     "gain: power of 0 to 255 for each " help "; until it is set, that of the daemon",	\
	     SETTING_FLOAT(0, 100000), GAIN_OF_HEATERS)

static const struct table_row rows[] = {
	ROWS("heater.%02u.target", PIN, IN, WRITE, heater, target,
	     "target, degrees C; 0 = off. After the start and after a fault it has to be 0 once",
	     OF_HEATERS),
	ROWS("heater.%02u.reset", PIN, IN, WRITE, heater, reset,
	     "its rising edge: clear the fault; refused while its cause is there", OF_HEATERS),
	OUT_PIN("temperature", temperature, "measured temperature, degrees C; nan = not known"),
	OUT_PIN("target-in-effect", target_in_effect,
		"target that the daemon controls to, degrees C; 0 = off"),
	OUT_PIN("power", power, "power of the heater, 0..1"),
	OUT_PIN("at-temperature", at_temperature,
		"it has a target, and is within at-temperature-k of it"),
	OUT_PIN("fault", fault, "a fault has switched the heater off, until it is reset"),
	OUT_PIN("fault-code", fault_code,
		"which: 0 none, 1 device not ready, 2 no readings, 3 reading is no number, 4 "
		"sensor open, 5 sensor shorted, 6 too hot, 7 too cold, 8 temperature jumps, 9 does "
		"not get warm, 10 does not stay warm, 11 full power has no effect"),
	OUT_PIN("condition", condition, "what is wrong now, as fault-code has it"),
	OUT_PIN("refused", refused,
		"why the last target was refused: 0 it was not, 1 out of range, 2 it has to be 0 "
		"first, 3 sensor or device not ready (condition)"),
	GAIN("pid-p", P, "kelvin below the target"),
	GAIN("pid-i", I, "kelvin and second below the target"),
	GAIN("pid-d", D, "kelvin/s of the temperature"),
};

TABLE_GROUP(table_heater, rows);
