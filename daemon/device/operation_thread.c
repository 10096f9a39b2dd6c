/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The one-shots of threading, and why one of them is not taken.
 *
 * Nothing of them waits in the queue for the spindle, for what ends it comes through
 * the same queue: their outcomes come when the task (threading.c) knows them. Cancel
 * alone stays at work until the engine stands.
 */

#include "daemon/device/internal.h"

static bool settings_taken(const struct device *device)
{
	const struct setting *setting = &device->configure.setting[SETTING_THREADING];
	const struct wire_thread_params_req *params = &device->threading.params;

	return setting->state == SETTING_DONE && device->threading.written &&
	       device->wishes.wanted.set & POKEYS_SET_THREADING && params->target_rpm &&
	       (params->ticks || !(params->mode & WIRE_THREAD_ENCODER));
}

static uint8_t why_not_begin(const struct device *device)
{
	if (!task_limit_good(device->one_shots.now.parameter[0]))
		return POKEYS_THREADING_BAD_LIMIT;
	if (!task_may_begin(device, true) || device->threading.dirty)
		return POKEYS_THREADING_BUSY;
	if (!settings_taken(device))
		return POKEYS_THREADING_NOT_SET;
	if (device->motion.phase != MOTION_ON || !threading_axes_of(device))
		return POKEYS_THREADING_NO_AXIS;
	return buffer_settled(device) ? POKEYS_THREADING_WELL : POKEYS_THREADING_MOVING;
}

static uint8_t why_not(const struct device *device)
{
	const struct threading *threading = &device->threading;
	const bool works = device->image.engine.task_phase == POKEYS_TASK_WORKING;

	if (!device->safe.permitted)
		return POKEYS_THREADING_OFF;
	switch (device->one_shots.now.operation) {
	case POKEYS_ONE_SHOT_THREAD_ARM:
		return !threading_ours(device) || threading_step_seen(device) != THREAD_PREPARED ?
			       POKEYS_THREADING_NOT_PREPARED :
		       threading->arm.open ? POKEYS_THREADING_BUSY :
					     POKEYS_THREADING_WELL;
	case POKEYS_ONE_SHOT_THREAD_RELEASE:
		return threading_ours(device) && works ? POKEYS_THREADING_WELL :
							 POKEYS_THREADING_NOT_BEGUN;
	default:
		return why_not_begin(device);
	}
}

static bool refused(struct device *device)
{
	const uint8_t why = why_not(device);

	device->image.threading.refused = why;
	if (why == POKEYS_THREADING_WELL)
		return false;
	device_say(device, EVENT_THREADING, EVENT_WARNING, device->one_shots.now.operation, why, 0);
	one_shot_end(device, POKEYS_OUTCOME_REFUSED);
	return true;
}

static bool prepare_send(struct device *device)
{
	struct pokeys_one_shot shot = device->one_shots.now;
	const uint8_t axes = threading_axes_of(device);
	struct threading *threading = &device->threading;

	if (refused(device))
		return false;
	one_shot_release(device);
	shot.mask = 0; /* they go on following the command */
	task_begin(device, POKEYS_TASK_THREADING, &shot);
	device->image.engine.task_axes = axes;
	device->task.parked |= buffer_axes(device) & (uint8_t)~axes;
	threading->step = THREAD_NONE;
	threading->spoilt = 0;
	threading->arm_tries = 0;
	threading->arm.open = threading->release.open = threading->released = false;
	threading->stretched = true;
	threading->heard_ns = threading->step_ns = device->now_ns;
	buffer_stretch(device);
	return false;
}

static struct thread_shot later(struct device *device)
{
	const struct pokeys_one_shot *shot = &device->one_shots.now;
	const struct thread_shot kept = {
		.open = true,
		.id = shot->id,
		.operation = shot->operation,
		.since_ns = device->now_ns,
	};

	one_shot_release(device);
	return kept;
}

static bool arm_shot_send(struct device *device)
{
	if (!refused(device))
		device->threading.arm = later(device);
	return false;
}

static bool release_shot_send(struct device *device)
{
	if (refused(device))
		return false;
	device->threading.release = later(device);
	task_finish(device);
	return false;
}

static bool cancel_shot_send(struct device *device)
{
	if (threading_ours(device))
		task_cancel(device);
	if (task_idle(device) || device->image.engine.task != POKEYS_TASK_THREADING)
		one_shot_end(device,
			     threading_dirty(device) ? POKEYS_OUTCOME_FAILED : POKEYS_OUTCOME_DONE);
	return false;
}

const struct operation operation_thread_begin = { .send = prepare_send };
const struct operation operation_thread_arm = { .send = arm_shot_send };
const struct operation operation_thread_release = { .send = release_shot_send };
const struct operation operation_thread_cancel = { .send = cancel_shot_send };
