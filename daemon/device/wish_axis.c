/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The parts of one axis' settings: which bit, which member, what is in range.
 *
 * Speeds go through nowhere unless they are numbers above zero: the device
 * takes any four bytes for a speed. The limits of travel are judged together
 * when both are wished at once.
 */

#include <math.h>
#include "daemon/device/wish.h"

#define SPEED_MAX 1e6f		/* pulses/s */
#define SOFT_LIMITS (POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM)
#define ACCELERATION_MAX 1e9f	/* pulses/s^2 */

/* Of an axis: a byte up to `most`, or a number that is judged beside. */
struct axis_part {
	uint32_t bit;
	uint8_t offset, size, most;
	const char *name;
};

#define AXIS(NAME, member, most) { POKEYS_AXIS_SET_##NAME, \
		offsetof(struct pokeys_axis_settings, member), \
		sizeof(((struct pokeys_axis_settings *)0)->member), most, #NAME }

static const struct axis_part axis_parts[] = {
	AXIS(PIN_LIMIT_MINUS, pin_limit_minus, POKEYS_PINS),
	AXIS(PIN_LIMIT_PLUS, pin_limit_plus, POKEYS_PINS),
	AXIS(PIN_HOME, pin_home, POKEYS_PINS),
	AXIS(PIN_ENABLE, pin_enable, POKEYS_PINS),
	AXIS(INVERT_ENABLE, invert_enable, 1),
	AXIS(FILTER_LIMIT_MINUS, filter_limit_minus, 254),
	AXIS(FILTER_LIMIT_PLUS, filter_limit_plus, 254),
	AXIS(FILTER_HOME, filter_home, 254),
	AXIS(FILTER_PROBE, filter_probe, 254),
	AXIS(HOMING_ALGORITHM, homing_algorithm, 255),
	AXIS(HOMING_SPEED, homing_speed, 100),
	AXIS(HOMING_RETURN, homing_return, 100),
	AXIS(BACK_OFF, back_off, 0),
	AXIS(MPG_ENCODER, mpg_encoder, POKEYS_ENCODERS),
	AXIS(MPG_MULTIPLIER, mpg_multiplier, 0),
	AXIS(MPG_DIVIDER, mpg_divider, 0),
	AXIS(MAX_SPEED, max_speed, 0),
	AXIS(MAX_ACCELERATION, max_acceleration, 0),
	AXIS(MAX_DECELERATION, max_deceleration, 0),
	AXIS(SOFT_MINIMUM, soft_minimum, 0),
	AXIS(SOFT_MAXIMUM, soft_maximum, 0),
	AXIS(SIGNALS, signals, 7),
	AXIS(BACKLASH_WIDTH, backlash_half, 0),
	AXIS(BACKLASH_ACCELERATION, backlash_acceleration, 255),
	AXIS(POSTEP_TYPE, postep_type, 255),
	AXIS(POSTEP_ADDRESS, postep_address, 255),
	AXIS(POSTEP_STEP, postep_step, 8),
	AXIS(POSTEP_TEMPERATURE, postep_temperature, 255),
};

enum { AXIS_PARTS = sizeof(axis_parts) / sizeof(axis_parts[0]) };

const char *wish_axis_part(long long part)
{
	return part > 0 && part <= AXIS_PARTS ? axis_parts[part - 1].name : "";
}

void wish_lay_axis(struct pokeys_axis_settings *to, const struct pokeys_axis_settings *from)
{
	to->options = wish_lay_bits(to->options, from->options, from->options_mask);
	to->options_mask |= from->options_mask;
	to->switches = wish_lay_bits(to->switches, from->switches, from->switches_mask);
	to->switches_mask |= from->switches_mask;
	for (unsigned int i = 0; i < AXIS_PARTS; i++) {
		if (from->set & axis_parts[i].bit)
			wish_lay_span(to, from, axis_parts[i].offset, axis_parts[i].size);
	}
	to->set |= from->set;
}

static bool number_good(float value, float most)
{
	return isfinite(value) && value > 0 && value <= most;
}

static bool axis_part_good(const struct pokeys_axis_settings *axis, const struct axis_part *part)
{
	switch (part->bit) {
	case POKEYS_AXIS_SET_MAX_SPEED:
		return number_good(axis->max_speed, SPEED_MAX);
	case POKEYS_AXIS_SET_MAX_ACCELERATION:
		return number_good(axis->max_acceleration, ACCELERATION_MAX);
	case POKEYS_AXIS_SET_MAX_DECELERATION:
		return number_good(axis->max_deceleration, ACCELERATION_MAX);
	case POKEYS_AXIS_SET_SOFT_MINIMUM:
	case POKEYS_AXIS_SET_SOFT_MAXIMUM:
		return true; /* limits_good() */
	default:
		return part->size > 1 || ((const uint8_t *)axis)[part->offset] <= part->most;
	}
}

static uint8_t part_of(uint32_t bit)
{
	uint8_t part = 1;

	while (axis_parts[part - 1].bit != bit)
		part++;
	return part;
}

/* Of limits that contradict each other none is taken: half a pair means nothing. */
static bool limits_good(struct pokeys_axis_settings *axis, const struct pokeys_axis_settings *old)
{
	if (~axis->set & SOFT_LIMITS || axis->soft_minimum <= axis->soft_maximum)
		return true;
	axis->soft_minimum = old->soft_minimum;
	axis->soft_maximum = old->soft_maximum;
	wish_restore(&axis->set, old->set, SOFT_LIMITS);
	return false;
}

void wish_judge_axis(struct wish_judge *judge, unsigned int index)
{
	struct pokeys_axis_settings *axis = &judge->now->axis[index];
	const struct pokeys_axis_settings *old = &judge->old->axis[index];

	if (!limits_good(axis, old))
		judge->refuse(judge->context, POKEYS_SETTING_AXIS, (uint8_t)index,
			      part_of(POKEYS_AXIS_SET_SOFT_MAXIMUM));
	for (unsigned int i = 0; i < AXIS_PARTS; i++) {
		if (!(axis->set & axis_parts[i].bit) || axis_part_good(axis, &axis_parts[i]))
			continue;
		wish_lay_span(axis, old, axis_parts[i].offset, axis_parts[i].size);
		wish_restore(&axis->set, old->set, axis_parts[i].bit);
		judge->refuse(judge->context, POKEYS_SETTING_AXIS, (uint8_t)index,
			      (uint8_t)(i + 1));
	}
}
