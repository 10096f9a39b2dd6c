/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Joints: an axis of the pulse engine in machine units, period by period.
 *
 * Names follow LinuxCNC's motion: pos-cmd, vel-cmd, pos-fb. How the axis is set
 * up in the device stands in table_axis.c.
 */
#include "halbridge/table_rows.h"

static const struct table_row rows[] = {
	ROWS("joint.%02u.enable", PIN, IN, WRITE, joint, enable, "this axis may move"),
	ROWS("joint.%02u.pos-cmd", PIN, IN, WRITE, joint, pos_cmd, "commanded position, units"),
	ROWS("joint.%02u.vel-cmd", PIN, IN, WRITE, joint, vel_cmd,
	     "commanded speed, units per second; 0, or unconnected: as fast as the axis may"),
	ROWS("joint.%02u.pos-fb", PIN, OUT, READ, joint, pos_fb,
	     "position as the device reports, units; in buffered mode see motion-type"),
	ROWS("joint.%02u.position-lost", PIN, OUT, READ, joint, position_lost,
	     "the position is not valid: the device has started a new count, or steps may be "
	     "lost; pos-fb continues without a jump, and the joint has to be homed"),
	ROWS("joint.%02u.motion-homed", PIN, IN, READ, joint, motion_homed,
	     "connect it to LinuxCNC's joint.N.homed; its rising edge clears position-lost"),
	ROWS("joint.%02u.following-error", PIN, OUT, READ, joint, following_error,
	     "command less position, units; 0 unless it is driven by positions. In buffered mode, "
	     "the delay of the buffer is not included"),
	ROWS("joint.%02u.in-position", PIN, OUT, READ, joint, in_position,
	     "is at the position last commanded"),
	ROWS("joint.%02u.enabled", PIN, OUT, READ, joint, enabled, "the daemon drives this axis"),
	ROWS("joint.%02u.home", PIN, IN, WRITE, joint, home,
	     "its rising edge: the device homes this joint and all of its home-group"),
	ROWS("joint.%02u.homing", PIN, OUT, READ, joint, homing,
	     "is being homed, or waits for homing"),
	ROWS("joint.%02u.homed", PIN, OUT, READ, joint, homed, "homed by the device"),
	ROWS("joint.%02u.home-group", PARAM, RW, WRITE, joint, home_group,
	     "joints with the same number are homed together (a gantry); 0: alone",
	     PARAMETER(0, 0, POKEYS_AXES)),
	ROWS("joint.%02u.home-offset", PARAM, RW, WRITE, joint, home_offset,
	     "position of the joint when its home switch is found, units"),
	ROWS("joint.%02u.error", PIN, OUT, READ, joint, error, "motor driver's error input"),
	ROWS("joint.%02u.limit-neg", PIN, OUT, READ, joint, limit_neg, "negative limit switch"),
	ROWS("joint.%02u.limit-pos", PIN, OUT, READ, joint, limit_pos, "positive limit switch"),
	ROWS("joint.%02u.soft-limit", PIN, OUT, READ, joint, soft_limit, "soft limit reached"),
	ROWS("joint.%02u.home-sw", PIN, OUT, READ, joint, home_switch, "home switch"),
	ROWS("joint.%02u.state", PIN, OUT, READ, joint, state,
	     "0 stopped, 1 ready, 2 running, 8 resetting, 9 backing off, 10 home, "
	     "11 homing starts, 12 homing search, 13 homing back, 14 probed, 15 probe starts, "
	     "16 probe search, 20 error, 30 limit"),
	ROWS("joint.%02u.refused", PIN, OUT, WRITE, joint, refused,
	     "a command or the scale of this joint is not used: not a number, out of range, "
	     "beyond the soft limits, too fast, no such axis, or scale changed while enabled; "
	     "the log says which"),
	ROWS("joint.%02u.scale", PARAM, RW, WRITE, joint, scale,
	     "pulses per unit, not 0; taken over while enable is false", PARAMETER(1, 0, 0)),
	ROWS("joint.%02u.limit-neg-dedicated", PIN, OUT, READ, joint, limit_neg_dedicated,
	     "the axis' own limit input, before inversion", APART),
	ROWS("joint.%02u.limit-pos-dedicated", PIN, OUT, READ, joint, limit_pos_dedicated,
	     "the axis' own limit input, before inversion", APART),
	ROWS("joint.%02u.home-dedicated", PIN, OUT, READ, joint, home_dedicated,
	     "the axis' own home input, before inversion", APART),
	ROWS("joint.%02u.probed", PIN, OUT, READ, joint, probed,
	     "the axis' bit of the probe status: probe-pos is from the last probing"),
	ROWS("joint.%02u.probe-pos", PIN, OUT, READ, joint, probe_pos,
	     "where the probe tripped, units"),
	ROWS("joint.%02u.probe-target", PIN, IN, WRITE, joint, probe_target,
	     "where the device ends a probing that touches nothing, units"),
};

TABLE_GROUP(table_joint, rows);
