/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A gain is the daemon's until somebody sets it, as with other settings (wish.c). From then on it
 * is asked for whenever the daemon uses another one, also after a restart of the daemon, which
 * begins with those of pokeysd.conf. Each is a one-shot, so that the daemon can refuse it; then the
 * parameter goes back to what is used.
 *
 * A parameter is memory that anybody writes; nobody tells us. So what was seen there last is
 * remembered, and a value that differs was set by somebody. A negative number, or nan, gives the
 * gain back to the daemon, which goes on with the one that it has.
 */
#include "halbridge/gains.h"
#include <math.h>
#include <string.h>

/* A number that was put there, or the same nan. */
static bool same(double a, double b)
{
	return !memcmp(&a, &b, sizeof(a));
}

static bool differs(float have, double value)
{
	const float wanted = (float)value;

	return memcmp(&have, &wanted, sizeof(have)) != 0;
}

void gains_init(struct gains *gains, enum pokeys_one_shot_operation operation, unsigned int index,
		unsigned int count)
{
	memset(gains, 0, sizeof(*gains));
	gains->operation = (uint8_t)operation;
	gains->index = (uint8_t)index;
	gains->count = (uint8_t)count;
	for (unsigned int i = 0; i < count; i++)
		gains->shown[i] = (double)NAN;
}

/* The one-shot that is under way has ended. */
static void end(struct gains *gains, enum pokeys_outcome outcome)
{
	const uint8_t bit = (uint8_t)(1u << gains->which);

	gains->asked = false;
	if (outcome != POKEYS_OUTCOME_REFUSED || !same(gains->shown[gains->which], gains->value))
		return;
	gains->set &= (uint8_t)~bit;
	gains->refused |= bit;
}

void gains_read(struct gains *gains, double parameter[], const float have[],
		const struct one_shot_queue *queue, const struct pokeys_state *state)
{
	enum pokeys_outcome outcome;

	if (gains->asked) {
		outcome = one_shot_outcome(queue, state, gains->id);
		if (outcome != POKEYS_OUTCOME_NONE)
			end(gains, outcome);
	}
	memcpy(gains->have, have, gains->count * sizeof(have[0]));
	for (unsigned int i = 0; i < gains->count; i++) {
		if (gains->set >> i & 1 || !same(parameter[i], gains->shown[i]) ||
		    !differs(have[i], parameter[i]))
			continue;
		parameter[i] = gains->shown[i] = (double)have[i];
	}
}

/* Somebody has set it, or given it back. */
static void take(struct gains *gains, unsigned int i, double value)
{
	const uint8_t bit = (uint8_t)(1u << i);

	gains->shown[i] = value;
	if (value >= 0)
		gains->set |= bit;
	else
		gains->set &= (uint8_t)~bit;
}

/*
 * One that is wanted otherwise than the daemon has it; count: none. Zeros come last: the daemon
 * refuses that p and i are both 0, and one of them may be about to be another number.
 */
static unsigned int next_wanted(const struct gains *gains)
{
	unsigned int zero = gains->count;

	for (unsigned int i = 0; i < gains->count; i++) {
		if (!(gains->set >> i & 1) || !differs(gains->have[i], gains->shown[i]))
			continue;
		if (gains->shown[i] > 0)
			return i;
		zero = zero < gains->count ? zero : i;
	}
	return zero;
}

static bool ask(struct gains *gains, unsigned int which, struct one_shot_queue *queue,
		struct pokeys_command *command)
{
	const struct pokeys_one_shot shot = {
		.operation = gains->operation,
		.index = gains->index,
		.mask = (uint8_t)which,
		.parameter = { (float)gains->shown[which] },
	};
	const enum one_shot_push pushed = one_shot_push(queue, command, &shot, &gains->id);

	gains->asked = pushed == ONE_SHOT_QUEUED;
	gains->which = (uint8_t)which;
	gains->value = gains->shown[which];
	return pushed == ONE_SHOT_FULL;
}

static void say_refused(struct gains *gains, size_t offset, struct refusals *refusals)
{
	for (unsigned int i = 0; i < gains->count; i++)
		if (gains->refused >> i & 1)
			refusal_once(refusals, offset + i * sizeof(double), REFUSAL_GAIN,
				     gains->value);
	gains->refused = 0;
}

bool gains_write(struct gains *gains, const double parameter[], size_t offset,
		 struct one_shot_queue *queue, struct pokeys_command *command,
		 struct refusals *refusals)
{
	unsigned int which;

	if (gains->refused)
		say_refused(gains, offset, refusals);
	for (unsigned int i = 0; i < gains->count; i++) {
		const double value = *(const volatile double *)&parameter[i];

		if (!same(value, gains->shown[i]))
			take(gains, i, value);
	}
	if (gains->asked || !gains->set)
		return false;
	which = next_wanted(gains);
	return which < gains->count && ask(gains, which, queue, command);
}

void gains_forget(struct gains *gains)
{
	gains->asked = false;
}
