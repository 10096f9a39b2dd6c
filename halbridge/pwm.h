/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PWM outputs: from a value in units to ticks of the device's counter.
 */
#ifndef HALBRIDGE_PWM_H
#define HALBRIDGE_PWM_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "halbridge/refusal.h"
#include "halbridge/values.h"

struct pwm_channel {
	struct factor scale, offset;
	double min_dc, max_dc; /* in use */
	bool min_bad, max_bad, value_bad, absent;
	bool taken; /* as it is, and nothing has changed since */
	struct value_pwm seen;
	uint32_t ticks; /* the duty that was made of it */
};

struct pwm {
	bool begun;
	uint32_t shown[2 + POKEYS_PWM]; /* period, enabled, duties the pins were filled from */
	struct pwm_channel channel[POKEYS_PWM];
	uint32_t period; /* that the duties were made for */
	uint64_t pins;   /* the board's terminals that `absent` is of */
	uint32_t absent; /* bit = a channel that this board does not bring out */
};

void pwm_init(struct pwm *pwm);

/* From a fresh state image to the pins. Realtime. */
void pwm_read(struct pwm *pwm, struct values *values, const struct pokeys_state *state);

/*
 * From the pins to the command. A channel that is enabled and that the board does not bring
 * out is refused. Realtime.
 */
void pwm_write(struct pwm *pwm, const struct values *values, const struct pokeys_state *state,
	       struct pokeys_command *command, struct refusals *refusals);

#endif
