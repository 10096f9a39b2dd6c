/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The one-shots that begin, cancel and finish homing, probing and jogging.
 *
 * Homing takes seconds, and what cancels it is a one-shot too. So one that
 * begins a task is taken off the queue when the task has it; its outcome comes
 * when the task knows it. Those that end a task stay at work until the engine
 * stands: their outcome is the proof that nothing moves any more.
 */

#include "daemon/device/internal.h"

static bool begin(struct device *device, uint8_t task, struct refusal why)
{
	struct pokeys_one_shot shot = device->one_shots.now;

	if (why.reason) {
		one_shot_refuse(device, why);
		return false;
	}
	one_shot_release(device);
	task_begin(device, task, &shot);
	return false;
}

static bool home_send(struct device *device)
{
	return begin(device, POKEYS_TASK_HOMING, homing_why_not(device, &device->one_shots.now));
}

static bool probe_send(struct device *device)
{
	const struct pokeys_one_shot *shot = &device->one_shots.now;
	const uint8_t task = shot->flags & POKEYS_PROBE_HYBRID ? POKEYS_TASK_HYBRID_PROBING :
								 POKEYS_TASK_PROBING;

	return begin(device, task, probing_why_not(device, shot));
}

static bool is_homing(const struct device *device)
{
	return device->image.engine.task == POKEYS_TASK_HOMING;
}

static struct refusal why_not_finish(const struct device *device,
				     const struct pokeys_one_shot *shot)
{
	const struct refusal why = operation_needs_engine(device, shot);
	const bool over = task_idle(device) || device->image.engine.task_result == POKEYS_TASK_DONE;

	if (why.reason)
		return why;
	if (!is_homing(device))
		return refusal(REFUSAL_NOTHING_TO_FINISH, 0);
	return refusal(over ? REFUSAL_NONE : REFUSAL_BUSY, 0);
}

/* Once, then wait. */
static bool end_send(struct device *device, bool (*act)(struct device *device))
{
	if (!device->one_shots.step && !task_idle(device))
		act(device);
	device->one_shots.step = 1;
	return task_idle(device);
}

static bool cancel(struct device *device)
{
	task_cancel(device);
	return true;
}

static bool finish_or_cancel(struct device *device)
{
	return task_finish(device) || cancel(device);
}

static bool home_cancel_send(struct device *device)
{
	if (end_send(device, cancel))
		one_shot_end(device, motion_standing(device) || device->motion.phase != MOTION_OFF ?
					     POKEYS_OUTCOME_DONE :
					     POKEYS_OUTCOME_FAILED);
	return false;
}

static bool home_finish_send(struct device *device)
{
	if (end_send(device, task_finish))
		one_shot_end(device, device->image.engine.task_result == POKEYS_TASK_DONE ?
					     POKEYS_OUTCOME_DONE :
					     POKEYS_OUTCOME_FAILED);
	return false;
}

static bool probe_finish_send(struct device *device)
{
	if (end_send(device, finish_or_cancel))
		one_shot_end(device, POKEYS_OUTCOME_DONE);
	return false;
}

static bool jog_send(struct device *device)
{
	device->one_shots.now.mask = jogging_axes(device);
	return begin(device, POKEYS_TASK_JOGGING, jogging_why_not(device, &device->one_shots.now));
}

/* It has no end of its own: this is the good one. */
static bool jog_finish(struct device *device)
{
	if (device->image.engine.task != POKEYS_TASK_JOGGING)
		return false;
	return task_finish(device) || cancel(device);
}

static bool jog_end_send(struct device *device)
{
	if (end_send(device, jog_finish))
		one_shot_end(device, POKEYS_OUTCOME_DONE);
	return false;
}

const struct operation operation_home = { .why_not = homing_why_not, .send = home_send };
const struct operation operation_home_cancel = {
	.why_not = operation_needs_engine,
	.send = home_cancel_send,
};
const struct operation operation_home_finish = {
	.why_not = why_not_finish,
	.send = home_finish_send,
};
const struct operation operation_probe = { .why_not = probing_why_not, .send = probe_send };
const struct operation operation_probe_finish = {
	.why_not = operation_needs_engine,
	.send = probe_finish_send,
};
const struct operation operation_jog = { .why_not = jogging_why_not, .send = jog_send };
const struct operation operation_jog_end = {
	.why_not = operation_needs_engine,
	.send = jog_end_send,
};
