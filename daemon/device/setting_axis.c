/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One axis: what is read, what is wanted, what is written (protocol section
 * 3.24.4).
 *
 * An axis block is always read, changed and written as a whole: the bytes that
 * the device had, also those that no document names, go back as they came.
 *
 * The device counts in pulses per millisecond and in single precision, people
 * in pulses per second. What was read, multiplied and wished back must not
 * count as another value, or every start would write: so a speed that is the
 * same within one part in a million is left as the device has it.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define AXIS_BLOCK ((POKEYS_AXIS_SET_SIGNALS << 1) - 1)	/* what stands in the block */
#define SAME 1e-6
#define PER_MS 1e3		/* speeds, pulses/s */
#define PER_MS2 1e6		/* accelerations, pulses/s^2 */

static bool axis_wanted(const struct pokeys_settings *want, unsigned int index)
{
	const struct pokeys_axis_settings *axis = &want->axis[index];

	return axis->set & AXIS_BLOCK || axis->options_mask || axis->switches_mask;
}

static void axis_ask(unsigned int index, union setting_request *request)
{
	memset(request, 0, sizeof(*request));
	request->axis_get.axis = (uint8_t)index;
}

/* The bytes of both structs that are the same thing. */
static const struct {
	uint32_t bit;
	size_t ours, wire;
} bytes[] = {
#define BYTE(NAME, ours, wire) \
	{ POKEYS_AXIS_SET_##NAME, offsetof(struct pokeys_axis_settings, ours), \
	  offsetof(struct wire_axis_config, wire) }
	BYTE(PIN_LIMIT_MINUS, pin_limit_minus, pin_limit_n),
	BYTE(PIN_LIMIT_PLUS, pin_limit_plus, pin_limit_p),
	BYTE(PIN_HOME, pin_home, pin_home),
	BYTE(PIN_ENABLE, pin_enable, pin_enable),
	BYTE(INVERT_ENABLE, invert_enable, invert_enable),
	BYTE(FILTER_LIMIT_MINUS, filter_limit_minus, filter_limit_n),
	BYTE(FILTER_LIMIT_PLUS, filter_limit_plus, filter_limit_p),
	BYTE(FILTER_HOME, filter_home, filter_home),
	BYTE(FILTER_PROBE, filter_probe, filter_probe),
	BYTE(HOMING_ALGORITHM, homing_algorithm, homing_algorithm),
	BYTE(HOMING_SPEED, homing_speed, homing_speed),
	BYTE(HOMING_RETURN, homing_return, homing_return),
	BYTE(MPG_ENCODER, mpg_encoder, mpg_encoder),
	BYTE(SIGNALS, signals, signals),
#undef BYTE
};

static void merge_bytes(const struct pokeys_axis_settings *want, struct wire_axis_config *axis)
{
	for (size_t i = 0; i < sizeof(bytes) / sizeof(bytes[0]); i++) {
		if (want->set & bytes[i].bit)
			((uint8_t *)axis)[bytes[i].wire] = ((const uint8_t *)want)[bytes[i].ours];
	}
}

static void merge_speed(bool set, float want, double unit, float *have)
{
	/* written so that a device's NaN is another value */
	if (set && !(fabs((double)want - (double)*have * unit) <= (double)want * SAME))
		*have = (float)((double)want / unit);
}

static void merge_numbers(const struct pokeys_axis_settings *want, struct wire_axis_config *axis)
{
	const uint32_t set = want->set;

	merge_speed(set & POKEYS_AXIS_SET_MAX_SPEED, want->max_speed, PER_MS, &axis->max_speed);
	merge_speed(set & POKEYS_AXIS_SET_MAX_ACCELERATION, want->max_acceleration, PER_MS2,
		    &axis->max_accel);
	merge_speed(set & POKEYS_AXIS_SET_MAX_DECELERATION, want->max_deceleration, PER_MS2,
		    &axis->max_decel);
	if (set & POKEYS_AXIS_SET_SOFT_MINIMUM)
		axis->soft_min = want->soft_minimum;
	if (set & POKEYS_AXIS_SET_SOFT_MAXIMUM)
		axis->soft_max = want->soft_maximum;
	if (set & POKEYS_AXIS_SET_BACK_OFF)
		axis->back_off = want->back_off;
	if (set & POKEYS_AXIS_SET_MPG_MULTIPLIER)
		axis->mpg_multiplier = want->mpg_multiplier;
	if (set & POKEYS_AXIS_SET_MPG_DIVIDER)
		axis->mpg_divider = want->mpg_divider;
}

static uint8_t merge_bits(uint8_t have, uint8_t want, uint8_t mask)
{
	return (uint8_t)((have & ~mask) | (want & mask));
}

static uint64_t axis_merge(const struct pokeys_settings *wanted, unsigned int index,
			   const union setting_value *value, union setting_request *request)
{
	const struct pokeys_axis_settings *want = &wanted->axis[index];
	struct wire_axis_config *axis = &request->axis_set.config;

	memset(request, 0, sizeof(*request));
	request->axis_set.axis = (uint8_t)index;
	*axis = value->axis.config;
	axis->options = merge_bits(axis->options, want->options, want->options_mask);
	axis->switches = merge_bits(axis->switches, want->switches, want->switches_mask);
	merge_bytes(want, axis);
	merge_numbers(want, axis);
	return memcmp(axis, &value->axis.config, sizeof(*axis)) != 0;
}

static void axis_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	decode_axis_setup(device, index, &value->axis.config);
	if (device->configure.found_running && buffer_axes(device) & 1u << index)
		threading_suspect(device);
}

static float per_second(float have, double unit)
{
	return isfinite(have) ? (float)((double)have * unit) : 0;
}

static void report_numbers(struct pokeys_axis_settings *known, const struct wire_axis_config *axis)
{
	known->max_speed = per_second(axis->max_speed, PER_MS);
	known->max_acceleration = per_second(axis->max_accel, PER_MS2);
	known->max_deceleration = per_second(axis->max_decel, PER_MS2);
	known->soft_minimum = axis->soft_min;
	known->soft_maximum = axis->soft_max;
	known->back_off = axis->back_off;
	known->mpg_multiplier = axis->mpg_multiplier;
	known->mpg_divider = axis->mpg_divider;
}

static void axis_report(struct pokeys_settings *known, unsigned int index,
			const union setting_value *value)
{
	const struct wire_axis_config *axis = &value->axis.config;
	struct pokeys_axis_settings *out = &known->axis[index];

	out->set |= AXIS_BLOCK;
	out->options = axis->options;
	out->switches = axis->switches;
	out->options_mask = out->switches_mask = UINT8_MAX;
	for (size_t i = 0; i < sizeof(bytes) / sizeof(bytes[0]); i++)
		((uint8_t *)out)[bytes[i].ours] = ((const uint8_t *)axis)[bytes[i].wire];
	report_numbers(out, axis);
}

static int64_t axis_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->axis.config.options;
}

const struct setting_kind setting_axis = {
	.read = WIRE_OP_PULSE_AXIS_GET,
	.write = WIRE_OP_PULSE_AXIS_SET,
	.name = POKEYS_SETTING_AXIS,
	.vital = true,
	.has = setting_has_engine,
	.wanted = axis_wanted,
	.ask = axis_ask,
	.merge = axis_merge,
	.learn = axis_learn,
	.report = axis_report,
	.written = axis_written,
};
