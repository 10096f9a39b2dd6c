/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Five buttons for the device's own threading, and what it says of itself. The daemon
 * judges each request; here its reason is shown.
 *
 * Meanwhile the axes are where the spindle has led them, which may be seconds behind the
 * command. LinuxCNC would take that for a motor that does not follow. So pos-fb of the
 * joints that take part is their command as long as it lasts (joint.c), and
 * following-error goes on telling the truth.
 */
#include "halbridge/threading.h"
#include <stddef.h>
#include <string.h>
#include "halbridge/outcome.h"

#define LIMIT_MOST_S	3600

static const uint8_t operations[THREADING_BUTTONS] = {
	[THREADING_PREPARE] = POKEYS_ONE_SHOT_THREAD_PREPARE,
	[THREADING_FORCE] = POKEYS_ONE_SHOT_THREAD_FORCE,
	[THREADING_ARM] = POKEYS_ONE_SHOT_THREAD_ARM,
	[THREADING_RELEASE] = POKEYS_ONE_SHOT_THREAD_RELEASE,
	[THREADING_CANCEL] = POKEYS_ONE_SHOT_THREAD_CANCEL,
};

void threading_init(struct threading *threading)
{
	memset(threading, 0, sizeof(*threading));
	threading->time_limit = (struct factor){ .may_be_zero = true };
}

static void show(const struct threading *threading, struct values *values,
		 const struct pokeys_threading *from)
{
	const struct value_threading_out now = {
		.preparing = from->preparing,
		.prepared = from->prepared,
		.waiting = from->waiting,
		.active = from->active,
		.velocity = from->velocity,
		.position_error = from->position_error,
		.spindle_rpm = from->spindle_rpm,
		.index_count = from->index_count,
		.behind = from->behind,
		.error = threading->error,
		.reason = threading->reason,
		.refused = threading->reason != POKEYS_THREADING_WELL,
	};

	if (!memcmp(&now, &values->threading.out, sizeof(now)))
		return;
	values->threading.out = now;
	values_changed(values, BLOCK_ENGINE);
}

/* How the last one ended, whoever began it. */
static void look_for_end(struct threading *threading, const struct pokeys_engine *engine)
{
	const bool ended = threading->begun && engine->task_count != threading->ended;

	threading->begun = true;
	threading->ended = engine->task_count;
	if (ended && engine->task == POKEYS_TASK_THREADING)
		threading->error = engine->task_result == POKEYS_TASK_DONE ? OUTCOME_WELL :
									     engine->task_result;
}

void threading_read(struct threading *threading, struct values *values,
		    const struct one_shot_queue *queue, const struct pokeys_state *state,
		    bool fresh)
{
	for (unsigned int i = 0; i < THREADING_BUTTONS; i++) {
		struct press *press = &threading->press[i];
		const bool open = press->state == PRESS_QUEUED;

		values->one_shot_failed_count += press_read(press, queue, state);
		if (open && press->state == PRESS_IDLE && press->outcome == POKEYS_OUTCOME_REFUSED)
			/* without a link it is refused before anybody asks for a reason */
			threading->reason = state->link == POKEYS_LINK_RUNNING ?
						    state->threading.refused :
						    THREADING_NO_DAEMON;
	}
	if (!fresh)
		return;
	look_for_end(threading, &state->engine);
	show(threading, values, &state->threading);
}

static bool limit_is_good(struct threading *threading, const struct values *values,
			  struct refusals *refusals)
{
	const size_t at = offsetof(struct values, threading.time_limit);
	const double limit = factor_take(&threading->time_limit, refusals,
					 values->threading.time_limit, at);

	refusal_mark(refusals, &threading->limit_bad, !(limit >= 0 && limit <= LIMIT_MOST_S), at,
		     REFUSAL_RANGE, limit);
	return !threading->limit_bad && !threading->time_limit.bad;
}

bool threading_write(struct threading *threading, struct values *values,
		     struct one_shot_queue *queue, struct pokeys_command *command, bool fresh,
		     struct refusals *refusals)
{
	const struct value_threading *value = &values->threading;
	const bool pins[THREADING_BUTTONS] = {
		[THREADING_PREPARE] = value->prepare, [THREADING_FORCE] = value->force,
		[THREADING_ARM] = value->arm,         [THREADING_RELEASE] = value->release,
		[THREADING_CANCEL] = value->cancel,
	};
	const bool good = limit_is_good(threading, values, refusals);
	bool full = false;

	for (unsigned int i = 0; i < THREADING_BUTTONS; i++) {
		/* only what begins it has a limit; what ends it is never held up */
		const bool limited = i == THREADING_PREPARE || i == THREADING_FORCE;
		const bool ends = i == THREADING_RELEASE || i == THREADING_CANCEL;
		const bool well = good || !limited, asked = fresh || ends;
		const struct pokeys_one_shot shot = {
			.operation = operations[i],
			.parameter = { limited ? (float)threading->time_limit.used : 0 },
		};
		const bool edge = pins[i] && threading->press[i].up;
		struct press_news news;

		news = press_write(&threading->press[i], pins[i], asked && well ? &shot : NULL,
				   queue, command);
		if (edge)
			threading->reason = !asked ? (uint32_t)THREADING_NO_DAEMON :
					    well   ? POKEYS_THREADING_WELL :
						     POKEYS_THREADING_BAD_LIMIT;
		values->one_shot_failed_count += news.failed;
		full |= news.full;
	}
	return full;
}

void threading_forget(struct threading *threading, struct values *values)
{
	for (unsigned int i = 0; i < THREADING_BUTTONS; i++) {
		if (!press_forget(&threading->press[i]))
			continue;
		values->one_shot_failed_count++;
		threading->reason = THREADING_NO_DAEMON;
	}
	if (values->threading.out.preparing || values->threading.out.prepared ||
	    values->threading.out.waiting || values->threading.out.active)
		threading->error = OUTCOME_NOT_KNOWN;
	threading->begun = false;
}
