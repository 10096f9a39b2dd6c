/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Targets go into the command image as they are, and the daemon judges them. A target that is not a
 * number becomes 0, because off does no harm.
 *
 * A heater is the daemon's, and its worst fault is that the device is lost. So its pins are shown
 * while the daemon is alive, whether the device is or not; then they keep what they had, and a
 * program that watches a temperature has to look at `connected` as well.
 */
#include "halbridge/heaters.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

#define OFFSET(number, member)	\
	(offsetof(struct values, heater) + (number) * sizeof(struct value_heater) +	\
	 offsetof(struct value_heater, member))

/* What others set meanwhile, the gains, comes after these. */
#define PINS	offsetof(struct value_heater, gain)

void heaters_init(struct heaters *heaters)
{
	memset(heaters, 0, sizeof(*heaters));
	heaters->busy = (UINT32_C(1) << POKEYS_HEATERS) - 1; /* their pins are looked at once */
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		gains_init(&heaters->gains[i], POKEYS_ONE_SHOT_HEATER_GAIN, i, VALUES_HEATER_GAINS);
}

/* True if a pin has changed. */
static bool show(struct value_heater *value, const struct pokeys_heater *heater)
{
	struct value_heater now;

	memcpy(&now, value, PINS);
	now.temperature = (double)heater->temperature;
	now.target_in_effect = (double)heater->target;
	now.power = (double)heater->power;
	now.at_temperature = heater->at_temperature;
	now.fault = heater->fault;
	now.fault_code = heater->fault;
	now.condition = heater->condition;
	now.refused = heater->refused;
	if (!memcmp(&now, value, PINS))
		return false;
	memcpy(value, &now, PINS);
	return true;
}

static void read_gains(struct gains *gains, struct value_heater *value,
		       const struct pokeys_heater *heater, const struct one_shot_queue *queue,
		       const struct pokeys_state *state)
{
	const float have[VALUES_HEATER_GAINS] = { heater->p, heater->i, heater->d };

	gains_read(gains, value->gain, have, queue, state);
}

void heaters_read(struct heaters *heaters, struct values *values,
		  const struct one_shot_queue *queue, const struct pokeys_state *state, bool alive)
{
	bool changed = !heaters->begun;
	uint32_t there = 0;

	for (uint32_t left = heaters->busy; left; left &= left - 1) {
		const unsigned int i = (unsigned int)__builtin_ctz(left);

		values->one_shot_failed_count += press_read(&heaters->reset[i], queue, state);
	}
	if (!alive)
		return;
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		there |= (uint32_t)(state->heater[i].state != POKEYS_HEATER_NONE) << i;
	/* those that are gone are shown once more */
	for (uint32_t left = there | heaters->there; left; left &= left - 1) {
		const unsigned int i = (unsigned int)__builtin_ctz(left);

		changed |= show(&values->heater[i], &state->heater[i]);
		read_gains(&heaters->gains[i], &values->heater[i], &state->heater[i], queue, state);
	}
	heaters->begun = true;
	heaters->there = there;
	if (changed)
		values_changed(values, BLOCK_HEATER);
}

static void write_target(struct heaters *heaters, unsigned int i, double target,
			 struct pokeys_command *command, struct refusals *refusals)
{
	const bool there = heaters->there >> i & 1;
	const bool bad = !isfinite(target);

	refusal_mark(refusals, &heaters->bad[i], bad, OFFSET(i, target), REFUSAL_TARGET, target);
	refusal_mark(refusals, &heaters->absent[i], heaters->begun && !there && !bad && target != 0,
		     OFFSET(i, target), REFUSAL_NO_HEATER, target);
	command->heater_target[i] = there && !bad ? (float)target : 0;
	/* a heater whose target is no number is off, but off was not commanded */
	command->heater_mask |= (uint32_t)(there && !bad) << i;
}

/* True if the queue was full. */
static bool write_heater(struct heaters *heaters, unsigned int i, struct values *values,
			 struct one_shot_queue *queue, struct pokeys_command *command, bool fresh,
			 struct refusals *refusals)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_HEATER_RESET,
		.index = (uint8_t)i,
	};
	const struct press_news news = press_write(&heaters->reset[i], values->heater[i].reset,
						   fresh ? &shot : NULL, queue, command);

	write_target(heaters, i, values->heater[i].target, command, refusals);
	values->one_shot_failed_count += news.failed;
	return news.full | (fresh && heaters->there >> i & 1 &&
			    gains_write(&heaters->gains[i], values->heater[i].gain, OFFSET(i, gain),
					queue, command, refusals));
}

static uint32_t is_busy(const struct heaters *heaters, unsigned int i)
{
	return !press_rests(&heaters->reset[i]) || heaters->bad[i] || heaters->absent[i];
}

/* Most machines have no heaters, and pay for none. */
static uint32_t wanted(const struct heaters *heaters, const struct values *values)
{
	uint32_t which = heaters->there | heaters->busy;

	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		which |= (uint32_t)(values->heater[i].reset | (values->heater[i].target != 0)) << i;
	return which;
}

bool heaters_write(struct heaters *heaters, struct values *values, struct one_shot_queue *queue,
		   struct pokeys_command *command, bool fresh, struct refusals *refusals)
{
	bool full = false;

	command->heater_mask = 0;
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		command->heater_target[i] = 0;
	for (uint32_t left = wanted(heaters, values); left; left &= left - 1) {
		const unsigned int i = (unsigned int)__builtin_ctz(left);

		full |= write_heater(heaters, i, values, queue, command, fresh, refusals);
		heaters->busy = (heaters->busy & ~(UINT32_C(1) << i)) | is_busy(heaters, i) << i;
	}
	return full;
}

void heaters_forget(struct heaters *heaters, struct values *values)
{
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++) {
		values->one_shot_failed_count += press_forget(&heaters->reset[i]);
		gains_forget(&heaters->gains[i]);
	}
	heaters->begun = false;
}
