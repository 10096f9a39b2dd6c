/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How the axes are set up in the device (protocol section 3.24.4).
 *
 * Lengths and speeds are in machine units and go through the joint's scale, so
 * they mean the same as the joint's pins. Terminals of switches are counted from
 * 1 here, as the device and its manual count them: 0 is the axis' own input.
 */
#include "halbridge/table_rows.h"

#define AXIS(name, member, low, high, help)						\
	ROWS("joint.%02u." name, PARAM, RW, WRITE, set.axis, member,			\
	     "device setting: " help, SETTING(low, high))
#define LENGTH(name, member, low, help)							\
	ROWS("joint.%02u." name, PARAM, RW, WRITE, set.axis, member,			\
	     "device setting: " help, SETTING_FLOAT(low, 1e15))
#define FLAG(name, member, help)	AXIS(name, member, 0, 1, help)

static const struct table_row rows[] = {
	FLAG("axis-enable", enable, "the axis exists"),
	FLAG("axis-invert", invert, "invert the direction"),
	AXIS("mode", mode, 1, 3,
	     "what drives it: 1 pos-cmd, the device makes the ramps (vel-cmd beside it); "
	     "2 vel-cmd; 3 pos-cmd in each period through the motion buffer"),
	FLAG("axis-masked", masked, "the enable output follows the axis' enable mask"),
	FLAG("soft-limits", soft_limits, "the soft limits are enabled"),
	LENGTH("soft-min", soft_min, -1e15, "units"),
	LENGTH("soft-max", soft_max, -1e15, "units"),
	LENGTH("max-velocity", max_velocity, 0, "units per second"),
	LENGTH("max-acceleration", max_acceleration, 0, "units per second^2"),
	LENGTH("max-deceleration", max_deceleration, 0, "units per second^2"),

	FLAG("limit-neg-enable", limit_neg, "there is a negative limit switch"),
	FLAG("limit-pos-enable", limit_pos, "there is a positive limit switch"),
	FLAG("home-enable", home, "there is a home switch"),
	FLAG("home-on-limit-neg", home_on_limit_neg,
	     "the negative limit switch is the home switch"),
	FLAG("home-on-limit-pos", home_on_limit_pos,
	     "the positive limit switch is the home switch"),
	FLAG("limit-neg-invert", limit_neg_invert, "1 normally open, 0 normally closed"),
	FLAG("limit-pos-invert", limit_pos_invert, "1 normally open, 0 normally closed"),
	FLAG("home-invert", home_switch_invert, "1 normally open, 0 normally closed"),
	AXIS("limit-neg-pin", limit_neg_pin, 0, POKEYS_PINS, "terminal, 0 the axis' own input"),
	AXIS("limit-pos-pin", limit_pos_pin, 0, POKEYS_PINS, "terminal, 0 the axis' own input"),
	AXIS("home-pin", home_pin, 0, POKEYS_PINS, "terminal, 0 the axis' own input"),
	AXIS("limit-neg-filter", limit_neg_filter, 0, 254, "filter, 0 none"),
	AXIS("limit-pos-filter", limit_pos_filter, 0, 254, "filter, 0 none"),
	AXIS("home-filter", home_filter, 0, 254, "filter, 0 none"),
	AXIS("probe-filter", probe_filter, 0, 254, "filter, 0 none"),
	AXIS("enable-pin", enable_pin, 0, POKEYS_PINS,
	     "terminal of the enable output, 0 the axis' own"),
	FLAG("enable-invert", enable_invert, "invert the enable output"),

	FLAG("homing-invert", home_invert, "search in the other direction"),
	AXIS("homing-on-switch", homing_on_switch, 0, 8,
	     "when the switch trips: sum of 1 slow down, 2 reverse, 4 arm the encoder's index; "
	     "or 8 reset the position and stop"),
	AXIS("homing-off-switch", homing_off_switch, 0, 8,
	     "when the switch is released: as for homing-on-switch"),
	AXIS("homing-speed", homing_speed, 0, 100, "percent of max-velocity"),
	AXIS("homing-return-speed", homing_return_speed, 0, 100, "percent of homing-speed"),
	LENGTH("homing-back-off", back_off, -1e15, "units"),

	AXIS("mpg-encoder", mpg_encoder, 0, POKEYS_ENCODERS,
	     "encoder of the hand wheel, from 1; 0 none"),
	ROWS("joint.%02u.mpg-multiplier", PARAM, RW, WRITE, set.axis, mpg_multiplier,
	     "device setting: pulses per count",
	     PARAMETER(SETTING_MULTIPLIER_LEFT, INT16_MIN, INT16_MAX)),
	AXIS("mpg-divider", mpg_divider, 0, UINT16_MAX, "divisor for mpg-multiplier"),
	FLAG("step-invert", step_invert, "invert the step signal"),
	FLAG("direction-invert", direction_invert, "invert the direction signal"),
	FLAG("index-falling", index_falling, "the index counts at its falling edge"),
};

TABLE_GROUP(table_axis, rows);
