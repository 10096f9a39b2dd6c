/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the device does by itself when nobody talks to it (protocol section 3.21).
 *
 * The settings go together: as soon as one is set, the others are sent with what
 * the device has. The timeout should be longer than a restart of the daemon.
 *
 * They are set once for a machine, and pokeysd.conf takes them as well: so they are
 * what stays out where both schemes have to share HAL's memory (names=both).
 */
#include "halbridge/table_rows.h"

#define FAILSAFE(name, member, low, high, help)					\
	ROW("failsafe." name, PARAM, RW, WRITE, set.failsafe.member,			\
	    "device setting: " help, SETTING(low, high), APART)

static const struct table_row rows[] = {
	ROW("failsafe.state", PIN, OUT, READ, diagnostics.failsafe_state,
	    "0 not known or none, 1 off, 2 on as configured, 3 on, but not as configured"),
	FAILSAFE("timeout-ms", timeout_ms, 0, 25500, "in steps of 100 ms; 0 off"),
	FAILSAFE("digital", digital, 0, 1, "digital outputs take the values of failsafe.pin"),
	FAILSAFE("PoExtBus", poextbus, 0, 1, "PoExtBus takes the bytes of failsafe.PoExtBus-byte"),
	FAILSAFE("pwm", pwm, 0, 1, "PWM takes the duties of failsafe.pwm-duty"),
	FAILSAFE("engine", engine, 0, 1, "the pulse engine stops"),
	LIST("failsafe.pin.%02u", PARAM, RW, WRITE, set.failsafe.pin, POKEYS_PINS,
	     "device setting: value of the output in the failsafe state", SETTING(0, 1), APART),
	LIST("failsafe.PoExtBus-byte.%02u", PARAM, RW, WRITE, set.failsafe.bus_byte,
	     POKEYS_POEXTBUS, "device setting: value of the byte in the failsafe state",
	     SETTING(0, 255), APART),
	LIST("failsafe.pwm-duty.%02u", PARAM, RW, WRITE, set.failsafe.duty, POKEYS_PWM,
	     "device setting: duty in the failsafe state, percent", SETTING(0, 100), APART),
};

TABLE_GROUP(table_failsafe, rows);
