/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Threading by the device (protocol sections 3.24.3 and 5.3): the slots of the
 * motion buffer are played by the spindle's turns instead of by the millisecond.
 *
 *	prepare --> preparing --> prepared --arm--> waiting --index--> active
 *	               |             |                 |                 |
 *	               +-------------+------ release --+-----------------+--> idle
 *
 * It is a task beside which the axes follow the command: the commander goes the way
 * as at the spindle's target speed, the device stretches it. So slots heap up here
 * and in the device while the spindle is slower than its target, and until its index;
 * a faster one empties the buffer. What the device plays is told by its positions
 * (buffer_status.c), never by a clock.
 *
 * A thread that was disturbed is scrap, and an axis that catches up breaks a tool. So
 * when the buffer runs dry in the middle of a motion, positions are not on the path,
 * too much waits, or the device leaves threading by itself, everything stops, as when
 * anybody aborts it: cancel (0x34) and the engine's stop, and the permission to move
 * goes, for the tool stands in the groove and the other axes would go on without it.
 * The task is over when a
 * status that was asked for afterwards shows neither; until one does, the engine is
 * not started again (buffer_ready()).
 *
 * What begins it is sent again only when a status has shown that it was not executed.
 * A copy that the network delivers later is looked for a second long.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define PREPARE_NS (5 * SECOND)		/* the buffer holds 128 ms */
#define ARM_NS (10 * SECOND)		/* until the first motion and the spindle's index */
#define BLIND_NS (500 * MS)		/* without a status */
#define WATCH_NS (1 * SECOND)		/* for copies that come late */

/* The axes that the spindle leads. */
uint8_t threading_axes_of(const struct device *device)
{
	return buffer_axes(device) & device->motion.driven &
	       (uint8_t)~device->threading.params.ignore_axes;
}

void threading_spoil(struct device *device, uint8_t result)
{
	if (threading_paces(device) && !device->threading.spoilt)
		device->threading.spoilt = result;
}

void threading_answer(struct device *device, struct thread_shot *shot, enum pokeys_outcome outcome)
{
	if (shot->open && device->task.session == device->intake.session)
		device_one_shot_outcome(device, shot->id, shot->operation, outcome);
	shot->open = false;
}

static bool is_working(uint8_t state)
{
	return state == WIRE_ENGINE_RUNNING;
}

static bool is_complete(uint8_t state)
{
	(void)state;
	return false;
}

static bool begun(const struct device *device)
{
	return threading_known(device) && threading_step_seen(device) != THREAD_NONE;
}

static bool start(struct device *device, pokeys_parser_t parser)
{
	const bool force = device->task.shot.operation == POKEYS_ONE_SHOT_THREAD_FORCE;

	if (device->buffer.open || device->buffer.doubt ||
	    (device->task.asked && !threading_known(device)))
		return false;
	threading_found(device);
	return request_send(device, force ? WIRE_OP_THREAD_FORCE : WIRE_OP_THREAD_PREPARE, NULL,
			    parser, NULL, NULL);
}

static bool finish(struct device *device, pokeys_parser_t parser)
{
	return request_send(device, WIRE_OP_THREAD_RELEASE, NULL, parser, NULL, NULL);
}

/* It is not known yet how it went. */
static uint8_t take(struct device *device, const mailbox_entry_t *entry)
{
	(void)device;
	(void)entry;
	return POKEYS_TASK_RESULT_NONE;
}

/* Those that are left must not go on by themselves. */
static void axis_is_gone(struct device *device)
{
	safe_permit_drop(device);
	task_stop(device, POKEYS_TASK_CANCELLED);
}

/* What ends it in any step; true if something does. */
static bool disturbed(struct device *device)
{
	const struct threading *threading = &device->threading;

	if (threading->spoilt)
		task_stop(device, threading->spoilt);
	else if (threading_axes_of(device) != device->image.engine.task_axes)
		axis_is_gone(device);
	else if (device->now_ns - threading->heard_ns >= BLIND_NS)
		task_stop(device, POKEYS_TASK_FAILED);
	return !threading_ours(device);
}

/* How long a step may take, but for the limit of the whole. */
static bool late(const struct device *device)
{
	const struct threading *threading = &device->threading;

	return (threading->step < THREAD_PREPARED &&
		device->now_ns - threading->step_ns >= PREPARE_NS) ||
	       (threading->arm.since_ns && threading->step < THREAD_ACTIVE &&
		device->now_ns - threading->arm.since_ns >= ARM_NS);
}

static void enter_step(struct device *device, uint8_t step)
{
	struct threading *threading = &device->threading;

	threading->step = step;
	threading->step_ns = device->now_ns;
	if (step >= THREAD_PREPARED)
		task_tell(device, POKEYS_OUTCOME_DONE);
	if (step >= THREAD_WAITING)
		threading_answer(device, &threading->arm, POKEYS_OUTCOME_DONE);
}

static void work(struct device *device)
{
	const uint8_t before = device->threading.step, step = threading_step_seen(device);

	if (disturbed(device))
		return;
	if (late(device)) {
		task_stop(device, POKEYS_TASK_TIMED_OUT);
		return;
	}
	if (!threading_known(device) || step == before)
		return;
	if (step < before)
		task_stop(device, POKEYS_TASK_FAILED); /* it has left it by itself */
	else
		enter_step(device, step);
}

/* Released: the device plays by the millisecond again, and nothing waits any more. */
static bool released(struct device *device)
{
	struct threading *threading = &device->threading;

	if (disturbed(device) || !threading_known(device) ||
	    threading_step_seen(device) != THREAD_NONE)
		return false;
	if (!threading->released)
		buffer_unstretch(device);
	threading->released = true;
	return buffer_caught_up(device);
}

static bool stopped(const struct device *device)
{
	return !device->threading.dirty;
}

static void ended(struct device *device)
{
	struct threading *threading = &device->threading;
	const uint8_t result = device->image.engine.task_result;
	const enum pokeys_outcome outcome = result == POKEYS_TASK_DONE ? POKEYS_OUTCOME_DONE :
					    result == POKEYS_TASK_LOST ? POKEYS_OUTCOME_UNKNOWN :
									 POKEYS_OUTCOME_FAILED;

	/* it would have been told if the device had ever waited for the index */
	threading_answer(device, &threading->arm,
			 result == POKEYS_TASK_LOST ? outcome : POKEYS_OUTCOME_FAILED);
	threading_answer(device, &threading->release, outcome);
	if (result == POKEYS_TASK_DONE)
		threading->dirty = false;
	threading->stretched = threading->released = false;
	threading->arm.since_ns = 0;
	threading->watch_until_ns = device->now_ns + WATCH_NS;
	device->image.threading.behind = 0;
}

const struct task_kind task_threading = {
	.limit_ns = 300 * SECOND,
	.finish_ns = 30 * SECOND,
	.beside = true,
	.scrap = true,
	.is_working = is_working,
	.is_complete = is_complete,
	.start = start,
	.begun = begun,
	.work = work,
	.finish = finish,
	.take = take,
	.released = released,
	.stopped = stopped,
	.ended = ended,
};
