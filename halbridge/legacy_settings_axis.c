/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * An axis' settings under their older names, and what is made of the joint's:
 * the device counts pulses, a machine's INI file units.
 *
 * Derived values follow the old component's formulas, without its cuts to
 * whole numbers: speeds and limits are units times STEP-SCALE, the position
 * has an offset that makes every place on the axis a positive number of
 * pulses (PositionOffset), and homing speeds are percentages. A parameter that
 * is derived shows the result; where its source is 0 it keeps what was set.
 */
#include "halbridge/legacy_settings.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include <pokeys/command.h>

#define DECELERATION	1.5	/* of the acceleration */

enum { UNKNOWN = -1, HOMING_DEFAULT = 30, RETURN_DEFAULT = 50, PERCENT = 100, STOP = 8 };

/* Settings that are the same number under both names. */
struct pair {
	uint16_t from;		/* in struct legacy_axis_settings */
	uint8_t size;
	uint16_t to;		/* in struct value_axis_settings */
};

#define PAIR(from_, to_) {								\
	offsetof(struct legacy_axis_settings, from_),					\
	sizeof(((struct legacy_axis_settings *)0)->from_),				\
	offsetof(struct value_axis_settings, to_) }

static const struct pair pairs[] = {
	PAIR(enabled, enable), PAIR(inverted, invert), PAIR(home_inverted, home_invert),
	PAIR(soft_limits, soft_limits), PAIR(masked, masked),
	PAIR(limit_minus, limit_neg), PAIR(limit_plus, limit_pos), PAIR(home_switch, home),
	PAIR(home_on_minus, home_on_limit_neg), PAIR(home_on_plus, home_on_limit_pos),
	PAIR(limit_minus_invert, limit_neg_invert), PAIR(limit_plus_invert, limit_pos_invert),
	PAIR(home_invert, home_switch_invert),
	PAIR(limit_minus_pin, limit_neg_pin), PAIR(limit_plus_pin, limit_pos_pin),
	PAIR(home_pin, home_pin), PAIR(enable_pin, enable_pin), PAIR(enable_invert, enable_invert),
	PAIR(limit_minus_filter, limit_neg_filter), PAIR(limit_plus_filter, limit_pos_filter),
	PAIR(home_filter, home_filter), PAIR(probe_filter, probe_filter),
	PAIR(homing_speed, homing_speed), PAIR(homing_return, homing_return_speed),
	PAIR(mpg_encoder, mpg_encoder), PAIR(mpg_multiplier, mpg_multiplier),
	PAIR(mpg_divider, mpg_divider),
};

/* Bits of a byte that have parameters of their own, least first. */
struct bits {
	uint8_t count;
	struct {
		uint8_t bit;
		uint16_t at;		/* in struct legacy_axis_settings */
		uint8_t size;
	} of[8];
};

#define BIT(bit_, member_) {								\
	bit_, offsetof(struct legacy_axis_settings, member_),				\
	sizeof(((struct legacy_axis_settings *)0)->member_) }

static const struct bits options = { 7, {
	BIT(1, enabled), BIT(2, inverted), BIT(4, planner), BIT(8, position_mode),
	BIT(16, home_inverted), BIT(32, soft_limits), BIT(128, masked) } };
static const struct bits switches = { 8, {
	BIT(1, limit_minus), BIT(2, limit_plus), BIT(4, home_switch), BIT(8, home_on_minus),
	BIT(16, home_on_plus), BIT(32, limit_minus_invert), BIT(64, limit_plus_invert),
	BIT(128, home_invert) } };
static const struct bits homing = { 8, {
	BIT(1, on_home[0]), BIT(2, on_home[1]), BIT(4, on_home[2]), BIT(8, on_home[3]),
	BIT(16, off_home[0]), BIT(32, off_home[1]), BIT(64, off_home[2]),
	BIT(128, off_home[3]) } };

/* A member of one or four bytes as a number. */
static int32_t load(const struct legacy_axis_settings *set, size_t at, size_t size)
{
	const unsigned char *from = (const unsigned char *)set + at;
	int32_t value = *from;

	if (size > 1)
		memcpy(&value, from, sizeof(value));
	return value;
}

static void store(struct legacy_axis_settings *set, size_t at, size_t size, int32_t value)
{
	unsigned char *to = (unsigned char *)set + at;

	if (size > 1)
		memcpy(to, &value, sizeof(value));
	else
		*to = value != 0;
}

static uint32_t build(const struct legacy_axis_settings *set, const struct bits *bits)
{
	uint32_t built = 0;

	for (unsigned int i = 0; i < bits->count; i++)
		built |= load(set, bits->of[i].at, bits->of[i].size) ? bits->of[i].bit : 0u;
	return built;
}

/* The bits have the say; the byte only while all of them are false. */
static uint32_t settle(struct legacy_axis_settings *set, const struct bits *bits, uint32_t byte)
{
	uint32_t built = build(set, bits);

	for (unsigned int i = 0; !built && i < bits->count; i++)
		store(set, bits->of[i].at, bits->of[i].size, (byte & bits->of[i].bit) != 0);
	return built ? built : byte;
}

static int32_t whole(double pulses)
{
	return fabs(pulses) <= INT32_MAX ? (int32_t)lrint(pulses) : 0;
}

static uint32_t percent(double part, double of, uint32_t before, uint32_t otherwise)
{
	double result = PERCENT * fabs(part / of);

	if (part == 0 || of == 0 || !isfinite(result))
		return before ? before : otherwise;
	return (uint32_t)fmin(fmax(rint(result), 1), PERCENT);
}

static void derive_places(struct legacy_axis_settings *set, double scale)
{
	double turned = set->minimum > set->maximum ? -scale : scale;

	if (set->minimum < 0 && fabs(set->maximum - set->minimum) <= INT32_MAX)
		set->offset = (int32_t)(set->maximum - set->minimum);
	set->scale = whole(turned);
	set->zero_position = whole(set->offset * turned);
	set->home_position = whole((set->home + set->offset) * turned);
	set->arm_position = whole((set->minimum + set->offset) * turned);
	set->shown_minimum = (uint32_t)set->arm_position;
	set->shown_maximum = (uint32_t)whole((set->maximum + set->offset) * turned);
	if (set->soft_limits && set->soft_minimum == set->soft_maximum) {
		set->soft_minimum = set->shown_minimum;
		set->soft_maximum = set->shown_maximum;
	}
}

static void derive_speeds(struct legacy_axis_settings *set, double scale)
{
	if (set->velocity != 0) {
		set->max_speed = fabs(set->velocity * scale);
		set->enabled = 1;
		set->planner = 1;
	}
	if (set->acceleration != 0) {
		set->max_acceleration = fabs(set->acceleration * scale);
		set->max_deceleration = DECELERATION * set->max_acceleration;
	}
	if (set->home_offset == 0 && set->home_offset_steps)
		set->home_offset = (int32_t)set->home_offset_steps / scale;
	if (set->home_offset != 0)
		set->back_off = (uint32_t)whole(fabs(set->home_offset * scale));
	set->homing_speed = percent(set->search_velocity, set->velocity, set->homing_speed,
				    HOMING_DEFAULT);
	set->homing_return = percent(set->latch_velocity, set->search_velocity, set->homing_return,
				     RETURN_DEFAULT);
}

/* A home switch at the terminal of a limit switch is that switch. */
static void derive_switches(struct legacy_axis_settings *set)
{
	bool minus = set->home_pin && set->home_pin == set->limit_minus_pin;
	bool plus = set->home_pin && set->home_pin == set->limit_plus_pin;

	set->home_on_minus = set->home_on_minus || minus;
	set->home_on_plus = set->home_on_plus || plus;
	set->home_switch = set->home_switch && !minus && !plus;
}

/* A byte that nobody has touched, whose last bit somebody has set to false, is 0. */
static uint32_t byte_of(const struct legacy_axis_settings *before, const struct bits *bits,
			uint32_t was, uint32_t byte)
{
	return byte == was && build(before, bits) ? 0 : byte;
}

static void derive(struct legacy_axis_settings *set, const struct legacy_axis_settings *before,
		   double scale)
{
	derive_speeds(set, scale);
	derive_switches(set);
	set->options = settle(set, &options,
			      byte_of(before, &options, before->options, set->options));
	set->switches = settle(set, &switches,
			       byte_of(before, &switches, before->switches, set->switches));
	set->homing = settle(set, &homing,
			     byte_of(before, &homing, before->homing, set->homing));
	derive_places(set, scale);
}

#define MULTIPLIER	offsetof(struct value_axis_settings, mpg_multiplier)

/* Nobody has set anything: what the device has, once that is known. */
static void show(struct legacy_axis_settings *set, const struct value_axis_settings *device,
		 double scale)
{
	if (device->enable == UNKNOWN)
		return;
	for (size_t i = 0; i < sizeof(pairs) / sizeof(pairs[0]); i++) {
		int32_t value;

		memcpy(&value, (const unsigned char *)device + pairs[i].to, sizeof(value));
		if (value != (pairs[i].to == MULTIPLIER ? SETTING_MULTIPLIER_LEFT : UNKNOWN))
			store(set, pairs[i].from, pairs[i].size, value);
	}
	if (device->mode != UNKNOWN) {
		set->planner = device->mode != POKEYS_AXIS_BUFFERED;
		set->position_mode = device->mode == POKEYS_AXIS_POSITION;
	}
	if (device->homing_on_switch >= 0 && device->homing_off_switch >= 0)
		set->homing = (uint32_t)(device->homing_on_switch | device->homing_off_switch << 4);
	memset((void *)set->on_home, 0, sizeof(set->on_home));
	memset((void *)set->off_home, 0, sizeof(set->off_home));
	settle(set, &homing, set->homing);
	set->options = settle(set, &options, 0);
	set->switches = settle(set, &switches, 0);
	set->max_speed = isfinite(device->max_velocity) ? device->max_velocity * fabs(scale) : 0;
	set->max_acceleration = isfinite(device->max_acceleration) ?
				device->max_acceleration * fabs(scale) : 0;
	set->max_deceleration = isfinite(device->max_deceleration) ?
				device->max_deceleration * fabs(scale) : 0;
	set->soft_minimum = (uint32_t)whole(isfinite(device->soft_min) ?
					    device->soft_min * scale : 0);
	set->soft_maximum = (uint32_t)whole(isfinite(device->soft_max) ?
					    device->soft_max * scale : 0);
	set->back_off = (uint32_t)whole(isfinite(device->back_off) ? device->back_off * scale : 0);
}

static void put_real(param_float *to, double value)
{
	if (*to != value)
		*to = value;
}

/* The device has one code for "stop", and sums of the others. */
static int32_t nibble(uint32_t byte)
{
	byte &= 0x0f;
	return (int32_t)(byte & STOP ? STOP : byte);
}

static int32_t mode_of(const struct legacy_axis_settings *set)
{
	if (!set->planner)
		return POKEYS_AXIS_BUFFERED;
	return set->position_mode ? POKEYS_AXIS_POSITION : POKEYS_AXIS_VELOCITY;
}

static void put(struct value_axis_settings *to, const struct legacy_axis_settings *set,
		double scale)
{
	for (size_t i = 0; i < sizeof(pairs) / sizeof(pairs[0]); i++)
		legacy_put((void *)((unsigned char *)to + pairs[i].to),
			   load(set, pairs[i].from, pairs[i].size));
	legacy_put(&to->mode, mode_of(set));
	legacy_put(&to->homing_on_switch, nibble(set->homing));
	legacy_put(&to->homing_off_switch, nibble(set->homing >> 4));
	if (set->max_speed != 0)
		put_real(&to->max_velocity, set->max_speed / fabs(scale));
	if (set->max_acceleration != 0)
		put_real(&to->max_acceleration, set->max_acceleration / fabs(scale));
	if (set->max_deceleration != 0)
		put_real(&to->max_deceleration, set->max_deceleration / fabs(scale));
	if (set->soft_minimum != set->soft_maximum) {
		put_real(&to->soft_min, (int32_t)set->soft_minimum / scale);
		put_real(&to->soft_max, (int32_t)set->soft_maximum / scale);
	}
	put_real(&to->back_off, (int32_t)set->back_off / scale);
}

/*
 * The old component set the axis to position or to speed mode as it went. Here
 * an axis that is driven is driven by position, whatever its parameters say.
 */
static void follow_positions(struct value_axis_settings *to)
{
	if (to->mode != UNKNOWN)
		legacy_put(&to->mode, POKEYS_AXIS_POSITION);
}

void legacy_settings_axis(struct legacy_settings *own, struct values *values, unsigned int i,
			  bool driven)
{
	struct legacy_axis_settings *live = &values->legacy.axis_set[i], now;
	const struct legacy_axis_settings before = own->axis[i];
	struct legacy_group *group = &own->axis_group[i];
	double scale = values->joint[i].scale;

	if (!isfinite(scale) || scale == 0)
		scale = 1;
	legacy_group_begin(group, live, &now, &own->axis[i], sizeof(now));
	if (!group->touched)
		show(&now, &values->set.axis[i], scale);
	else if (own->apply)
		derive(&now, &before, scale);
	legacy_group_end(live, &now, &own->axis[i], sizeof(now));
	if (own->apply && group->touched && (!group->put || scale != own->scale[i]))
		put(&values->set.axis[i], &now, scale);
	if (driven && now.enabled)
		follow_positions(&values->set.axis[i]);
	group->put = own->apply;
	own->scale[i] = scale;
}
