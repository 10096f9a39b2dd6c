/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Two ways to probe. LinuxCNC's own (G38.2) moves the joints itself and wants to
 * know in each period whether the probe touches: that is probe.contact, and what
 * it finds is as exact as its servo period. The device's own is started by
 * probe.start: it latches the positions in the millisecond of the contact,
 * whatever the network does (joint.NN.probe-pos).
 *
 * A contact that the device has latched stays one until it is let go: the touch
 * itself may be shorter than a period.
 */
#include "halbridge/probe.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "halbridge/outcome.h"

#define LIMIT_MOST_S	3600
#define AT(member_)	offsetof(struct values, probe.member_)

enum { ENGINE_INPUTS = 8, TERMINAL_BASE = 8 }; /* protocol section 3.24.1 */
enum { STATE_COMPLETE = 30, STATE_HYBRID_STOPPING = 40, STATE_HYBRID_COMPLETE = 41 };

void probe_init(struct probe *probe)
{
	memset(probe, 0, sizeof(*probe));
	probe->speed = (struct factor){ .may_be_zero = true };
	probe->time_limit = (struct factor){ .may_be_zero = true };
}

static bool latched(const struct pokeys_engine *engine)
{
	return engine->state == STATE_COMPLETE || engine->state == STATE_HYBRID_STOPPING ||
	       engine->state == STATE_HYBRID_COMPLETE;
}

static bool touches(const struct value_probe *value, const struct pokeys_state *state)
{
	const uint32_t pin = value->terminal - 1, input = value->engine_input - 1;
	bool level;

	if (pin < POKEYS_PINS)
		level = state->digital_in[pin / 8] >> pin % 8 & 1;
	else if (!value->terminal && input < ENGINE_INPUTS)
		level = state->engine.misc_inputs >> input & 1;
	else
		return false;
	return level == value->active_high;
}

static bool at_work(const struct pokeys_engine *engine)
{
	return engine->task_phase != POKEYS_TASK_IDLE &&
	       (engine->task == POKEYS_TASK_PROBING || engine->task == POKEYS_TASK_HYBRID_PROBING);
}

static void show(const struct probe *probe, struct values *values, const struct pokeys_state *state)
{
	struct value_probe *value = &values->probe;
	const struct value_probe before = *value;

	value->contact = touches(value, state) || latched(&state->engine);
	value->active = probe->start.state != PRESS_IDLE || at_work(&state->engine);
	value->done = probe->done;
	value->error = probe->error;
	if (before.contact != value->contact || before.active != value->active ||
	    before.done != value->done || before.error != value->error)
		values_changed(values, BLOCK_ENGINE);
}

void probe_read(struct probe *probe, struct values *values, const struct one_shot_queue *queue,
		const struct pokeys_state *state, bool fresh)
{
	const bool open = probe->start.state == PRESS_QUEUED;

	values->one_shot_failed_count += press_read(&probe->start, queue, state);
	values->one_shot_failed_count += press_read(&probe->cancel, queue, state);
	if (open && probe->start.state == PRESS_IDLE) {
		probe->error = outcome_error((enum pokeys_outcome)probe->start.outcome,
					     &state->engine);
		probe->done = probe->error == OUTCOME_WELL;
	}
	if (fresh)
		show(probe, values, state);
}

static void judge(struct probe *probe, const struct value_probe *value, struct refusals *refusals)
{
	const double speed = factor_take(&probe->speed, refusals, value->speed, AT(speed));
	const double limit = factor_take(&probe->time_limit, refusals, value->time_limit,
					 AT(time_limit));

	refusal_mark(refusals, &probe->speed_bad, !(speed > 0 && speed <= 1), AT(speed),
		     REFUSAL_RANGE, speed);
	refusal_mark(refusals, &probe->limit_bad, !(limit >= 0 && limit <= LIMIT_MOST_S),
		     AT(time_limit), REFUSAL_RANGE, limit);
	refusal_mark(refusals, &probe->terminal_bad, value->terminal > POKEYS_PINS, AT(terminal),
		     REFUSAL_RANGE, value->terminal);
	refusal_mark(refusals, &probe->input_bad, value->engine_input > ENGINE_INPUTS,
		     AT(engine_input), REFUSAL_RANGE, value->engine_input);
}

static bool is_good(const struct probe *probe)
{
	return !probe->speed_bad && !probe->speed.bad && !probe->limit_bad &&
	       !probe->time_limit.bad && !probe->terminal_bad && !probe->input_bad;
}

static struct pokeys_one_shot shot_of(const struct probe *probe, const struct value_probe *value,
				      const struct joint joint[POKEYS_AXES])
{
	struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_PROBE,
		.index = (uint8_t)(value->terminal ? value->terminal + TERMINAL_BASE :
						     value->engine_input),
		.mask = value->hybrid ? 0 : (uint8_t)value->axes,
		.flags = (uint8_t)((value->active_high ? POKEYS_PROBE_ACTIVE_HIGH : 0u) |
				   (value->hybrid ? POKEYS_PROBE_HYBRID : 0u)),
		.parameter = { (float)probe->time_limit.used, (float)probe->speed.used },
	};

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		shot.value[i] = shot.mask >> i & 1 ? joint[i].target : 0;
	return shot;
}

static bool targets_are_good(const struct value_probe *value, const struct joint joint[POKEYS_AXES])
{
	bool good = value->axes <= UINT8_MAX;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		good = good && !(value->axes >> i & 1 && joint[i].target_bad);
	return good || value->hybrid;
}

bool probe_write(struct probe *probe, struct values *values, const struct joint joint[POKEYS_AXES],
		 struct one_shot_queue *queue, struct pokeys_command *command, bool fresh,
		 struct refusals *refusals)
{
	static const struct pokeys_one_shot finish = { .operation = POKEYS_ONE_SHOT_PROBE_FINISH };
	const struct value_probe *value = &values->probe;
	struct pokeys_one_shot shot;
	struct press_news start, cancel;

	judge(probe, value, refusals);
	shot = shot_of(probe, value, joint);
	if (value->start && probe->start.up) {
		probe->done = false;
		probe->error = OUTCOME_WELL;
	}
	start = press_write(&probe->start, value->start,
			    fresh && is_good(probe) && targets_are_good(value, joint) ? &shot :
											NULL,
			    queue, command);
	if (start.failed)
		probe->error = OUTCOME_REFUSED;
	cancel = press_write(&probe->cancel, value->cancel, &finish, queue, command);
	values->one_shot_failed_count += (uint32_t)start.failed + cancel.failed;
	return start.full || cancel.full;
}

void probe_forget(struct probe *probe, struct values *values)
{
	if (press_forget(&probe->start)) {
		probe->error = OUTCOME_NOT_KNOWN;
		values->one_shot_failed_count++;
	}
	values->one_shot_failed_count += press_forget(&probe->cancel);
}
