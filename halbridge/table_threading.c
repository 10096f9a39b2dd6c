/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's own threading (docs/motion.md). Few machines use it, and both schemes
 * together have no room for it: all of it is set apart (names=both).
 */
#include "halbridge/table_rows.h"

#define OUT_PIN(name, member, help)	\
	ROW("threading." name, PIN, OUT, READ, threading.out.member, help, APART)
#define IN_PIN(name, member, help)	\
	ROW("threading." name, PIN, IN, WRITE, threading.member, "its rising edge: " help, APART)
#define SET(name, member, low, high, help)						\
	ROW("threading." name, PARAM, RW, WRITE, set.threading.member,			\
	    "device setting: " help, SETTING(low, high), APART)

static const struct table_row rows[] = {
	IN_PIN("prepare", prepare, "wait until the buffer is empty, then stop playing slots"),
	IN_PIN("force", force, "the same, immediately"),
	IN_PIN("arm", arm, "play from the spindle's next index on; waits for the first motion"),
	IN_PIN("release", release, "play slots by the millisecond again"),
	IN_PIN("cancel", cancel, "end threading; the engine is stopped"),
	OUT_PIN("preparing", preparing, "the device empties its buffer"),
	OUT_PIN("prepared", prepared,
		"the device plays nothing: the motion may begin, and "
		"threading may be armed"),
	OUT_PIN("waiting", waiting, "the device waits for the index"),
	OUT_PIN("active", active, "motion follows the spindle"),
	OUT_PIN("velocity", velocity,
		"speed of the spindle as the device estimates it; its unit "
		"is not documented"),
	OUT_PIN("position-error", position_error,
		"lag that the device reports; its unit is not "
		"documented"),
	OUT_PIN("spindle-rpm", spindle_rpm, "speed of the spindle"),
	OUT_PIN("index-count", index_count, "index pulses"),
	OUT_PIN("behind", behind, "milliseconds of commanded motion that have not been played yet"),
	OUT_PIN("refused", refused, "the last request was refused"),
	OUT_PIN("reason", reason,
		"why: 1 the machine is off, 2 settings are missing or not yet "
		"accepted, 3 no enabled joint in buffered mode takes part, 4 a "
		"joint has not come to rest, 5 already active, 6 not prepared, 7 "
		"not begun, 8 time-limit, 9 no connection"),
	OUT_PIN("error", error,
		"how the last threading ended: 0 success, 2 cancelled, 3 too late, "
		"4 the device did something else, 5 a switch tripped, 7 link lost, "
		"9 not known, 10 the buffer ran dry, 11 the spindle is too far "
		"behind"),
	ROW("threading.time-limit", PARAM, RW, WRITE, threading.time_limit,
	    "time limit for threading as a whole, seconds; 0: 300", PARAMETER(0, 0, 3600), APART),
	SET("mode", mode, 0, 3, "0 index, 1 encoder and index, 2 and 3 the same at high speed"),
	SET("ticks-per-revolution", ticks, 0, 65535, "counts of the ultra-fast encoder per turn"),
	SET("target-rpm", target_rpm, 0, 65535,
	    "spindle speed for which the motion is commanded; the spindle must never turn faster"),
	SET("speed-gain", speed_gain, 0, 65535,
	    "gain for the spindle speed; no unit is documented"),
	SET("position-gain", position_gain, 0, 65535,
	    "gain for correcting a lag; no unit is documented"),
	SET("ignore-axes", ignore_axes, 0, 255,
	    "joints that do not move during threading; bit 0 is joint 0"),
};

TABLE_GROUP(table_threading, rows);
