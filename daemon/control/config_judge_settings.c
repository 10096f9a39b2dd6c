// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What one device's settings may not say together, and what some of them say
 * without words: an encoder of which anything is given is counted, and braking
 * is as hard as speeding up. Terminals are judged in config_judge_terminals.c.
 */
#include <stdio.h>
#include <string.h>
#include "daemon/control/config_judge.h"
#include "wire/model.h"
#include "wire/pulse.h"

enum { ENCODER_COUNT = 1, ENCODER_4X = 2, ENCODER_SAMPLING = 6 };
enum { AXIS_BUFFERED = 0x01, AXIS_MODE = 0x0D, AXIS_SOFT_LIMITS = 0x20 };
enum { INTERNAL_SPEED = 25000 };
enum { EXTERNAL_FIRST = 92, THREADING_ENCODER = 1 };

static void judge_encoder(const struct judged *j, uint32_t index)
{
	struct pokeys_encoder_settings *encoder = &j->raw->settings.encoder[index];

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
		judge_fault(j, "axis.#.soft-limits", index,
			    "axis.%u.soft-limits = on needs "
			    "axis.%u.soft-minimum and axis.%u.soft-maximum",
			    index, index, index);
	else if (on && axis->soft_minimum >= axis->soft_maximum)
		judge_fault(j, "axis.#.soft-maximum", index,
			    "axis.%u.soft-maximum has to be above "
			    "axis.%u.soft-minimum",
			    index, index);
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
		const char *key, *needs;
	} rows[] = {
		{ POKEYS_AXIS_SET_BACKLASH_WIDTH, "axis.#.backlash-width", "backlash" },
		{ POKEYS_AXIS_SET_POSTEP_TYPE, "axis.#.postep-type", "postep" },
		{ POKEYS_AXIS_SET_POSTEP_ADDRESS, "axis.#.postep-address", "postep" },
		{ POKEYS_AXIS_SET_POSTEP_STEP, "axis.#.postep-microsteps", "postep" },
		{ POKEYS_AXIS_SET_POSTEP_TEMPERATURE, "axis.#.postep-temperature-limit", "postep" },
	};
	const struct pokeys_settings *settings = &j->raw->settings;

	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
		bool given = config_is_set(j->lines, rows[i].needs, 0);

		if (settings->axis[index].set & rows[i].bit && !given)
			judge_fault(j, rows[i].key, index,
				    "axis.%u%s needs %s = on (or off, if that "
				    "is meant)",
				    index, rows[i].key + 6, rows[i].needs);
	}
}

/*
 * A switch that is not on is not looked at. No fault: it may be on in the device's flash memory,
 * which the daemon leaves as it is.
 */
static void note_switch(const struct judged *j, uint32_t index, const char *name)
{
	static const char *const details[] = { "pin", "invert", "filter" };
	char key[40], on[40];

	snprintf(on, sizeof(on), "axis.#.%s", name);
	for (size_t i = 0; i < sizeof(details) / sizeof(details[0]); i++) {
		snprintf(key, sizeof(key), "axis.#.%s-%s", name, details[i]);
		if (!config_is_set(j->lines, key, index) || config_is_set(j->lines, on, index))
			continue;
		config_note(j->file, config_line_of(j->lines, key, index),
			    "[device %s]: axis.%u.%s-%s: the switch is used only with "
			    "axis.%u.%s = on, which is not given (off, if that is meant)",
			    j->raw->name, index, name, details[i], index, name);
		return;
	}
}

static void note_switches(const struct judged *j, uint32_t index)
{
	if (!j->file->here)
		return;
	note_switch(j, index, "limit-minus");
	note_switch(j, index, "limit-plus");
	note_switch(j, index, "home");
}

/* WIRE_GENERATOR_INTERNAL: three axes of at most 25 kHz. */
static void judge_generator(const struct judged *j)
{
	const struct pokeys_settings *settings = &j->raw->settings;

	if (!(settings->set & POKEYS_SET_GENERATOR) ||
	    (settings->generator & WIRE_GENERATOR_TYPE) != WIRE_GENERATOR_INTERNAL)
		return;
	if (settings->set & POKEYS_SET_AXES && settings->axes > WIRE_MODEL_INTERNAL_AXES)
		judge_fault(j, "axes", 0, "axes = %u: generator = internal has %u", settings->axes,
			    WIRE_MODEL_INTERNAL_AXES);
	for (uint32_t i = 0; i < WIRE_MODEL_INTERNAL_AXES; i++)
		if (settings->axis[i].set & POKEYS_AXIS_SET_MAX_SPEED &&
		    settings->axis[i].max_speed > INTERNAL_SPEED)
			judge_fault(j, "axis.#.max-speed", i,
				    "axis.%u.max-speed = %g is above the "
				    "%u pulses/s of generator = internal",
				    i, (double)settings->axis[i].max_speed, INTERNAL_SPEED);
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
				    "terminal (1-55) nor an external output (92-99)",
				    pin);
	}
}

/* Nobody can say what a missing one should be. */
static void judge_threading(const struct judged *j)
{
	static const char *const keys[] = {
		"threading-mode",          "threading-rpm",   "threading-speed-gain",
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
			judge_fault(j, given, 0, "%s needs %s as well", given, keys[i]);
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
				    "(they are numbered from 0)",
				    n, key->name + 6, n, settings->axes);
		}
	}
}

/* The device's own failsafe is the safe state, unless it is told otherwise or nothing. */
static void judge_failsafe(const struct judged *j)
{
	struct pokeys_settings *settings = &j->raw->settings;

	if (!j->raw->failsafe) {
		if (settings->set & POKEYS_SET_FAILSAFE)
			judge_fault(j, "failsafe", 0,
				    "failsafe = off leaves the device's own; the "
				    "failsafe keys need it on (failsafe-timeout-ms = off switches "
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

	if (!(settings->set & POKEYS_SET_MATRIX) ||
	    (settings->matrix_rows && settings->matrix_columns))
		return;
	if (settings->matrix_enable || settings->matrix_rows || settings->matrix_columns) {
		judge_fault(j, "matrix-keyboard", 0,
			    "matrix-keyboard = on, matrix-rows and "
			    "matrix-columns need each other");
		return;
	}
	/* off: the device needs some shape of it all the same */
	settings->matrix_rows = 1;
	settings->matrix_columns = 1;
}

void judge_settings(const struct judged *j)
{
	judge_terminals(j);
	for (uint32_t i = 0; i < CONFIG_INDICES; i++)
		judge_encoder(j, i);
	for (uint32_t i = 0; i < POKEYS_AXES; i++) {
		judge_axis(j, i);
		judge_drive(j, i);
		note_switches(j, i);
	}
	judge_axes(j);
	judge_synced(j);
	judge_generator(j);
	judge_axis_count(j);
	judge_failsafe(j);
	judge_heaters_of(j);
	judge_servos_of(j);
	judge_matrix(j);
	judge_threading(j);
}
