// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl pwm: hold PWM outputs at a duty.
 *
 * All channels of a device have one period. If nobody has set it yet, it is 1 kHz, and stays so.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "settings/terminal.h"
#include "tools/hold.h"
#include "wire/model.h"

enum { USUAL_HZ = 1000 };

_Static_assert((int)POKEYS_PWM == (int)WIRE_MODEL_PWMS, "channels");

/* The channels of these terminals; *missing: those that have none. */
static uint32_t channels_of(uint64_t terminals, const struct wire_model *model, uint64_t *missing)
{
	uint32_t channels = 0;

	*missing = terminals;
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		const unsigned int terminal = model->pinmap->pwm_pin[i];

		if (!terminal || !(terminals >> (terminal - 1) & 1))
			continue;
		channels |= 1u << i;
		*missing &= ~(UINT64_C(1) << (terminal - 1));
	}
	return channels;
}

static uint32_t ticks(const struct hold *hold)
{
	return (uint32_t)lround(hold->duty * hold->period);
}

/* One that follows an axis is the device's: it would overwrite what is commanded. */
static bool is_free(const struct hold *hold, const struct wire_model *model,
		    const struct pokeys_settings *settings)
{
	const unsigned int channel = settings->sync_pwm_channel;

	if (!settings->sync_pwm_enable || channel >= POKEYS_PWM || !(hold->channels >> channel & 1))
		return true;
	complain("%s: terminal %u: this PWM output follows axis %u; switch synced-pwm off in "
		 "pokeysd.conf first",
		 hold->device, model->pinmap->pwm_pin[channel], settings->sync_pwm_axis);
	return false;
}

static bool begin(struct hold *hold, const struct pokeys_state *state,
		  const struct pokeys_report *report)
{
	const struct wire_model *model = wire_model(state->identity.hardware);
	char text[TERMINAL_LIST_MAX];
	uint64_t missing;

	hold->channels = channels_of(hold->terminals, model, &missing);
	if (missing) {
		complain("%s: %s: no PWM output of a %s; pokeysctl terminals %s lists them",
			 hold->device, terminal_list(missing, text), model->name, model->name);
		return false;
	}
	if (!is_free(hold, model, &report->device))
		return false;
	hold->period = state->pwm_period ? state->pwm_period : model->pwm_hz / USUAL_HZ;
	snprintf(hold->how, sizeof(hold->how), "at %g %% of %.6g Hz", hold->duty * 100,
		 (double)model->pwm_hz / hold->period);
	return true;
}

static void fill(const struct hold *hold, bool wanted, struct pokeys_command *image)
{
	image->pwm_period = hold->period;
	for (unsigned int i = 0; wanted && i < POKEYS_PWM; i++)
		image->pwm_duty[i] = hold->channels >> i & 1 ? ticks(hold) : 0;
	image->pwm_enable = wanted ? hold->channels : 0;
}

static bool is_so(const struct hold *hold, bool wanted, const struct pokeys_state *state)
{
	if (!wanted)
		return !(state->pwm_enabled & hold->channels);
	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		if (hold->channels >> i & 1 && state->pwm_duty[i] != ticks(hold))
			return false;
	return (state->pwm_enabled & hold->channels) == hold->channels;
}

/* "30", "30%" or "12.5 %". */
static bool take_duty(const char *text, double *duty)
{
	char *after;
	const double percent = strtod(text, &after);

	after += strspn(after, " ");
	if (after == text || (*after && strcmp(after, "%")) || !(percent >= 0 && percent <= 100))
		return false;
	*duty = percent / 100;
	return true;
}

int command_pwm(const struct options *options)
{
	static const struct hold_kind kind = { begin, fill, is_so };
	char *const *names = options->names;
	struct hold hold = { .kind = &kind };

	if (options->name_count != 3) {
		complain("pwm needs a device, terminals, and a duty: pokeysctl pwm mill 17 30%% "
			 "--for 5");
		return STATUS_USAGE;
	}
	if (!hold_terminals(names[1], &hold.terminals)) {
		complain("\"%s\": terminals are numbers from 1 to %d, such as 17 or 17,20-22",
			 names[1], POKEYS_PINS);
		return STATUS_USAGE;
	}
	if (!take_duty(names[2], &hold.duty)) {
		complain("\"%s\": the duty is a percentage from 0 to 100, such as 30%%", names[2]);
		return STATUS_USAGE;
	}
	hold.device = names[0];
	return hold_for(&hold, options);
}
