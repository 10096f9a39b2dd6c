/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device homes one group of axes at a time, and a daemon that is at it
 * refuses the next. So presses are collected here and asked for one after the
 * other, in the order of the joints; those of one home-group are one request,
 * whichever of them was pressed, because a gantry of which one side is homed
 * is racked.
 *
 * When one fails, those that wait are not homed any more: whoever pressed them
 * all wanted a homed machine, and has to look at the one that failed first.
 */
#include "halbridge/joint_home.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "halbridge/outcome.h"

#define LIMIT_MOST_S	3600
#define JOINT(number, member) \
	(offsetof(struct values, joint) + (number) * sizeof(struct value_joint) +	\
	 offsetof(struct value_joint, member))

void joint_home_init(struct joint_home *home)
{
	memset(home, 0, sizeof(*home));
	home->time_limit = (struct factor){ .may_be_zero = true };
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		home->offset[i] = (struct factor){ .may_be_zero = true };
}

static void end(struct joint_home *home, struct values *values, uint32_t error)
{
	home->open = false;
	home->mask = 0;
	home->error = error;
	if (error == OUTCOME_WELL)
		return;
	home->wanted = 0;
	values->one_shot_failed_count++;
}

static void show(const struct joint_home *home, struct values *values,
		 const struct pokeys_engine *engine)
{
	const bool active = engine->task == POKEYS_TASK_HOMING &&
			    engine->task_phase != POKEYS_TASK_IDLE;
	const unsigned int joints = home->wanted | home->mask | (active ? engine->task_axes : 0u);
	const struct value_homing before = values->homing;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (values->joint[i].homing != (joints >> i & 1))
			values_changed(values, BLOCK_JOINT);
		values->joint[i].homing = joints >> i & 1;
	}
	values->homing.active = joints;
	values->homing.phase = active ? engine->task_phase : POKEYS_TASK_IDLE;
	values->homing.error = home->error;
	if (before.active != values->homing.active || before.phase != values->homing.phase ||
	    before.error != values->homing.error)
		values_changed(values, BLOCK_ENGINE);
}

void joint_home_read(struct joint_home *home, struct values *values,
		     const struct one_shot_queue *queue, const struct pokeys_state *state,
		     bool fresh)
{
	enum pokeys_outcome outcome = POKEYS_OUTCOME_NONE;

	if (home->open)
		outcome = one_shot_outcome(queue, state, home->id);
	if (outcome != POKEYS_OUTCOME_NONE)
		end(home, values, outcome_error(outcome, &state->engine));
	values->one_shot_failed_count += press_read(&home->cancel, queue, state);
	if (fresh)
		show(home, values, &state->engine);
}

static uint8_t group_of(const struct values *values, unsigned int joint)
{
	const uint32_t group = values->joint[joint].home_group;
	unsigned int joints = 1u << joint;

	for (unsigned int i = 0; group && i < POKEYS_AXES; i++)
		joints |= (values->joint[i].home_group == group ? 1u : 0u) << i;
	return (uint8_t)joints;
}

static void look_at_pins(struct joint_home *home, struct values *values, bool fresh)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const uint8_t bit = (uint8_t)(1u << i);
		const bool pressed = values->joint[i].home && home->up & bit;

		home->up = values->joint[i].home ? home->up & (uint8_t)~bit : home->up | bit;
		if (pressed && fresh)
			home->wanted |= group_of(values, i) & (uint8_t)~home->mask;
		else if (pressed)
			end(home, values, OUTCOME_REFUSED);
	}
}

/* Offsets in pulses. False if one of these joints has none that can be used. */
static bool offsets(struct joint_home *home, const struct joint joint[POKEYS_AXES],
		    struct pokeys_one_shot *shot)
{
	bool good = true;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const double pulses = (home->offset[i].used + joint[i].offset) * joint[i].scale;

		if (!(shot->mask >> i & 1))
			continue;
		good = good && !home->offset[i].bad && fabs(pulses) <= JOINT_POSITION_MOST;
		shot->value[i] = good ? (int32_t)lrint(pulses) : 0;
	}
	return good;
}

static void judge(struct joint_home *home, const struct values *values, struct refusals *refusals)
{
	double limit = factor_take(&home->time_limit, refusals, values->homing.time_limit,
				   offsetof(struct values, homing.time_limit));

	refusal_mark(refusals, &home->limit_bad, !(limit >= 0 && limit <= LIMIT_MOST_S),
		     offsetof(struct values, homing.time_limit), REFUSAL_RANGE, limit);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		factor_take(&home->offset[i], refusals, values->joint[i].home_offset,
			    JOINT(i, home_offset));
}

/* Ask for the next group. Returns true if there is no room for it now. */
static bool ask(struct joint_home *home, struct values *values,
		const struct joint joint[POKEYS_AXES], struct one_shot_queue *queue,
		struct pokeys_command *command)
{
	const unsigned int first = (unsigned int)__builtin_ctz(home->wanted);
	struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_HOME,
		.mask = group_of(values, first),
		.flags = POKEYS_HOME_FINISH_ITSELF,
		.parameter = { (float)home->time_limit.used },
	};
	enum one_shot_push pushed;

	if (!offsets(home, joint, &shot) || home->limit_bad || home->time_limit.bad) {
		end(home, values, OUTCOME_REFUSED);
		return false;
	}
	pushed = one_shot_push(queue, command, &shot, &home->id);
	if (pushed != ONE_SHOT_QUEUED)
		return pushed == ONE_SHOT_FULL;
	home->open = true;
	home->mask = shot.mask;
	home->wanted &= (uint8_t)~shot.mask;
	return false;
}

bool joint_home_write(struct joint_home *home, struct values *values,
		      const struct joint joint[POKEYS_AXES], struct one_shot_queue *queue,
		      struct pokeys_command *command, const struct pokeys_engine *engine,
		      bool fresh, struct refusals *refusals)
{
	static const struct pokeys_one_shot cancel = { .operation = POKEYS_ONE_SHOT_HOME_CANCEL };
	struct press_news news;

	judge(home, values, refusals);
	look_at_pins(home, values, fresh);
	news = press_write(&home->cancel, values->homing.cancel, &cancel, queue, command);
	values->one_shot_failed_count += news.failed;
	if (home->cancel.state != PRESS_IDLE)
		home->wanted = 0;
	else if (home->wanted && !home->open && fresh && engine->task_phase == POKEYS_TASK_IDLE)
		news.full |= ask(home, values, joint, queue, command);
	return news.full;
}

void joint_home_forget(struct joint_home *home, struct values *values)
{
	if (home->open)
		end(home, values, OUTCOME_NOT_KNOWN);
	home->wanted = 0;
	values->one_shot_failed_count += press_forget(&home->cancel);
}
