// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What an axis of the pulse engine needs for moves: a scale, and a name that means nothing else in
 * a file of moves, where it stands beside the names and numbers of servo motors.
 */
#include <string.h>
#include "daemon/control/config_judge.h"

enum { AXIS_MODE = 0x0D, AXIS_VELOCITY = 0x05 };

#define NAME_LETTERS "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-"

/* What else it is called, or NULL. */
static const char *why_not_name(const struct judged *j, unsigned int axis)
{
	const char *name = j->raw->axis[axis].name;

	if (name[strspn(name, NAME_LETTERS)])
		return "a name has the characters A-Z a-z 0-9 _ - only";
	if (!name[strspn(name, "0123456789")])
		return "a number is that of a servo motor";
	if (!strcmp(name, "speed"))
		return "a file of moves has that word for the speed";
	for (unsigned int i = 0; i < axis; i++)
		if (!strcmp(j->raw->axis[i].name, name))
			return "another axis has this name";
	for (uint32_t i = 0; i < j->file->servos; i++)
		if (judge_has_servo(j, i) && !strcmp(j->file->servo[i].name, name))
			return "a servo motor of this device has this name";
	return NULL;
}

static bool is_by_speed(const struct pokeys_axis_settings *axis)
{
	return (axis->options_mask & AXIS_MODE) == AXIS_MODE &&
	       (axis->options & AXIS_MODE) == AXIS_VELOCITY;
}

static void judge_one(const struct judged *j, unsigned int axis)
{
	const char *why = *j->raw->axis[axis].name ? why_not_name(j, axis) : NULL;

	if (why)
		judge_fault(j, "axis.#.name", axis, "axis.%u.name: \"%s\": %s", axis,
			    j->raw->axis[axis].name, why);
	if (*j->raw->axis[axis].name && j->raw->axis[axis].per_unit == 0)
		judge_fault(j, "axis.#.name", axis,
			    "axis.%u.name is for moves, which need "
			    "axis.%u.pulses-per-unit",
			    axis, axis);
	if (j->raw->axis[axis].per_unit != 0 && is_by_speed(&j->raw->settings.axis[axis]))
		judge_fault(j, "axis.#.pulses-per-unit", axis,
			    "axis.%u.pulses-per-unit is for "
			    "moves, and an axis with axis.%u.mode = velocity has no positions; "
			    "use position or buffered",
			    axis, axis);
}

void judge_axes(const struct judged *j)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		judge_one(j, i);
}
