// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What one device's settings may not say together, and what some of them say
 * without words: an encoder of which anything is given is counted, and braking
 * is as hard as speeding up.
 *
 * Terminals are judged by the function that the lists have put together: two
 * lists that name one terminal leave a function that no terminal can have.
 */
#include <string.h>
#include "daemon/control/config_judge.h"

enum {
	PIN_INPUT = 0x02, PIN_OUTPUT = 0x04, PIN_ANALOG = 0x08, PIN_COUNTER = 0x40,
	PIN_INVERT = 0x80,
};
enum { ENCODER_COUNT = 1, ENCODER_4X = 2, ENCODER_SAMPLING = 6 };
enum { AXIS_BUFFERED = 0x01, AXIS_MODE = 0x0D, AXIS_SOFT_LIMITS = 0x20, PIN_BASE = 10 };
enum { EXTERNAL_FIRST = 92, THREADING_ENCODER = 1 };

/* Terminals that have any of these bits, bit = pin - 1. */
static uint64_t pins_with(const struct judged *j, uint8_t bits)
{
	uint64_t pins = 0;

	for (int pin = 0; pin < POKEYS_PINS; pin++)
		if (j->raw->settings.pin_function[pin] & bits)
			pins |= UINT64_C(1) << pin;
	return pins;
}

/* The first pin that is in both, 1-based; 0 = none. */
static int shared_pin(uint64_t a, uint64_t b)
{
	return a & b ? __builtin_ctzll(a & b) + 1 : 0;
}

/* Pins, if it is not all of them. */
static uint64_t resumed_by_name(const struct judged *j)
{
	const uint64_t all = (UINT64_C(1) << POKEYS_PINS) - 1;
	const uint64_t pins = j->raw->resume & all;

	return pins == all ? 0 : pins;
}

/* No terminal may be told two things. */
static void judge_pins(const struct judged *j)
{
	const uint64_t counters = pins_with(j, PIN_COUNTER);
	const uint64_t inputs = pins_with(j, PIN_INPUT) & ~counters;
	const uint64_t outputs = pins_with(j, PIN_OUTPUT), analog = pins_with(j, PIN_ANALOG);
	const uint64_t on = j->raw->safe_on, hold = j->raw->safe_hold;
	const uint64_t resumed = resumed_by_name(j);
	const struct {
		uint64_t a, b;
		const char *key_a, *key_b;
	} never[] = {
		{ inputs, outputs, "digital-inputs", "digital-outputs" },
		{ inputs, analog, "digital-inputs", "analog-inputs" },
		{ outputs, analog, "digital-outputs", "analog-inputs" },
		{ outputs, counters, "digital-outputs", "counter-inputs" },
		{ analog, counters, "analog-inputs", "counter-inputs" },
		{ on, hold, "safe-on", "safe-hold" },
		{ on, inputs, "safe-on", "digital-inputs" },
		{ on, analog, "safe-on", "analog-inputs" },
		{ on, counters, "safe-on", "counter-inputs" },
		{ hold, inputs, "safe-hold", "digital-inputs" },
		{ hold, analog, "safe-hold", "analog-inputs" },
		{ hold, counters, "safe-hold", "counter-inputs" },
		{ resumed, inputs, "resume-outputs", "digital-inputs" },
		{ resumed, analog, "resume-outputs", "analog-inputs" },
		{ resumed, counters, "resume-outputs", "counter-inputs" },
	};

	for (size_t i = 0; i < sizeof(never) / sizeof(never[0]); i++) {
		int pin = shared_pin(never[i].a, never[i].b);

		if (pin)
			judge_fault(j, never[i].key_b, 0, "pin %d is in %s and in %s", pin,
				    never[i].key_a, never[i].key_b);
	}
}

/*
 * A safe value for a terminal that is no output does nothing, and somebody
 * relies on it. Where the file lists the outputs, it lists all of them.
 */
static void judge_safe(const struct judged *j)
{
	static const char *const keys[] = { "safe-on", "safe-hold", "resume-outputs" };
	const uint64_t listed = pins_with(j, PIN_OUTPUT);
	const uint64_t other = pins_with(j, PIN_INPUT | PIN_ANALOG);
	const uint64_t pins[] = { j->raw->safe_on, j->raw->safe_hold, resumed_by_name(j) };

	for (int i = 0; listed && i < 3; i++) {
		int pin = shared_pin(pins[i], ~(listed | other));

		if (pin)
			judge_fault(j, keys[i], 0, "%s: pin %d is not in digital-outputs", keys[i],
				    pin);
	}
}

static void judge_special_pins(const struct judged *j)
{
	const struct pokeys_settings *settings = &j->raw->settings;
	const uint64_t digital = pins_with(j, PIN_INPUT | PIN_OUTPUT);
	const uint64_t busy = pins_with(j, PIN_OUTPUT | PIN_ANALOG);
	int pin = shared_pin(pins_with(j, PIN_INVERT), ~digital);

	if (pin)
		judge_fault(j, "inverted-pins", 0, "inverted-pins: pin %d is neither in "
			    "digital-inputs nor in digital-outputs", pin);
	pin = settings->emergency_pin - PIN_BASE;
	if (settings->set & POKEYS_SET_EMERGENCY_PIN && pin > 0 && busy >> (pin - 1) & 1)
		judge_fault(j, "emergency-pin", 0, "emergency-pin: pin %d is an output or analog",
			    pin);
}

static void judge_encoder(const struct judged *j, uint32_t index)
{
	struct pokeys_encoder_settings *encoder = &j->raw->settings.encoder[index];
	const uint64_t busy = pins_with(j, PIN_OUTPUT | PIN_ANALOG);
	const uint8_t pins[] = { encoder->pin_a, encoder->pin_b };

	for (int i = 0; encoder->pins_set && i < 2; i++)
		if (busy >> pins[i] & 1)
			judge_fault(j, "encoder.#.pins", index, "encoder.%u.pins: pin %d is an "
				    "output or analog", index, pins[i] + 1);
	if (!encoder->options_mask && !encoder->pins_set)
		return;
	if (!(encoder->options_mask & ENCODER_COUNT))
		encoder->options |= ENCODER_COUNT;
	if (!(encoder->options_mask & ENCODER_SAMPLING))
		encoder->options |= ENCODER_4X;
	encoder->options_mask |= ENCODER_COUNT | ENCODER_SAMPLING;
}

static void judge_axis(const struct judged *j, uint32_t index)
{
	struct pokeys_axis_settings *axis = &j->raw->settings.axis[index];
	const uint32_t both = POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM;

	bool on = axis->options & AXIS_SOFT_LIMITS;

	if (on && (axis->set & both) != both)
		judge_fault(j, "axis.#.soft-limits", index, "axis.%u.soft-limits = on wants "
			    "axis.%u.soft-minimum and axis.%u.soft-maximum", index, index, index);
	else if (on && axis->soft_minimum >= axis->soft_maximum)
		judge_fault(j, "axis.#.soft-maximum", index, "axis.%u.soft-maximum has to be above "
			    "axis.%u.soft-minimum", index, index);
	if ((axis->set & POKEYS_AXIS_SET_MAX_ACCELERATION) &&
	    !(axis->set & POKEYS_AXIS_SET_MAX_DECELERATION)) {
		axis->set |= POKEYS_AXIS_SET_MAX_DECELERATION;
		axis->max_deceleration = axis->max_acceleration;
	}
}

/* What nobody has switched on does nothing, and somebody relies on it. */
static void judge_drive(const struct judged *j, uint32_t index)
{
	static const struct {
		uint32_t bit;
		const char *key, *wants;
	} rows[] = {
		{ POKEYS_AXIS_SET_BACKLASH_WIDTH, "axis.#.backlash-width", "backlash" },
		{ POKEYS_AXIS_SET_POSTEP_TYPE, "axis.#.postep-type", "postep" },
		{ POKEYS_AXIS_SET_POSTEP_ADDRESS, "axis.#.postep-address", "postep" },
		{ POKEYS_AXIS_SET_POSTEP_STEP, "axis.#.postep-microsteps", "postep" },
		{ POKEYS_AXIS_SET_POSTEP_TEMPERATURE, "axis.#.postep-temperature-limit", "postep" },
	};
	const struct pokeys_settings *settings = &j->raw->settings;

	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
		bool given = config_is_set(j->lines, rows[i].wants, 0);

		if (settings->axis[index].set & rows[i].bit && !given)
			judge_fault(j, rows[i].key, index,
				    "axis.%u%s wants %s = on (or off, if that "
				    "is meant)", index, rows[i].key + 6, rows[i].wants);
	}
}

/* They follow the slots of the motion buffer, which only an axis in that mode has. */
static void judge_follower(const struct judged *j, const char *key, bool on, uint8_t axis)
{
	const struct pokeys_axis_settings *set = &j->raw->settings.axis[axis];

	if (on && set->options_mask & AXIS_MODE && (set->options & AXIS_MODE) != AXIS_BUFFERED)
		judge_fault(j, key, 0, "%s = %u: axis.%u.mode has to be buffered", key, axis, axis);
}

static void judge_synced(const struct judged *j)
{
	const struct pokeys_settings *settings = &j->raw->settings;

	judge_follower(j, "synced-pwm-axis", settings->sync_pwm_enable, settings->sync_pwm_axis);
	judge_follower(j, "synced-outputs-axis", settings->sync_out_enable,
		       settings->sync_out_axis);
	for (size_t i = 0; i < sizeof(settings->sync_out_pin); i++) {
		const uint8_t pin = settings->sync_out_pin[i];

		if (pin > POKEYS_PINS && pin < EXTERNAL_FIRST)
			judge_fault(j, "synced-outputs-pins", 0,
				    "synced-outputs-pins: %u is neither a "
				    "terminal (1-55) nor an external output (92-99)", pin);
	}
}

/* Nobody can say what a missing one should be. */
static void judge_threading(const struct judged *j)
{
	static const char *const keys[] = {
		"threading-mode", "threading-rpm", "threading-speed-gain",
		"threading-position-gain", "threading-ticks",
	};
	const struct pokeys_settings *settings = &j->raw->settings;
	size_t wanted = sizeof(keys) / sizeof(keys[0]);
	const char *given = "threading-ignore-axes";

	if (!(settings->set & POKEYS_SET_THREADING))
		return;
	wanted -= !(settings->threading_mode & THREADING_ENCODER);
	for (size_t i = 0; i < sizeof(keys) / sizeof(keys[0]); i++)
		given = config_is_set(j->lines, keys[i], 0) ? keys[i] : given;
	for (size_t i = 0; i < wanted; i++) {
		if (!config_is_set(j->lines, keys[i], 0)) {
			judge_fault(j, given, 0, "%s wants %s as well", given, keys[i]);
			return;
		}
	}
}

/* A key of an axis that the engine does not drive. */
static void judge_axis_count(const struct judged *j)
{
	const struct pokeys_settings *settings = &j->raw->settings;
	const struct config_key *key;

	if (!(settings->set & POKEYS_SET_AXES))
		return;
	for (size_t i = 0; (key = config_key_at(i)); i++) {
		for (uint32_t n = settings->axes; n < POKEYS_AXES; n++) {
			if (strncmp(key->name, "axis.#.", 7) || !j->lines->key[i][n])
				continue;
			judge_fault(j, key->name, n,
				    "axis.%u%s: there is no axis %u with axes = %u "
				    "(they are numbered from 0)", n, key->name + 6, n,
				    settings->axes);
		}
	}
}

/* The device's own failsafe is the safe state, unless it is told otherwise or nothing. */
static void judge_failsafe(const struct judged *j)
{
	struct pokeys_settings *settings = &j->raw->settings;

	if (!j->raw->failsafe) {
		if (settings->set & POKEYS_SET_FAILSAFE)
			judge_fault(j, "failsafe", 0, "failsafe = off leaves the device's own; the "
				    "failsafe keys want it on (failsafe-timeout-ms = off switches "
				    "the device's off)");
		return;
	}
	settings->set |= POKEYS_SET_FAILSAFE;
	if (!config_is_set(j->lines, "failsafe-on", 0))
		memcpy(settings->failsafe_outputs, &j->raw->safe_on,
		       sizeof(settings->failsafe_outputs));
}

static void judge_matrix(const struct judged *j)
{
	struct pokeys_settings *settings = &j->raw->settings;

	if (!(settings->set & POKEYS_SET_MATRIX) || (settings->matrix_rows &&
						     settings->matrix_columns))
		return;
	if (settings->matrix_enable || settings->matrix_rows || settings->matrix_columns) {
		judge_fault(j, "matrix-keyboard", 0, "matrix-keyboard = on, matrix-rows and "
			    "matrix-columns want each other");
		return;
	}
	/* off: the device wants some shape of it all the same */
	settings->matrix_rows = 1;
	settings->matrix_columns = 1;
}

void judge_settings(const struct judged *j)
{
	judge_pins(j);
	judge_safe(j);
	judge_special_pins(j);
	for (uint32_t i = 0; i < CONFIG_INDICES; i++)
		judge_encoder(j, i);
	for (uint32_t i = 0; i < POKEYS_AXES; i++) {
		judge_axis(j, i);
		judge_drive(j, i);
	}
	judge_synced(j);
	judge_axis_count(j);
	judge_failsafe(j);
	judge_matrix(j);
	judge_threading(j);
}
