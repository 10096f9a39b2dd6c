/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Probing by the device (protocol sections 3.24.3 and 5.3): 0x23 begins it,
 * 0x24 hands out the positions that were latched in the slot of the contact,
 * exact to the pulse whatever the network did meanwhile.
 *
 * In plain probing the device moves; in hybrid probing the commander does and
 * the device watches, latches and stops. There the commander's command goes on
 * beyond the contact, so all axes are parked by it. If nothing was touched
 * when the commander ends it, the engine simply goes on running.
 *
 * 0x24 only reads and clears, so it may be repeated; the state is left to the
 * stop that follows.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define FLAGS (POKEYS_PROBE_ACTIVE_HIGH | POKEYS_PROBE_HYBRID)
#define INPUTS_EXTERNAL 8

static bool is_working(uint8_t state)
{
	return state == WIRE_ENGINE_PROBING;
}

static bool is_complete(uint8_t state)
{
	return state == WIRE_ENGINE_PROBE_COMPLETE || state == WIRE_ENGINE_PROBE_ERROR;
}

static bool hybrid_is_working(uint8_t state)
{
	return state == WIRE_ENGINE_RUNNING || state == WIRE_ENGINE_HYBRID_STOPPING;
}

static bool hybrid_is_complete(uint8_t state)
{
	return state == WIRE_ENGINE_HYBRID_COMPLETE;
}

static struct refusal why_not_axis(const struct device *device, unsigned int i, int32_t target)
{
	const struct pokeys_axis *axis = &device->image.engine.axis[i];

	if (!motion_drivable(device, i))
		return refusal(REFUSAL_AXIS_OFF, i);
	if (axis->mode == POKEYS_AXIS_BUFFERED)
		return refusal(REFUSAL_AXIS_BUFFERED, i);
	if (target > MOTION_POSITION_MAX || target < -MOTION_POSITION_MAX)
		return refusal(REFUSAL_POSITION, i);
	return refusal(intake_beyond_soft_limits(device, i, axis->position, target) ?
			       REFUSAL_SOFT_LIMIT :
			       REFUSAL_NONE,
		       i);
}

static struct refusal why_not_hybrid(const struct device *device,
				     const struct pokeys_one_shot *shot)
{
	if (shot->mask)
		return refusal(REFUSAL_HYBRID_AXES, 0);
	return refusal(device->motion.phase == MOTION_ON ? REFUSAL_NONE : REFUSAL_ENGINE_OFF, 0);
}

struct refusal probing_why_not(const struct device *device, const struct pokeys_one_shot *shot)
{
	const bool hybrid = shot->flags & POKEYS_PROBE_HYBRID;
	const float speed = shot->parameter[1];
	struct refusal why = task_why_not(device, hybrid, shot);

	if (why.reason)
		return why;
	if (shot->flags & ~FLAGS)
		return refusal(REFUSAL_VALUE, 0);
	if (!shot->index || shot->index > POKEYS_PINS + INPUTS_EXTERNAL)
		return refusal(REFUSAL_PROBE_INPUT, 0);
	if (hybrid)
		return why_not_hybrid(device, shot);
	if (!shot->mask)
		return refusal(REFUSAL_NO_AXIS, 0);
	if (!isfinite(speed) || !(speed > 0) || speed > 1)
		return refusal(REFUSAL_VALUE, 0);
	for (unsigned int i = 0; i < POKEYS_AXES && !why.reason; i++)
		if (shot->mask >> i & 1)
			why = why_not_axis(device, i, shot->value[i]);
	return why;
}

static bool start(struct device *device, pokeys_parser_t parser)
{
	const struct pokeys_one_shot *shot = &device->task.shot;
	struct wire_pulse_probe_start_req request = {
		.mask = shot->mask,
		.speed = shot->parameter[1],
		.input = shot->index,
		.hybrid = !!(shot->flags & POKEYS_PROBE_HYBRID),
		.polarity = !!(shot->flags & POKEYS_PROBE_ACTIVE_HIGH),
	};

	memcpy(request.limit, shot->value, sizeof(request.limit));
	return request_send(device, WIRE_OP_PULSE_PROBE_START, &request, parser, NULL, NULL);
}

static bool finish(struct device *device, pokeys_parser_t parser)
{
	static const struct wire_pulse_probe_finish_req request = { .keep_state = 1 };

	return request_send(device, WIRE_OP_PULSE_PROBE_FINISH, &request, parser, NULL, NULL);
}

static uint8_t take(struct device *device, const mailbox_entry_t *entry)
{
	struct pokeys_engine *engine = &device->image.engine;
	struct wire_pulse_probe_finish_rep reply;

	wire_pulse_probe_finish_decode_rep(entry->response_buffer, &reply);
	engine->probe_status = reply.status;
	if (!reply.status)
		return POKEYS_TASK_NOT_FOUND;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		engine->axis[i].probe = reply.position[i];
	return POKEYS_TASK_DONE;
}

const struct task_kind task_probing = {
	.limit_ns = 60 * SECOND,
	.is_working = is_working,
	.is_complete = is_complete,
	.start = start,
	.finish = finish,
	.take = take,
};

const struct task_kind task_hybrid = {
	.limit_ns = 60 * SECOND,
	.beside = true,
	.is_working = hybrid_is_working,
	.is_complete = hybrid_is_complete,
	.start = start,
	.finish = finish,
	.take = take,
};
