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
 *
 * An axis whose AxisEnabled is 0 was neither set up nor moved, and some parameters
 * let the device keep what it has while they are 0: INI files are full of zeros
 * that mean nothing. So 0 counts for those only if somebody sets it in place of
 * something else, and not before ApplyIniSettings is true. An AxisEnabled that
 * nobody has set is what the device has, or 1 if the axis is given a speed.
 */
#include "halbridge/legacy_settings.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include <pokeys/command.h>
#include "halbridge/legacy_bits.h"

#define DECELERATION	1.5	/* of the acceleration */

enum {
	UNKNOWN = -1,
	HOMING_DEFAULT = 30,
	RETURN_DEFAULT = 50,
	PERCENT = 100,
	STOP = 8,
	UNSAID = -1, /* AxisEnabled, if nobody has set it */
	USED = 1
}; /* AxisEnabled in legacy_settings.zeroed: the first pair */

/* Settings that are the same number under both names. */
struct pair {
	uint16_t from; /* in struct legacy_axis_settings */
	uint8_t size;
	bool left;   /* while it is 0 the device's stays */
	uint16_t to; /* in struct value_axis_settings */
};

#define PAIR_(from_, to_, left_) {							\
	offsetof(struct legacy_axis_settings, from_),					\
	sizeof(((struct legacy_axis_settings *)0)->from_), left_,			\
	offsetof(struct value_axis_settings, to_) }
#define PAIR(from_, to_)	PAIR_(from_, to_, false)
#define LEFT(from_, to_)	PAIR_(from_, to_, true)

static const struct pair pairs[] = {
	LEFT(enabled, enable),
	PAIR(inverted, invert),
	PAIR(home_inverted, home_invert),
	PAIR(soft_limits, soft_limits),
	PAIR(masked, masked),
	PAIR(limit_minus, limit_neg),
	PAIR(limit_plus, limit_pos),
	PAIR(home_switch, home),
	PAIR(home_on_minus, home_on_limit_neg),
	PAIR(home_on_plus, home_on_limit_pos),
	PAIR(limit_minus_invert, limit_neg_invert),
	PAIR(limit_plus_invert, limit_pos_invert),
	PAIR(home_invert, home_switch_invert),
	PAIR(limit_minus_pin, limit_neg_pin),
	PAIR(limit_plus_pin, limit_pos_pin),
	PAIR(home_pin, home_pin),
	LEFT(enable_pin, enable_pin),
	LEFT(enable_invert, enable_invert),
	LEFT(limit_minus_filter, limit_neg_filter),
	LEFT(limit_plus_filter, limit_pos_filter),
	LEFT(home_filter, home_filter),
	LEFT(probe_filter, probe_filter),
	PAIR(homing_speed, homing_speed),
	PAIR(homing_return, homing_return_speed),
	LEFT(mpg_encoder, mpg_encoder),
	LEFT(mpg_multiplier, mpg_multiplier),
	LEFT(mpg_divider, mpg_divider),
};

_Static_assert(sizeof(pairs) / sizeof(pairs[0]) <= 32, "a bit each in legacy_settings.zeroed");

/* What somebody said; an AxisEnabled below 0 is what nobody has. */
static bool meant(const struct pair *pair, int32_t value)
{
	return value > 0 || (value < 0 && pair != &pairs[0]);
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
		set->enabled = set->enabled == UNSAID ? 1 : set->enabled;
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
static uint32_t byte_of(const struct legacy_axis_settings *before, const struct legacy_bits *bits,
			uint32_t was, uint32_t byte)
{
	return byte == was && legacy_build(before, bits) ? 0 : byte;
}

static void derive(struct legacy_axis_settings *set, const struct legacy_axis_settings *before,
		   double scale)
{
	derive_speeds(set, scale);
	derive_switches(set);
	set->options = legacy_settle(set, &legacy_options,
				     byte_of(before, &legacy_options, before->options,
					     set->options));
	set->switches = legacy_settle(set, &legacy_switches,
				      byte_of(before, &legacy_switches, before->switches,
					      set->switches));
	set->homing = legacy_settle(set, &legacy_homing,
				    byte_of(before, &legacy_homing, before->homing, set->homing));
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
			legacy_store(set, pairs[i].from, pairs[i].size, value);
	}
	if (device->mode != UNKNOWN) {
		set->planner = device->mode != POKEYS_AXIS_BUFFERED;
		set->position_mode = device->mode == POKEYS_AXIS_POSITION;
	}
	if (device->homing_on_switch >= 0 && device->homing_off_switch >= 0)
		set->homing = (uint32_t)(device->homing_on_switch | device->homing_off_switch << 4);
	memset((void *)set->on_home, 0, sizeof(set->on_home));
	memset((void *)set->off_home, 0, sizeof(set->off_home));
	legacy_settle(set, &legacy_homing, set->homing);
	set->options = legacy_settle(set, &legacy_options, 0);
	set->switches = legacy_settle(set, &legacy_switches, 0);
	set->max_speed = isfinite(device->max_velocity) ? device->max_velocity * fabs(scale) : 0;
	set->max_acceleration = isfinite(device->max_acceleration) ?
					device->max_acceleration * fabs(scale) :
					0;
	set->max_deceleration = isfinite(device->max_deceleration) ?
					device->max_deceleration * fabs(scale) :
					0;
	set->soft_minimum = (uint32_t)whole(isfinite(device->soft_min) ? device->soft_min * scale :
									 0);
	set->soft_maximum = (uint32_t)whole(isfinite(device->soft_max) ? device->soft_max * scale :
									 0);
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

/* What has been set to 0 in place of something else: bit = pair. */
static uint32_t zeroed(uint32_t before_that, const struct legacy_axis_settings *before,
		       const struct legacy_axis_settings *now, bool counts)
{
	for (size_t i = 0; i < sizeof(pairs) / sizeof(pairs[0]); i++) {
		if (legacy_load(now, pairs[i].from, pairs[i].size))
			before_that &= ~(UINT32_C(1) << i);
		else if (counts &&
			 meant(&pairs[i], legacy_load(before, pairs[i].from, pairs[i].size)))
			before_that |= UINT32_C(1) << i;
	}
	return before_that;
}

/* `fastest`: what the generator makes, pulses/s; 0 = not known. INI files have more. */
static void put(struct value_axis_settings *to, const struct legacy_axis_settings *set,
		double scale, uint32_t zeros, double fastest)
{
	const bool beyond = fastest > 0 && set->max_speed > fastest;

	for (size_t i = 0; i < sizeof(pairs) / sizeof(pairs[0]); i++) {
		int32_t value = legacy_load(set, pairs[i].from, pairs[i].size);

		if (meant(&pairs[i], value) || !pairs[i].left || zeros >> i & 1)
			legacy_put((void *)((unsigned char *)to + pairs[i].to), value);
	}
	legacy_put(&to->mode, mode_of(set));
	legacy_put(&to->homing_on_switch, nibble(set->homing));
	legacy_put(&to->homing_off_switch, nibble(set->homing >> 4));
	if (set->max_speed != 0)
		put_real(&to->max_velocity, (beyond ? fastest : set->max_speed) / fabs(scale));
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
 * The terminals of its switches become inputs, that of its enable output an output.
 * False as long as it is not known what they are.
 */
static bool make_terminals(struct values *values, const struct legacy_axis_settings *set)
{
	if (values->set.pin_function[0] == UNKNOWN)
		return false;
	legacy_make_input(values, set->limit_minus_pin);
	legacy_make_input(values, set->limit_plus_pin);
	legacy_make_input(values, set->home_pin);
	legacy_make_output(values, set->enable_pin);
	return true;
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
	const double fastest = values->legacy.engine.khz * 1e3;
	double scale = values->joint[i].scale;
	bool used, anew;

	if (!isfinite(scale) || scale == 0)
		scale = 1;
	legacy_group_begin(group, live, &now, &own->axis[i], sizeof(now));
	own->zeroed[i] = zeroed(own->zeroed[i], &before, &now, own->apply && own->applied);
	if (!group->touched)
		show(&now, &values->set.axis[i], scale);
	else if (own->apply)
		derive(&now, &before, scale);
	if (now.enabled == UNSAID && values->set.axis[i].enable == 1)
		now.enabled = 1;
	legacy_group_end(live, &now, &own->axis[i], sizeof(now));
	used = now.enabled > 0 || own->zeroed[i] & USED;
	anew = !group->put || scale != own->scale[i] || fastest != own->fastest;
	if (own->apply && group->touched && used && anew) {
		put(&values->set.axis[i], &now, scale, own->zeroed[i], fastest);
		own->terminals[i] = false;
	}
	if (own->apply && group->touched && used && !own->terminals[i])
		own->terminals[i] = make_terminals(values, &now);
	if (driven && now.enabled > 0)
		follow_positions(&values->set.axis[i]);
	group->put = own->apply && used;
	own->scale[i] = scale;
}
