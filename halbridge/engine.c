/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The pulse engine's state on pins.
 *
 * What the device reports is shown as it is, in effect, beside the settings
 * that were wanted (values_settings.h): the two differ while a setting waits
 * for the machine to be off. Only two things are given a meaning: emergency,
 * which HAL wants in both polarities to build its chain, and the slot's time.
 */
#include "halbridge/engine.h"
#include "halbridge/bits.h"

enum { SLOT_US = 100 }; /* the unit the device reports a slot's time in */

void engine_read(struct values *values, const struct pokeys_engine *engine)
{
	struct value_engine *value = &values->engine;

	value->state = engine->state;
	value->axes_enabled = engine->axes_enabled;
	value->charge_pump = engine->charge_pump;
	value->generator = engine->generator;
	value->power_states = engine->power_states;
	value->probe_status = engine->probe_status;
	value->buffer_slots = engine->buffer_slots;
	value->buffer_level = engine->buffer_level;
	value->buffer_underruns = engine->buffer_underruns;
	value->buffer_resyncs = engine->buffer_resyncs;
	value->slot_us = (uint32_t)engine->slot_time * SLOT_US;
	value->emergency = engine->emergency;
	value->emergency_not = !engine->emergency;
	value->activated = engine->activated;
	value->limit_override_active = engine->limit_override;
	bits_to_bools(value->misc_in, &engine->misc_inputs, NULL, 1);
	bools_invert(value->misc_in_not, value->misc_in, 1);
	values_changed(values, BLOCK_ENGINE);
}
