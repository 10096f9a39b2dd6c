/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pulse engine: what is read, what is wanted, what is written (protocol
 * sections 3.24.1 to 3.24.3).
 *
 * The engine's setup cannot be read as such; the status has its fields. The
 * generator and the power states in it are those in effect, and they change
 * only when the engine is rebooted (0x85/05): so a write that differs in them
 * is followed by a reboot, and the status that comes back is the judge.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define ENGINE_SETUP (POKEYS_SET_AXES | POKEYS_SET_CHARGE_PUMP | POKEYS_SET_GENERATOR | \
		      POKEYS_SET_EMERGENCY_INVERT | POKEYS_SET_POWER_STATES)

/* 0x85/00 and 01. */

static bool engine_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & ENGINE_SETUP;
}

static uint8_t pick(const struct pokeys_settings *want, uint32_t bit, uint8_t wanted, uint8_t have)
{
	return want->set & bit ? wanted : have;
}

static uint64_t engine_merge(const struct pokeys_settings *want, unsigned int index,
			     const union setting_value *value, union setting_request *request)
{
	const struct wire_pulse_status_rep *have = &value->engine;
	struct wire_pulse_setup_req *setup = &request->setup;

	(void)index;
	memset(request, 0, sizeof(*request));
	setup->axes = pick(want, POKEYS_SET_AXES, want->axes, have->axes_enabled);
	setup->charge_pump = pick(want, POKEYS_SET_CHARGE_PUMP, want->charge_pump,
				  have->charge_pump);
	setup->generator = pick(want, POKEYS_SET_GENERATOR, want->generator, have->generator);
	setup->emergency_invert = pick(want, POKEYS_SET_EMERGENCY_INVERT, want->emergency_invert,
				       have->emergency_invert);
	setup->power_states = pick(want, POKEYS_SET_POWER_STATES, want->power_states,
				   have->power_states);
	return setup->axes != have->axes_enabled || setup->charge_pump != have->charge_pump ||
	       setup->generator != have->generator ||
	       setup->emergency_invert != have->emergency_invert ||
	       setup->power_states != have->power_states;
}

static bool engine_needs_effect(const union setting_value *value,
				const union setting_request *request)
{
	return request->setup.generator != value->engine.generator ||
	       request->setup.power_states != value->engine.power_states;
}

static void engine_learn(struct device *device, unsigned int index,
			 const union setting_value *value)
{
	const uint8_t supported = value->engine.axes_supported;

	(void)index;
	device->image.capability.axes = supported < POKEYS_AXES ? supported : POKEYS_AXES;
	device->image.capability.axis_khz = value->engine.max_khz;
	device->image.engine.axes_enabled = value->engine.axes_enabled;
	device->image.engine.emergency_invert = value->engine.emergency_invert;
	if (!running(device))
		device->image.engine.state = value->engine.engine_state;
}

static void engine_report(struct pokeys_settings *known, unsigned int index,
			  const union setting_value *value)
{
	(void)index;
	known->set |= ENGINE_SETUP;
	known->axes = value->engine.axes_enabled;
	known->charge_pump = value->engine.charge_pump;
	known->generator = value->engine.generator;
	known->emergency_invert = value->engine.emergency_invert;
	known->power_states = value->engine.power_states;
}

static int64_t engine_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->engine.axes_enabled;
}

/* Whether it stands, how fast an axis is and in which mode, must be known before anything moves. */
const struct setting_kind setting_engine = {
	.read = WIRE_OP_PULSE_STATUS,
	.write = WIRE_OP_PULSE_SETUP,
	.name = POKEYS_SETTING_ENGINE,
	.vital = true,
	.has = setting_has_engine,
	.wanted = engine_wanted,
	.ask = setting_ask_zeros,
	.merge = engine_merge,
	.learn = engine_learn,
	.report = engine_report,
	.written = engine_written,
	.needs_effect = engine_needs_effect,
	.effect = setting_reboot,
};

/* Emergency pin, 0x85/06. */

static bool emergency_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_EMERGENCY_PIN;
}

static uint64_t emergency_merge(const struct pokeys_settings *want, unsigned int index,
				const union setting_value *value, union setting_request *request)
{
	memset(request, 0, sizeof(*request));
	request->emergency.write = 1;
	request->emergency.pin = want->emergency_pin;
	return emergency_wanted(want, index) && value->emergency.pin != want->emergency_pin;
}

static void emergency_learn(struct device *device, unsigned int index,
			    const union setting_value *value)
{
	(void)index;
	device->image.engine.emergency_pin = value->emergency.pin;
}

static void emergency_report(struct pokeys_settings *known, unsigned int index,
			     const union setting_value *value)
{
	(void)index;
	known->set |= POKEYS_SET_EMERGENCY_PIN;
	known->emergency_pin = value->emergency.pin;
}

static int64_t emergency_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->emergency.pin;
}

const struct setting_kind setting_emergency = {
	.read = WIRE_OP_PULSE_EMERGENCY,
	.write = WIRE_OP_PULSE_EMERGENCY,
	.name = POKEYS_SETTING_EMERGENCY,
	.has = setting_has_engine,
	.wanted = emergency_wanted,
	.ask = setting_ask_zeros,
	.merge = emergency_merge,
	.learn = emergency_learn,
	.report = emergency_report,
	.written = emergency_written,
};
