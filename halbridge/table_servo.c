/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Servo motors that the daemon controls, [servo NAME] in pokeysd.conf. What they are is configured
 * there; here they get their positions from LinuxCNC, as joints. They are there on request
 * (names=servos), as those of heaters are.
 */
#include "halbridge/table_rows.h"

#define IN_PIN(name, member, help)	\
	ROWS("servo.%02u." name, PIN, IN, WRITE, servo, member, help, OF_SERVOS)
#define OUT_PIN(name, member, help)	\
	ROWS("servo.%02u." name, PIN, OUT, READ, servo, member, help, OF_SERVOS)

/* Of a program without LinuxCNC's own homing; there is no room for them in names=all. */
#define HOME_PIN(name, direction, when, member, help)	\
	ROWS("servo.%02u." name, PIN, direction, when, servo, member, help, GAIN_OF_SERVOS)

#define GAIN(name, which, help)								\
	ROWS("servo.%02u." name, PARAM, RW, WRITE, servo, gain[POKEYS_GAIN_##which],	\
	     help "; until it is set, that of the daemon", SETTING_FLOAT(0, 1e6), GAIN_OF_SERVOS)

static const struct table_row rows[] = {
	IN_PIN("pos-cmd", pos_cmd, "commanded position, units of counts-per-unit"),
	IN_PIN("vel-cmd", vel_cmd,
	       "commanded velocity, units/s, for the feed-forward; 0 = it is found from pos-cmd"),
	IN_PIN("enable", enable,
	       "the motor is to follow pos-cmd; at its rising edge, the axis has to be there"),
	IN_PIN("reset", reset,
	       "its rising edge: clear the fault; refused while its cause is there"),
	OUT_PIN("pos-fb", pos_fb, "position of the encoder, units of counts-per-unit"),
	OUT_PIN("vel-fb", vel_fb, "its velocity, units/s"),
	OUT_PIN("error", error, "following error, pos-cmd - pos-fb; after a fault as it was then"),
	OUT_PIN("output", output, "part of the full voltage, -1..1"),
	OUT_PIN("enabled", enabled,
		"the motor follows pos-cmd, or the device has not acknowledged yet that it is off"),
	OUT_PIN("fault", fault,
		"a fault has stopped the motor until it is reset, or it does not follow although "
		"it is to be enabled; for amp-fault-in"),
	OUT_PIN("fault-code", fault_code,
		"which fault: 0 none, 1 device not ready, 2 no readings, 3 emergency stop, 4 "
		"encoder jumps, 5 command is impossible, 6 following error, 7 stalled, 8 encoder "
		"silent, 9 runs away, 10 soft limit, 11 limit switch, 12 heater "
		"fault"),
	OUT_PIN("condition", condition, "what is wrong now, as fault-code has it"),
	OUT_PIN("refused", refused,
		"why it was not enabled: 0 it was, 1 the fault has to be reset first, 2 encoder or "
		"device not ready (condition), 3 not at the commanded position, 4 off has to be "
		"commanded first, 5 its commander does not read the position"),
	OUT_PIN("homed", homed, "the position is that of the machine"),
	OUT_PIN("limit-minus", limit_minus, "the limit switch at the lower end is pressed"),
	OUT_PIN("limit-plus", limit_plus, "the limit switch at the upper end is pressed"),
	HOME_PIN("home", IN, WRITE, home,
		 "its rising edge: find the home switch (home-search-speed in pokeysd.conf); the "
		 "motor has to stay enabled, and pos-cmd has no effect until homing has ended"),
	HOME_PIN("homing", OUT, READ, homing,
		 "the motor is homing, or is held afterwards until pos-cmd stays where it "
		 "is"),
	HOME_PIN("home-end", OUT, READ, home_end,
		 "how the last homing has ended: 0 there was none, or it has not ended, 1 it is "
		 "homed, 2 aborted, 3 the motor was switched off, or had a fault, 4 the home "
		 "switch did not close, 5 it did not open, 6 homing took too long, 7 no readings "
		 "of the home switch"),
	GAIN("pid-p", P, "gain: output for each unit of the following error"),
	GAIN("pid-i", I, "gain: output for each unit of the following error and second"),
	GAIN("pid-d", D, "gain: output for each unit/s of the following error's change"),
	GAIN("velocity-gain", VELOCITY, "feed-forward: output for each unit/s that is commanded"),
	GAIN("acceleration-gain", ACCELERATION,
	     "feed-forward: output for each unit/s^2 that is commanded"),
};

TABLE_GROUP(table_servo, rows);
