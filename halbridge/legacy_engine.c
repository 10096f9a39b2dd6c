/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The pulse engine under its older names: emergency, masks, presets.
 *
 * Emergency.in is what machines wire to LinuxCNC's emergency chain, so it says
 * "emergency" when in doubt: without fresh data, after the loss of positions until the
 * machine is off, and without any pin set up, which choices can turn off. Until March
 * 2025 it said the contrary, that the engine is in no emergency, and machines wire that to
 * iocontrol.0.emc-enable-in; a choice again, and then what is in doubt is false.
 *
 * The old component asked the engine for "stopped" as long as the machine was
 * off, and that is how a machine gets out of a limit or emergency stop: off
 * and on again. So while the machine is off a fault is cleared, once a second
 * and only if the scheme drives an axis.
 *
 * Start masks and presets are events in the shape of a value: they are acted
 * upon when they change, and a mask is set back to 0.
 */
#include "halbridge/legacy.h"
#include "halbridge/exchange.h"

#define CLEAR_NS	UINT64_C(1000000000)
#define PROBE_PIN_BASE	8	/* pin 1 is 9 on the wire, protocol section 3.24.1 */

enum { STOP_LIMIT = 100, STOP_EMERGENCY = 101, PROBE_COMPLETE = 30, PIN_BASE = 10 };

enum emergency_step {
	STEP_ENGINE = 8,
	STEP_PIN = 9,
	STEP_REST = 10,
	STEP_LOST = 11,
	STEP_NONE = 12
};

static uint32_t emergency_pin(const struct pokeys_engine *engine, const struct values *values)
{
	uint32_t pin = values->legacy.engine_set.emergency_pin;

	if (!pin && engine->emergency_pin > PIN_BASE)
		pin = engine->emergency_pin - PIN_BASE;
	return pin <= POKEYS_PINS ? pin : 0;
}

static enum emergency_step emergency_step(const struct pokeys_state *state,
					  const struct values *values)
{
	const struct pokeys_engine *engine = &state->engine;
	uint32_t pin = emergency_pin(engine, values);
	bool invert = values->legacy.engine_set.emergency_invert != 0;

	if (engine->state == STOP_EMERGENCY)
		return STEP_ENGINE;
	if (pin && (state->digital_in[(pin - 1) / 8] >> (pin - 1) % 8 & 1) != invert)
		return STEP_PIN;
	if (pin)
		return STEP_REST;
	if (engine->emergency_pin)
		return engine->emergency ? STEP_PIN : STEP_REST;
	return STEP_NONE;
}

static void read_emergency(const struct pokeys_state *state, struct values *values, bool fresh)
{
	struct legacy_engine *engine = &values->legacy.engine;
	enum emergency_step step = STEP_LOST;

	if (fresh)
		step = emergency_step(state, values);
	else if (!values->legacy.choice.emergency_lost)
		return;
	engine->emergency_step = (int32_t)step;
	engine->emergency = step == STEP_NONE ? values->legacy.choice.emergency_unset :
						step != STEP_REST;
	if (values->legacy.choice.old_emergency)
		engine->emergency = fresh && !state->engine.emergency;
	engine->emergency_not = !engine->emergency;
}

static void read_masks(struct legacy *own, struct values *values, const struct pokeys_state *state)
{
	struct legacy_engine *engine = &values->legacy.engine;
	uint32_t enabled = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		enabled |= (uint32_t)(state->engine.axis[i].enabled != 0) << i;
	engine->enabled_mask = enabled;
	engine->override = state->engine.limit_override;
	/* what somebody has set stays until the device has it (legacy_settings.c) */
	if (engine->power_mask == own->power_shown)
		engine->power_mask = state->engine.power_states;
	own->power_shown = state->engine.power_states;
}

void legacy_read_engine(struct exchange *exchange, struct values *values, bool fresh)
{
	const struct pokeys_engine *from = &exchange->state->engine;
	struct legacy_engine *engine = &values->legacy.engine;

	read_emergency(exchange->state, values, fresh && !exchange->positions.alarm);
	engine->wanted_state = values->machine_is_on ? 3 : 0;
	if (!fresh)
		return;
	engine->axes = exchange->state->capability.axes;
	engine->khz = exchange->state->capability.axis_khz;
	engine->slots = from->buffer_slots;
	engine->slot_time = from->slot_time;
	engine->activated = from->activated;
	engine->misc = from->misc_inputs;
	engine->relays = from->relays;
	engine->outputs = from->outputs;
	engine->probe_status = from->probe_status;
	engine->probed = from->state == PROBE_COMPLETE;
	read_masks(&exchange->legacy, values, exchange->state);
}

static bool queued(struct exchange *exchange, const struct pokeys_one_shot *shot)
{
	uint32_t id;

	return legacy_ask(exchange, shot, &id);
}

static void start_homing(struct exchange *exchange, struct values *values)
{
	struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_HOME,
					.mask = (uint8_t)values->legacy.engine.home_mask };

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		shot.value[i] = (int32_t)values->legacy.axis_set[i].home_offsets;
	if (values->legacy.engine.home_mask && queued(exchange, &shot))
		values->legacy.engine.home_mask = 0;
}

static void start_probing(struct exchange *exchange, struct values *values)
{
	const struct legacy_engine_settings *set = &values->legacy.engine_set;
	double speed = values->legacy.engine.probe_speed;
	struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_PROBE,
		.mask = (uint8_t)values->legacy.engine.probe_mask,
		.flags = set->probe_invert != 0,
		.parameter = { [1] = speed > 0 && speed <= 1 ? (float)speed : 0 },
	};

	/* without an input, or without speed, the daemon refuses it */
	if (set->probe_pin && set->probe_pin <= POKEYS_PINS)
		shot.index = (uint8_t)(set->probe_pin + PROBE_PIN_BASE);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		shot.value[i] = (int32_t)values->legacy.axis[i].probe_max;
	if (values->legacy.engine.probe_mask && queued(exchange, &shot))
		values->legacy.engine.probe_mask = 0;
}

static void preset(struct exchange *exchange, const struct values *values)
{
	struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_SET_POSITION };

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		shot.value[i] = values->legacy.axis[i].preset;
		if (shot.value[i] != exchange->legacy.preset[i])
			shot.mask |= (uint8_t)(1u << i);
	}
	if (!shot.mask || !queued(exchange, &shot))
		return;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		exchange->legacy.preset[i] = shot.value[i];
}

static void clear_fault(struct exchange *exchange, const struct values *values, uint64_t now_ns)
{
	static const struct pokeys_one_shot clear = { .operation = POKEYS_ONE_SHOT_CLEAR_FAULT };
	struct legacy *own = &exchange->legacy;
	const uint8_t state = exchange->state->engine.state;
	bool drives = false;
	uint32_t id;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		drives |= own->linked[i];
	if (!drives || values->machine_is_on || now_ns < own->clear_ns ||
	    (state != STOP_LIMIT && state != STOP_EMERGENCY))
		return;
	/* nobody has asked for it, so it is not counted, and it comes again */
	if (one_shot_push(&exchange->queue, &exchange->command, &clear, &id) == ONE_SHOT_QUEUED)
		own->clear_ns = now_ns + CLEAR_NS;
}

/*
 * What is asked for while the device is away is not done when it is back: by then
 * it is not what the person wanted. It is counted (as in press.c).
 */
static void forget(struct exchange *exchange, struct values *values)
{
	bool preset = false;

	values->one_shot_failed_count += values->legacy.engine.home_mask != 0;
	values->one_shot_failed_count += values->legacy.engine.probe_mask != 0;
	values->legacy.engine.home_mask = 0;
	values->legacy.engine.probe_mask = 0;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		preset |= exchange->legacy.preset[i] != values->legacy.axis[i].preset;
		exchange->legacy.preset[i] = values->legacy.axis[i].preset;
	}
	values->one_shot_failed_count += preset;
}

void legacy_write_engine(struct exchange *exchange, struct values *values, uint64_t now_ns)
{
	struct legacy_engine *engine = &values->legacy.engine;

	if (values->legacy.choice.limit_override && engine->override_wanted)
		exchange->command.flags |= POKEYS_COMMAND_LIMIT_OVERRIDE;
	legacy_home_write(exchange, values);
	if (!exchange->fresh) {
		forget(exchange, values);
		return;
	}
	start_homing(exchange, values);
	start_probing(exchange, values);
	preset(exchange, values);
	clear_fault(exchange, values, now_ns);
}
