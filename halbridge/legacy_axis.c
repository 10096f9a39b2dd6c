/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * An axis under its older names.
 *
 * Switches: with a pin of its own the device evaluates a switch only while the
 * axis is initialised; while it stands in state 0 the pin's input is looked at
 * here. Without a pin it is the dedicated input. Either way `in` is true when
 * the switch is tripped, for both directions and both polarities. The old
 * component turned some of them around, and nets of its time may count on it:
 * legacy.old-switches does so again.
 *
 * Who may move: the old component moved an axis as soon as the machine was on,
 * whatever its AxisEnable pin said, although every machine wires that. So does
 * this, unless legacy.axis-enable-follows is set. While the machine is off no
 * axis is enabled, so that scale and offset, which a HAL file sets beside
 * AxisEnabled, are taken over then (joint.c). An axis whose joint-pos-cmd
 * is connected to nothing is none of this scheme's.
 */
#include "halbridge/legacy.h"
#include <math.h>
#include "halbridge/exchange.h"

struct switch_of {
	bool status, dedicated; /* the device's word, and its dedicated input */
	uint32_t pin;           /* from 1; 0 = dedicated input */
	bool enabled, invert;
	bool turned; /* true while not tripped: what the old component said */
};

/* Tripped or not, to *in; unchanged where there is no such switch. */
static void read_switch(const struct pokeys_state *state, const struct pokeys_axis *axis,
			struct switch_of what, bool *in, bool *in_not)
{
	unsigned int pin = what.pin - 1;

	if (what.pin > POKEYS_PINS || (!what.pin && !what.enabled))
		return;
	if (!what.pin)
		*in = what.dedicated != what.invert;
	else if (axis->state)
		*in = what.status != what.turned;
	else
		*in = (state->digital_in[pin / 8] >> pin % 8 & 1) != what.invert;
	*in_not = !*in;
}

static void read_switches(const struct pokeys_state *state, unsigned int i, struct values *values)
{
	const struct legacy_axis_settings *set = &values->legacy.axis_set[i];
	struct legacy_axis *value = &values->legacy.axis[i];
	const struct pokeys_engine *engine = &state->engine;
	const struct pokeys_axis *axis = &engine->axis[i];
	const bool before = values->legacy.choice.old_switches;

	read_switch(state, axis,
		    (struct switch_of){ .status = engine->limit_minus >> i & 1,
					.dedicated = engine->dedicated_limit_minus >> i & 1,
					.pin = set->limit_minus_pin,
					.enabled = set->limit_minus,
					.invert = set->limit_minus_invert,
					.turned = before },
		    &value->limit_minus, &value->limit_minus_not);
	read_switch(state, axis,
		    (struct switch_of){ .status = engine->limit_plus >> i & 1,
					.dedicated = engine->dedicated_limit_plus >> i & 1,
					.pin = set->limit_plus_pin,
					.enabled = set->limit_plus,
					.invert = set->limit_plus_invert,
					.turned = before && !set->limit_plus_invert },
		    &value->limit_plus, &value->limit_plus_not);
	read_switch(state, axis,
		    (struct switch_of){ .status = engine->home >> i & 1,
					.dedicated = engine->dedicated_home >> i & 1,
					.pin = set->home_pin,
					.enabled = set->home_switch,
					.invert = set->home_invert,
					.turned = before && set->home_invert },
		    &value->home, &value->home_not);
}

static uint32_t magnitude(double pulses)
{
	return (uint32_t)(fabs(pulses) <= UINT32_MAX ? fabs(pulses) : UINT32_MAX);
}

static void read_references(const struct pokeys_axis *axis,
			    const struct pokeys_axis_command *command, struct legacy_axis *value)
{
	value->position = axis->position;
	value->reference = (uint32_t)axis->reference;
	value->reference_position = (uint32_t)command->position;
	value->reference_speed = magnitude((double)command->velocity);
	value->shown_speed = (double)command->velocity;
	value->shown_position = command->position;
	value->shown_reference = axis->reference;
}

static void read_mode(uint8_t *before, const struct pokeys_axis *axis,
		      const struct legacy_home *home, struct legacy_axis *value)
{
	value->homing = home->phase != LEGACY_PHASE_IDLE || (axis->state >= 8 && axis->state <= 13);
	value->step = value->homing ? 4 : axis->mode;
	value->position_mode_active = axis->mode == POKEYS_AXIS_POSITION;
	value->moves = axis->enabled;
	value->in_position = axis->in_position;
	value->velocity_moves += axis->mode != *before && axis->mode == POKEYS_AXIS_VELOCITY;
	value->position_moves += axis->mode != *before && axis->mode == POKEYS_AXIS_POSITION;
	*before = axis->mode;
}

static void read_axis(struct exchange *exchange, struct values *values, unsigned int i)
{
	const struct pokeys_state *state = exchange->state;
	const struct pokeys_axis *axis = &state->engine.axis[i];
	const struct legacy_home *home = &exchange->legacy.home[i];
	struct legacy_axis *value = &values->legacy.axis[i];

	value->state = legacy_home_state(home, axis);
	value->homing_status = legacy_home_status(home);
	value->backlash_register = (uint32_t)(int32_t)state->backlash[i];
	value->position_mode = exchange->command.axis[i].mode == POKEYS_AXIS_POSITION;
	value->error = axis->error;
	value->error_not = !axis->error;
	value->probe = axis->state == 14;
	value->probe_not = !value->probe;
	value->soft_limit = axis->soft_limit;
	value->probe_position = (uint32_t)axis->probe;
	value->override = state->engine.limit_override;
	read_references(axis, &exchange->command.axis[i], value);
	read_mode(&exchange->legacy.mode[i], axis, home, value);
	read_switches(state, i, values);
}

void legacy_read_axes(struct exchange *exchange, struct values *values)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		read_axis(exchange, values, i);
}

/* Where the older names have the zero of an axis, and which way it counts. */
static void set_frame(struct joint *joint, const struct values *values, unsigned int i)
{
	const struct legacy_axis_settings *set = &values->legacy.axis_set[i];

	joint->frame = (struct joint_frame){
		.offset = set->offset,
		.turned = set->minimum > set->maximum,
		.whole = values->legacy.choice.whole_scale,
	};
}

void legacy_enable(struct exchange *exchange, const struct values *values)
{
	const struct legacy *own = &exchange->legacy;

	for (unsigned int i = 0; own->on && i < POKEYS_AXES; i++) {
		const struct legacy_axis *value = &values->legacy.axis[i];
		bool follows = values->legacy.choice.axis_enable;

		exchange->joint[i].enable = own->linked[i] && values->machine_is_on &&
					    values->legacy.axis_set[i].enabled > 0 &&
					    (!follows || value->axis_enable || value->axis_enabled);
		if (own->linked[i])
			set_frame(&exchange->joint[i], values, i);
	}
}
