/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Settings of the device under their older names.
 *
 * They are handed on to the canonical parameters of the same settings, which
 * check them, ask the daemon for what differs and show what the device has: a
 * second way to the device would be a second truth. Here it is decided only
 * whose word counts.
 *
 * The old component had a switch for that, params.ApplyIniSettings: true, the
 * parameters go to the device; false, they show what it has. It pushed all of
 * them, those nobody had set as zeros. Here a group (an axis, an encoder, a
 * pin, the engine) is pushed as a whole when somebody has set one of its
 * parameters, because a bit that was set to false cannot be told from one that
 * nobody set; a group nobody has touched shows the device's settings.
 *
 * Some parameters let the device keep what it has while they are 0, as they did
 * (legacy_settings_axis.c): the charge pump, an encoder's, many of an axis.
 *
 * A bit that stands in a byte as well (AxesConfig, encoderOptions ...) has the
 * say, and the byte shows it; the byte is taken only while all its bits are
 * false.
 */
#include "halbridge/legacy_settings.h"
#include <math.h>
#include <string.h>

enum {
	FUNCTION_INPUT = 2,
	FUNCTION_OUTPUT = 4,
	FUNCTION_INVERT = 128,
	UNKNOWN = -1,
	BOARD_57CNC = 32,
	BOARD_57CNC_PRO = 33,
	PIN_BASE = 10
};

void legacy_group_begin(struct legacy_group *group, const volatile void *live, void *now,
			const void *before, size_t size)
{
	const volatile unsigned char *from = live;

	for (size_t i = 0; i < size; i++)
		((unsigned char *)now)[i] = from[i];
	if (memcmp(now, before, size)) {
		group->touched = true;
		group->put = false;
	}
	memcpy((void *)before, now, size);
}

void legacy_group_end(volatile void *live, const void *now, void *before, size_t size)
{
	const unsigned char *from = now, *was = before;

	for (size_t i = 0; i < size; i++) {
		if (from[i] != was[i])
			((volatile unsigned char *)live)[i] = from[i];
	}
	memcpy(before, now, size);
}

/* The board has external outputs, whatever somebody says. */
static bool extended(const struct values *values, bool wanted)
{
	uint32_t board = values->info.type_id;

	return board == BOARD_57CNC || board == BOARD_57CNC_PRO || (!board && wanted);
}

static void show_engine(const struct value_engine_settings *set, struct legacy_engine_settings *now)
{
	if (set->generator == UNKNOWN || set->emergency_pin == UNKNOWN)
		return;
	now->generator = (uint32_t)(set->generator | (set->swap_step_dir == 1) << 6 |
				    (set->extended_io == 1) << 7);
	now->swap = set->swap_step_dir == 1;
	now->charge_pump = (uint32_t)set->charge_pump;
	now->emergency_invert = (uint32_t)set->emergency_invert;
	now->emergency_pin =
		(uint32_t)(set->emergency_pin > PIN_BASE ? set->emergency_pin - PIN_BASE : 0);
}

static void make(struct values *values, uint32_t terminal, int32_t function)
{
	if (!terminal || terminal > POKEYS_PINS)
		return;
	if (!(values->set.pin_function[terminal - 1] & function))
		legacy_put(&values->set.pin_function[terminal - 1], function);
}

void legacy_make_input(struct values *values, uint32_t terminal)
{
	make(values, terminal, FUNCTION_INPUT);
}

void legacy_make_output(struct values *values, uint32_t terminal)
{
	make(values, terminal, FUNCTION_OUTPUT);
}

static void put_engine(struct values *values, const struct legacy_engine_settings *now,
		       bool pump_off)
{
	struct value_engine_settings *set = &values->set.engine;

	legacy_put(&set->generator, (int32_t)(now->generator & 0x0f));
	legacy_put(&set->swap_step_dir, now->swap);
	legacy_put(&set->extended_io, now->extended);
	if (now->charge_pump || pump_off)
		legacy_put(&set->charge_pump, (int32_t)now->charge_pump);
	legacy_put(&set->emergency_invert, (int32_t)now->emergency_invert);
	if (now->emergency_pin)
		legacy_put(&set->emergency_pin, (int32_t)now->emergency_pin + PIN_BASE);
	if (now->emergency_out_pin && now->emergency_out_pin <= POKEYS_PINS)
		legacy_put(&values->set.pin_function[now->emergency_out_pin - 1], FUNCTION_OUTPUT);
	legacy_make_input(values, now->emergency_pin);
	legacy_make_input(values, now->probe_pin);
}

/*
 * The old component enabled all axes of the device, whatever somebody said, as
 * soon as it set anything up. How many there are is known once the device is.
 */
static void enable_all_axes(struct legacy_settings *own, struct values *values)
{
	uint32_t axes = values->legacy.engine.axes;
	bool touched = own->engine_group.touched;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		touched |= own->axis_group[i].touched;
	if (!own->apply || !touched || !axes || own->axes == axes)
		return;
	legacy_put(&values->set.engine.axes, (int32_t)axes);
	own->axes = axes;
}

static void look_at_engine(struct legacy_settings *own, struct values *values)
{
	struct legacy_engine_settings now;
	struct legacy_group *group = &own->engine_group;
	const uint32_t pump = own->engine.charge_pump;
	bool known = values->set.pin_function[0] != UNKNOWN;

	legacy_group_begin(group, &values->legacy.engine_set, &now, &own->engine, sizeof(now));
	own->pump_off = !now.charge_pump && (own->pump_off || (pump && own->apply && own->applied));
	if (!group->touched)
		show_engine(&values->set.engine, &now);
	now.extended = extended(values, now.extended);
	now.swap = now.swap || now.generator & 0x40;
	now.axes = values->legacy.engine.axes ? values->legacy.engine.axes : now.axes;
	enable_all_axes(own, values);
	legacy_group_end(&values->legacy.engine_set, &now, &own->engine, sizeof(now));
	if (own->apply && group->touched && !group->put && known)
		put_engine(values, &now, own->pump_off);
	group->put = own->apply && known;
}

/* AxisEnabledStatesMask is a pin: what is in it and is not what the device has was set. */
static void look_at_power(struct legacy_settings *own, struct values *values)
{
	uint32_t wanted = values->legacy.engine.power_mask;

	if (wanted != own->power && own->begun && own->apply && wanted <= UINT8_MAX)
		legacy_put(&values->set.engine.power_states, (int32_t)wanted);
	own->power = wanted;
}

static void put_play(uint32_t wanted, uint32_t *seen, bool anew, param_float *to, double unit)
{
	if (wanted == *seen && !(anew && wanted))
		return;
	*to = wanted ? wanted * unit : (double)NAN;
	*seen = wanted;
}

/* Pins likewise. What nobody sets there is the device's, and 0 gives it back to it. */
static void look_at_backlash(struct legacy_settings *own, struct values *values)
{
	uint32_t wanted = values->legacy.engine.backlash;

	if (!own->apply)
		return;
	if (wanted != own->backlash)
		values->set.backlash = wanted ? 1 : UNKNOWN;
	own->backlash = wanted;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct value_axis_settings *set = &values->set.axis[i];
		const struct legacy_axis *axis = &values->legacy.axis[i];
		double scale = fabs(values->joint[i].scale);
		bool anew;

		if (!isfinite(scale) || scale == 0)
			continue;
		anew = own->backlash_scale[i] != scale;
		put_play(axis->backlash_width, &own->backlash_width[i], anew, &set->backlash_width,
			 2 / scale);
		put_play(axis->backlash_acceleration, &own->backlash_acceleration[i], anew,
			 &set->backlash_acceleration, 1e6 / scale);
		own->backlash_scale[i] = scale;
	}
}

/* Function 0 is "as the device has it". */
static int32_t function_of(const struct values *values, unsigned int i, uint32_t function,
			   bool invert)
{
	int32_t device = values->set.pin_function[i];

	if (function)
		return (int32_t)(function | (invert ? FUNCTION_INVERT : 0));
	if (device == UNKNOWN)
		return UNKNOWN;
	return invert ? device | FUNCTION_INVERT : device & ~FUNCTION_INVERT;
}

static void look_at_pin(struct legacy_settings *own, struct values *values, unsigned int i)
{
	struct legacy_pin_settings *live = &values->legacy.pin_set, *before = &own->pin;
	struct legacy_group *group = &own->pin_group[i];
	int32_t device = values->set.pin_function[i], function;
	bool invert = live->in_invert[i] || live->out_invert[i];

	if (live->function[i] != before->function[i] ||
	    live->in_invert[i] != before->in_invert[i] ||
	    live->out_invert[i] != before->out_invert[i])
		*group = (struct legacy_group){ .touched = true };
	if (!group->touched && device >= 0) {
		live->function[i] = (uint32_t)device;
		live->in_invert[i] = device & FUNCTION_INVERT && device & FUNCTION_INPUT;
		live->out_invert[i] = device & FUNCTION_INVERT && device & FUNCTION_OUTPUT;
	}
	before->function[i] = live->function[i];
	before->in_invert[i] = live->in_invert[i];
	before->out_invert[i] = live->out_invert[i];
	function = function_of(values, i, before->function[i], invert);
	if (own->apply && group->touched && !group->put && function != UNKNOWN)
		legacy_put(&values->set.pin_function[i], function);
	group->put = own->apply && function != UNKNOWN;
}

/* What everything begins with, so that what was set before the first look counts as set. */
static void begin(struct legacy_settings *own)
{
	memset(own, 0, sizeof(*own));
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		own->axis[i].enabled = UNKNOWN;
	own->begun = true;
}

void legacy_settings_look(struct legacy_settings *own, struct values *values,
			  const bool driven[POKEYS_AXES])
{
	if (!own->begun)
		begin(own);
	own->apply = values->legacy.engine.apply;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		legacy_settings_axis(own, values, i, driven[i]);
	legacy_settings_encoders(own, values);
	look_at_engine(own, values);
	look_at_power(own, values);
	look_at_backlash(own, values);
	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		look_at_pin(own, values, i);
	own->applied = own->apply;
	own->fastest = values->legacy.engine.khz * 1e3;
}
