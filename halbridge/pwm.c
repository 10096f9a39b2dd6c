/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PWM: duty = value / scale + offset, within min-dc..max-dc, as pwmgen has it.
 *
 * There is often a spindle behind it, so what cannot be understood is 0 and
 * not the last good value: a value that is not a number is as if enable were
 * false. A parameter that cannot be used keeps its last good value, as
 * everywhere.
 *
 * Duty is sent in ticks of the period that the device has now. A channel that
 * was enabled once stays switched on in the device and has duty 0 when it is
 * not enabled: switching it off would let its pin float.
 */
#include "halbridge/pwm.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "halbridge/news.h"

#define OFFSET(number, member)	\
	(offsetof(struct values, pwm) + (number) * sizeof(struct value_pwm) +	\
	 offsetof(struct value_pwm, member))

void pwm_init(struct pwm *pwm)
{
	memset(pwm, 0, sizeof(*pwm));
	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		pwm->channel[i] = (struct pwm_channel){
			.scale = { .used = 1, .seen = 1 },
			.offset = { .may_be_zero = true },
			.max_dc = 1,
		};
}

void pwm_read(struct pwm *pwm, struct values *values, const struct pokeys_state *state)
{
	uint32_t now[2 + POKEYS_PWM] = { state->pwm_period, state->pwm_enabled };

	memcpy(&now[2], state->pwm_duty, sizeof(state->pwm_duty));
	if (!news(pwm->shown, now, sizeof(now), !pwm->begun))
		return;
	pwm->begun = true;
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		values->pwm[i].enabled = state->pwm_enabled >> i & 1;
		values->pwm[i].duty = state->pwm_period ?
					      (double)state->pwm_duty[i] / state->pwm_period :
					      0;
	}
	values_changed(values, BLOCK_PWM);
}

/* 0..1, else the last good one. */
static double limit_of(double wanted, double *good, bool *bad, size_t offset,
		       struct refusals *refusals)
{
	/* Written so that NaN is wrong as well. */
	bool wrong = !(wanted >= 0 && wanted <= 1);

	refusal_mark(refusals, bad, wrong, offset,
		     isfinite(wanted) ? REFUSAL_RANGE : REFUSAL_NOT_FINITE, wanted);
	if (!wrong)
		*good = wanted;
	return *good;
}

static double duty_of(struct pwm_channel *channel, const struct value_pwm *value, unsigned int i,
		      struct refusals *refusals)
{
	double scale = factor_take(&channel->scale, refusals, value->scale, OFFSET(i, scale));
	double offset = factor_take(&channel->offset, refusals, value->offset, OFFSET(i, offset));
	double least = limit_of(value->min_dc, &channel->min_dc, &channel->min_bad,
				OFFSET(i, min_dc), refusals);
	double most = limit_of(value->max_dc, &channel->max_dc, &channel->max_bad,
			       OFFSET(i, max_dc), refusals);
	double wanted = value->value;
	bool bad = !isfinite(wanted);
	double duty = wanted / scale + offset;

	refusal_mark(refusals, &channel->value_bad, bad, OFFSET(i, value), REFUSAL_NOT_FINITE,
		     wanted);
	if (bad || isnan(duty) || !value->enable)
		return 0;
	return fmin(fmax(duty, least), most);
}

/* Channels 0 to 5 are at terminals 22 to 17 (protocol section 2.5). */
static void learn(struct pwm *pwm, const struct pokeys_state *state)
{
	const uint64_t pins = state->capability.pwm_pins;

	pwm->period = state->pwm_period;
	pwm->pins = pins;
	pwm->absent = 0;
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		pwm->absent |= (uint32_t)(pins && !(pins >> (21 - i) & 1)) << i;
		pwm->channel[i].taken = false;
	}
}

/* Most channels are as they were, most of the time. A copy, for parameters change as they like. */
static bool is_taken(struct pwm_channel *channel, const struct value_pwm *value)
{
	struct value_pwm now;

	memcpy(&now, value, sizeof(now));
	if (channel->taken && !memcmp(&now, &channel->seen, sizeof(now)))
		return true;
	memcpy(&channel->seen, &now, sizeof(now));
	return false;
}

static void take(struct pwm *pwm, unsigned int i, struct refusals *refusals)
{
	struct pwm_channel *channel = &pwm->channel[i];
	const struct value_pwm *value = &channel->seen;
	const double duty = duty_of(channel, value, i, refusals);

	channel->taken = true;
	channel->ticks = duty > 0 ? (uint32_t)llrint(duty * pwm->period) : 0;
	refusal_mark(refusals, &channel->absent, value->enable && pwm->absent >> i & 1,
		     OFFSET(i, enable), REFUSAL_NO_PWM, 1);
}

void pwm_write(struct pwm *pwm, const struct values *values, const struct pokeys_state *state,
	       struct pokeys_command *command, struct refusals *refusals)
{
	if (pwm->period != state->pwm_period || pwm->pins != state->capability.pwm_pins)
		learn(pwm, state);
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		if (!is_taken(&pwm->channel[i], &values->pwm[i]))
			take(pwm, i, refusals);
		command->pwm_duty[i] = pwm->channel[i].ticks;
		command->pwm_enable |= (uint32_t)pwm->channel[i].seen.enable << i;
	}
}
