/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Parameters of threading: what is wanted, what is written (protocol section
 * 3.24.3, 0x85/35 and 36).
 *
 * The device tells none of them but the axes it ignores. So what it has is what it
 * has acknowledged since it was found, and they are written once after each start, each
 * restart of its engine and each loss of the link. One that has forgotten them without
 * our knowing would say so by another mask only. They are written only where somebody
 * wants them, and asked for there and of an engine that is found running in buffered
 * mode: not every device may know these requests.
 */

#include <string.h>
#include "daemon/device/internal.h"

static bool has_thread(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.pulse_engine >= 2 &&
	       device->wishes.wanted.set & POKEYS_SET_THREADING;
}

static bool thread_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_THREADING;
}

static bool same(const struct wire_thread_params_req *a, const struct wire_thread_params_req *b)
{
	return a->mode == b->mode && a->ticks == b->ticks && a->target_rpm == b->target_rpm &&
	       a->speed_gain == b->speed_gain && a->position_gain == b->position_gain &&
	       a->ignore_axes == b->ignore_axes;
}

static uint64_t thread_merge(const struct pokeys_settings *want, unsigned int index,
			     const union setting_value *value, union setting_request *request)
{
	const struct setting_thread *have = &value->thread;
	struct wire_thread_params_req *params = &request->thread;

	memset(request, 0, sizeof(*request));
	if (!thread_wanted(want, index))
		return 0;
	params->mode = want->threading_mode;
	params->ticks = want->threading_ticks;
	params->target_rpm = want->threading_rpm;
	params->speed_gain = want->threading_speed_gain;
	params->position_gain = want->threading_position_gain;
	params->ignore_axes = want->threading_ignore;
	return !have->written || !same(params, &have->params) ||
	       have->status.ignore_axes != params->ignore_axes;
}

/* A restart of the engine that is still to come would take them away again. */
static bool thread_may_go(struct device *device, union setting_request *request)
{
	const uint8_t engine = device->configure.setting[SETTING_ENGINE].state;

	(void)request;
	return engine == SETTING_DONE || engine == SETTING_REFUSED;
}

static void thread_taken(struct device *device, const union setting_request *request)
{
	device->threading.params = request->thread;
	device->threading.written = true;
}

static void thread_learn(struct device *device, unsigned int index,
			 const union setting_value *value)
{
	struct setting_thread *have = &device->configure.setting[SETTING_THREADING].value.thread;
	const struct wire_thread_status_rep *status = &value->thread.status;

	(void)index;
	have->written = device->threading.written;
	have->params = device->threading.params;
	if (status->preparing || status->prepared || status->waiting || status->active)
		threading_found(device);
}

static void thread_report(struct pokeys_settings *known, unsigned int index,
			  const union setting_value *value)
{
	const struct wire_thread_params_req *params = &value->thread.params;

	(void)index;
	if (!value->thread.written)
		return;
	known->set |= POKEYS_SET_THREADING;
	known->threading_mode = params->mode;
	known->threading_ticks = params->ticks;
	known->threading_rpm = params->target_rpm;
	known->threading_speed_gain = params->speed_gain;
	known->threading_position_gain = params->position_gain;
	known->threading_ignore = value->thread.status.ignore_axes;
}

static int64_t thread_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->thread.params.target_rpm;
}

const struct setting_kind setting_thread = {
	.read = WIRE_OP_THREAD_STATUS,
	.write = WIRE_OP_THREAD_PARAMS,
	.name = POKEYS_SETTING_THREADING,
	.dispensable = true,
	.has = has_thread,
	.wanted = thread_wanted,
	.ask = setting_ask_zeros,
	.merge = thread_merge,
	.learn = thread_learn,
	.report = thread_report,
	.written = thread_written,
	.take_along = thread_may_go,
	.taken = thread_taken,
};
