/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the device does by itself when it is asked to: homing and probing
 * (docs/motion.md). What belongs to one joint stands in table_joint.c.
 */
#include "halbridge/table_rows.h"

#define WHY	"0 success, 2 cancelled, 3 too late, 4 the device did something else, "	\
		"5 a switch tripped, 7 link lost, 8 refused, 9 not known"

static const struct table_row rows[] = {
	ROW("homing.active", PIN, OUT, READ, homing.active, "a joint is being homed"),
	ROW("homing.phase", PIN, OUT, READ, homing.phase,
	    "0 idle, 1 engine is being stopped, 2 start requested, 3 homing, 4 homed, 5 finishing, "
	    "6 stopping"),
	ROW("homing.error", PIN, OUT, READ, homing.error, "how the last homing ended: " WHY),
	ROW("homing.cancel", PIN, IN, WRITE, homing.cancel,
	    "its rising edge ends homing; joints that wait for it are not homed"),
	ROW("homing.time-limit", PARAM, RW, WRITE, homing.time_limit,
	    "time limit for homing, seconds; 0: 120", PARAMETER(0, 0, 3600)),

	ROW("probe.start", PIN, IN, WRITE, probe.start,
	    "its rising edge: the device starts to probe"),
	ROW("probe.cancel", PIN, IN, WRITE, probe.cancel,
	    "its rising edge ends probing; with probe.hybrid, motion goes on"),
	ROW("probe.active", PIN, OUT, READ, probe.active, "the device probes"),
	ROW("probe.done", PIN, OUT, READ, probe.done,
	    "the last probing touched: joint.NN.probe-pos is the position"),
	ROW("probe.error", PIN, OUT, READ, probe.error,
	    "how the last probing ended: " WHY "; 6 it touched nothing"),
	ROW("probe.contact", PIN, OUT, READ, probe.contact,
	    "the probe touches, or has latched its positions: for motion.probe-input"),
	ROW("probe.hybrid", PARAM, RW, WRITE, probe.hybrid,
	    "joints move by their commands while the device watches the probe; otherwise the "
	    "device moves the joints of probe.axes towards their probe-target",
	    PARAMETER(0, 0, 0)),
	ROW("probe.axes", PARAM, RW, WRITE, probe.axes, "bits of the joints that the device moves",
	    PARAMETER(0, 0, 255)),
	ROW("probe.speed", PARAM, RW, WRITE, probe.speed,
	    "speed as a fraction of their max-velocity", PARAMETER(0.1, 0, 1)),
	ROW("probe.time-limit", PARAM, RW, WRITE, probe.time_limit,
	    "time limit for probing, seconds; 0: 60", PARAMETER(0, 0, 3600)),
	ROW("probe.terminal", PARAM, RW, WRITE, probe.terminal,
	    "terminal of the probe; 0: probe.engine-input", PARAMETER(0, 0, POKEYS_PINS)),
	ROW("probe.engine-input", PARAM, RW, WRITE, probe.engine_input,
	    "input of the engine's connector, 0 none", PARAMETER(0, 0, 8)),
	ROW("probe.active-high", PARAM, RW, WRITE, probe.active_high,
	    "the input is true when the probe touches", PARAMETER(0, 0, 0)),
};

TABLE_GROUP(table_task, rows);
