/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What hangs on the pulse engine besides: backlash, PoStep drivers, what follows an axis
 * (protocol section 3.24.3, 0x85/0A, 0B, 40, 41 and 50 to 54).
 *
 * Few machines have any of it, and pokeysd.conf takes the settings as well: so it stays
 * out where both schemes have to share HAL's memory (names=both). Lengths are in machine
 * units; the device has half of the play, in pulses. A pin for each bit of eight drivers
 * would leave three devices no room: faults and inputs are words.
 */
#include "halbridge/table_rows.h"

#define ENGINE(name, member, high, help)						\
	ROW(name, PARAM, RW, WRITE, set.member, "device setting: " help, SETTING(0, high), APART)
#define AXIS(name, member, high, help)							\
	ROWS("joint.%02u." name, PARAM, RW, WRITE, set.axis, member,			\
	     "device setting: " help, SETTING(0, high), APART)
#define LENGTH(name, member, help)							\
	ROWS("joint.%02u." name, PARAM, RW, WRITE, set.axis, member,			\
	     "device setting: " help, SETTING_FLOAT(0, 1e15), APART)
#define DRIVER(name, member, help)							\
	ROWS("joint.%02u.postep." name, PIN, OUT, READ, drive.postep, member,		\
	     "PoStep driver: " help, APART)
#define RATE(name, group, help)								\
	ROW("rate." name, PIN, OUT, READ, diagnostics.rate_hz[POKEYS_SLOW_##group],	\
	    help ", measured, Hz", APART)

static const struct table_row rows[] = {
	ENGINE("engine.backlash", backlash, 1, "the device compensates the backlash of its axes"),
	ENGINE("engine.backlash-speed", backlash_speed, 255,
	       "highest speed of the compensation, as the device has it; unit not documented"),
	LENGTH("backlash-width", backlash_width,
	       "backlash that the device compensates, units; do not also set BACKLASH in the "
	       "INI file"),
	LENGTH("backlash-acceleration", backlash_acceleration,
	       "units per second^2, in steps of 1000000 pulses per second^2"),
	LIST("joint.%02u.backlash-taken", PIN, OUT, READ, drive.backlash, POKEYS_AXES,
	     "pulses that the device has added", APART),

	ENGINE("engine.postep", postep, 1, "the device talks to PoStep drivers"),
	AXIS("postep.type", postep_type, 255, "type of the PoStep driver, 0 none"),
	AXIS("postep.address", postep_address, 255, "its I2C address"),
	AXIS("postep.step-mode", postep_step, 8,
	     "its microsteps: 0 full steps, 1 1/2, 2 1/4 .. 8 1/256"),
	AXIS("postep.temperature-limit", postep_temperature, 255, "degrees C"),
	DRIVER("supply", supply, "supply, V"),
	DRIVER("temperature", temperature, "degrees C"),
	DRIVER("state", state, "1 sleep, 2 active, 3 idle, 4 overheated, 5 DC motor"),
	DRIVER("fault", fault, "any fault"),
	DRIVER("faults", faults,
	       "1 too hot, 2 and 4 overcurrent A and B, 8 and 16 predriver A and B, "
	       "32 undervoltage, 64 stall, 128 stall latched"),
	DRIVER("inputs", inputs,
	       "1 bootloader, 2 sleep, 4 step, 8 direction, 16 BIN1, 32 BIN2, 64 end switch"),
	DRIVER("updates", updates, "number of its answers to the device, as far as observed"),
	DRIVER("age-ms", age_ms, "time since its last observed answer; -1 none yet"),
	DRIVER("current-raw", full_scale, "full scale current; unit not documented, never written"),
	DRIVER("current-idle-raw", idle, "idle current; unit not documented, never written"),
	DRIVER("current-overheat-raw", overheat,
	       "current when overheated; unit not documented, never written"),
	DRIVER("hardware", hardware, "version of its hardware, major * 100 + minor"),
	DRIVER("firmware", firmware, "version of its firmware, major * 100 + minor"),

	ENGINE("synced-pwm.enable", sync.pwm_enable, 1,
	       "a PWM output follows an axis in buffered mode"),
	ENGINE("synced-pwm.axis", sync.pwm_axis, POKEYS_AXES - 1, "the axis, from 0"),
	ENGINE("synced-pwm.channel", sync.pwm_channel, POKEYS_PWM - 1, "the output, from 0"),
	ENGINE("synced-out.enable", sync.out_enable, 1,
	       "eight outputs follow an axis in buffered mode"),
	ENGINE("synced-out.axis", sync.out_axis, POKEYS_AXES - 1, "the axis, from 0"),
	LIST("synced-out.pin.%02u", PARAM, RW, WRITE, set.sync.out_pin, 8,
	     "device setting: terminal of a bit, 92..99 external outputs, 0 none", SETTING(0, 99),
	     APART),

	RATE("backlash", BACKLASH, "backlash added by the device"),
	RATE("postep", POSTEP, "status of PoStep drivers"),
	RATE("postep-rare", POSTEP_RARE, "their currents, modes and versions, in turns"),
};

TABLE_GROUP(table_drive, rows);
