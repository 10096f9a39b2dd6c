/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pulse engine and axes: what is read, what is wanted, what is written
 * (protocol sections 3.24.1 to 3.24.4).
 *
 * The engine's setup cannot be read as such; the status has its fields. An
 * axis block is always read, changed and written as a whole: the bytes that
 * the device had, also those that no document names, go back as they came.
 *
 * The device counts in pulses per millisecond, people in pulses per second.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

static bool has_engine(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.pulse_engine >= 2;
}

/*
 * Wanted even when the configuration says nothing: whether the engine stands,
 * how fast an axis is and in which mode, must be known before anything moves.
 */
static bool must_know(const struct device *device, unsigned int index)
{
	(void)device;
	(void)index;
	return true;
}

/* 0x85/00 and 01. */

static void engine_ask(unsigned int index, union setting_request *request)
{
	(void)index;
	memset(request, 0, sizeof(*request));
}

static uint64_t engine_merge(const struct device *device, unsigned int index,
			     const union setting_value *value, union setting_request *request)
{
	const struct wire_pulse_status_rep *status = &value->engine;
	const uint8_t want = device->config.axes ? device->config.axes : status->axes_enabled;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->setup.axes = want;
	request->setup.charge_pump = status->charge_pump;
	request->setup.generator = status->generator;
	request->setup.emergency_invert = status->emergency_invert;
	request->setup.power_states = status->power_states;
	return status->axes_enabled != want;
}

static void engine_learn(struct device *device, unsigned int index,
			 const union setting_value *value)
{
	const uint8_t supported = value->engine.axes_supported;

	(void)index;
	device->image.capability.axes = supported < POKEYS_AXES ? supported : POKEYS_AXES;
	device->image.capability.axis_khz = value->engine.max_khz;
	device->image.engine.axes_enabled = value->engine.axes_enabled;
	device->image.engine.state = value->engine.engine_state;
}

static int64_t engine_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->engine.axes_enabled;
}

const struct setting_kind setting_engine = {
	.read = WIRE_OP_PULSE_STATUS, .write = WIRE_OP_PULSE_SETUP, .has = has_engine,
	.wanted = must_know, .ask = engine_ask, .merge = engine_merge,
	.learn = engine_learn, .written = engine_written,
};

/* Emergency pin, 0x85/06. */

static bool emergency_wanted(const struct device *device, unsigned int index)
{
	(void)index;
	return device->config.emergency_pin >= 0 && device->config.emergency_pin <= POKEYS_PINS;
}

static uint64_t emergency_merge(const struct device *device, unsigned int index,
				const union setting_value *value, union setting_request *request)
{
	const int16_t pin = device->config.emergency_pin;
	const uint8_t want = pin ? (uint8_t)(pin + WIRE_EMERGENCY_PIN_BASE) : 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->emergency.write = 1;
	request->emergency.pin = want;
	return value->emergency.pin != want;
}

static void emergency_learn(struct device *device, unsigned int index,
			    const union setting_value *value)
{
	(void)device;
	(void)index;
	(void)value;
}

static int64_t emergency_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->emergency.pin;
}

const struct setting_kind setting_emergency = {
	.read = WIRE_OP_PULSE_EMERGENCY, .write = WIRE_OP_PULSE_EMERGENCY, .has = has_engine,
	.wanted = emergency_wanted, .ask = engine_ask, .merge = emergency_merge,
	.learn = emergency_learn, .written = emergency_written,
};

/* One axis, 0x85/10 and 11. */

static void axis_ask(unsigned int index, union setting_request *request)
{
	memset(request, 0, sizeof(*request));
	request->axis_get.axis = (uint8_t)index;
}

static bool given(double value)
{
	return isfinite(value) && value > 0;
}

static void merge_speeds(const struct device_axis_config *want, struct wire_axis_config *axis)
{
	if (given(want->max_speed))
		axis->max_speed = (float)(want->max_speed / 1e3);
	if (given(want->max_acceleration)) {
		axis->max_accel = (float)(want->max_acceleration / 1e6);
		axis->max_decel = axis->max_accel;
	}
	if (given(want->max_deceleration))
		axis->max_decel = (float)(want->max_deceleration / 1e6);
}

static void set_option(uint8_t *options, uint8_t option, bool on)
{
	*options = on ? *options | option : *options & (uint8_t)~option;
}

static void merge_options(const struct device_axis_config *want, struct wire_axis_config *axis)
{
	if (want->mode == POKEYS_AXIS_POSITION)
		axis->options |= WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER |
				 WIRE_AXIS_POSITION_MODE;
	if (want->invert >= 0)
		set_option(&axis->options, WIRE_AXIS_INVERTED, want->invert > 0);
	if (want->soft_limits >= 0)
		set_option(&axis->options, WIRE_AXIS_SOFT_LIMITS, want->soft_limits > 0);
	if (want->soft_limits > 0) {
		axis->soft_min = want->soft_minimum;
		axis->soft_max = want->soft_maximum;
	}
}

static uint64_t axis_merge(const struct device *device, unsigned int index,
			   const union setting_value *value, union setting_request *request)
{
	const struct device_axis_config *want = &device->config.axis[index];
	struct wire_axis_config *axis = &request->axis_set.config;

	memset(request, 0, sizeof(*request));
	request->axis_set.axis = (uint8_t)index;
	*axis = value->axis.config;
	if (want->set) {
		merge_options(want, axis);
		merge_speeds(want, axis);
	}
	return memcmp(axis, &value->axis.config, sizeof(*axis)) != 0;
}

static void axis_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	decode_axis_setup(device, index, &value->axis.config);
}

static int64_t axis_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->axis.config.options;
}

const struct setting_kind setting_axis = {
	.read = WIRE_OP_PULSE_AXIS_GET, .write = WIRE_OP_PULSE_AXIS_SET, .has = has_engine,
	.wanted = must_know, .ask = axis_ask, .merge = axis_merge, .learn = axis_learn,
	.written = axis_written,
};
