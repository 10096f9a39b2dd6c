/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older names of the device's settings, by way of the canonical ones.
 */
#ifndef HALBRIDGE_LEGACY_SETTINGS_H
#define HALBRIDGE_LEGACY_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/values.h"

/* A group of parameters as it was at the last look. */
struct legacy_group {
	bool touched; /* somebody has set one of them */
	bool put;     /* they went on to the canonical names */
};

struct legacy_settings {
	bool begun, apply;
	bool applied;                 /* apply at the look before */
	bool pump_off;                /* the charge pump was set to 0 in place of something else */
	uint32_t zeroed[POKEYS_AXES]; /* likewise, parameters of an axis, bits */
	bool terminals[POKEYS_AXES];  /* have the functions that the axis needs */
	uint8_t encoder_zeroed[LEGACY_ENCODERS]; /* of an encoder: as encoderOptions */
	struct legacy_axis_settings axis[POKEYS_AXES];
	struct legacy_encoder_settings encoder[LEGACY_ENCODERS];
	struct legacy_fast_encoders fast;
	struct legacy_engine_settings engine;
	struct legacy_pin_settings pin;
	double scale[POKEYS_AXES];
	double fastest; /* pulses/s of the generator at the last look, 0: not known */
	uint32_t power;
	uint32_t backlash, backlash_width[POKEYS_AXES], backlash_acceleration[POKEYS_AXES];
	double backlash_scale[POKEYS_AXES];
	uint32_t axes; /* enabled, 0: not yet asked for */
	struct legacy_group axis_group[POKEYS_AXES], encoder_group[LEGACY_ENCODERS];
	struct legacy_group fast_group, engine_group, pin_group[POKEYS_PINS];
};

/*
 * Compare what is with what was: show what the device has in groups that
 * nobody has set, hand on those that somebody has, if ApplyIniSettings is
 * true. `driven`: axes that are driven by their older names. `values` is in
 * HAL's memory, and others may write it meanwhile. Cold; one thread, after each
 * report and some times a second.
 */
void legacy_settings_look(struct legacy_settings *own, struct values *values,
			  const bool driven[POKEYS_AXES]);

/* Parts of the above, a file each. */
void legacy_settings_axis(struct legacy_settings *own, struct values *values, unsigned int i,
			  bool driven);
void legacy_settings_encoders(struct legacy_settings *own, struct values *values);

/*
 * A terminal (from 1, 0 for none) that has to be an input or an output is made one;
 * one that is already stays as it is, inverted or not.
 */
void legacy_make_input(struct values *values, uint32_t terminal);
void legacy_make_output(struct values *values, uint32_t terminal);

/*
 * What is common to all groups. legacy_group_begin() copies the parameters at
 * `live` to `now` and sees whether somebody has set one; legacy_group_end()
 * writes those that we have changed back and remembers all.
 */
void legacy_group_begin(struct legacy_group *group, const volatile void *live, void *now,
			const void *before, size_t size);
void legacy_group_end(volatile void *live, const void *now, void *before, size_t size);

/* Hand a value on: "as the device has it" is not touched unless it differs. */
static inline void legacy_put(volatile int32_t *to, int32_t value)
{
	if (*to != value)
		*to = value;
}

#endif
