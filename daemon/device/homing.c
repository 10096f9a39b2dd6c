/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing by the device (protocol sections 3.24.3 and 5.3): 0x21 begins it for
 * a group of axes, 0x22 ends it. Algorithm, speeds, back-off and index are
 * settings of the axes; offsets come with the one-shot.
 *
 * A group is one request: the engine counts as homed when all of its axes
 * are. One axis of a gantry that is homed alone is not homed, so the flags of
 * the whole group fall when it begins, and stay so unless all has gone well.
 *
 * 0x22 leaves the engine's state to 0x02, as the vendor's library does. The
 * stop that follows says the same about the axes, so it is not needed to know
 * whether 0x22 was executed.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define LIMIT_MAX_S 3600

static bool is_working(uint8_t state)
{
	return state == WIRE_ENGINE_HOMING;
}

static bool is_complete(uint8_t state)
{
	return state == WIRE_ENGINE_HOME;
}

bool task_limit_good(float seconds)
{
	return isfinite(seconds) && seconds >= 0 && seconds <= LIMIT_MAX_S;
}

/* An axis without one would go on until its time limit. Not judged before the device has told. */
static bool has_home_switch(const struct device *device, unsigned int axis)
{
	const struct pokeys_axis_settings *known = &device->wishes.known.axis[axis];

	return !known->switches_mask ||
	       known->switches & (WIRE_SWITCH_HOME | WIRE_SWITCH_HOME_ON_N | WIRE_SWITCH_HOME_ON_P);
}

static struct refusal why_not_axis(const struct device *device, unsigned int axis, int32_t offset)
{
	if (!motion_drivable(device, axis))
		return refusal(REFUSAL_AXIS_OFF, axis);
	if (!has_home_switch(device, axis))
		return refusal(REFUSAL_NO_HOME_SWITCH, axis);
	return refusal(offset > MOTION_POSITION_MAX || offset < -MOTION_POSITION_MAX ?
			       REFUSAL_POSITION :
			       REFUSAL_NONE,
		       axis);
}

struct refusal homing_why_not(const struct device *device, const struct pokeys_one_shot *shot)
{
	struct refusal why = task_why_not(device, false, shot);

	if (!why.reason && !shot->mask)
		why = refusal(REFUSAL_NO_AXIS, 0);
	for (unsigned int i = 0; i < POKEYS_AXES && !why.reason; i++)
		if (shot->mask >> i & 1)
			why = why_not_axis(device, i, shot->value[i]);
	return why;
}

static bool start(struct device *device, pokeys_parser_t parser)
{
	const struct pokeys_one_shot *shot = &device->task.shot;
	struct wire_pulse_home_start_req request = { .mask = shot->mask };

	memcpy(request.offset, shot->value, sizeof(request.offset));
	return request_send(device, WIRE_OP_PULSE_HOME_START, &request, parser, NULL, NULL);
}

static bool finish(struct device *device, pokeys_parser_t parser)
{
	static const struct wire_pulse_home_finish_req request = { .keep_state = 1 };

	return request_send(device, WIRE_OP_PULSE_HOME_FINISH, &request, parser, NULL, NULL);
}

static uint8_t take(struct device *device, const mailbox_entry_t *entry)
{
	(void)device;
	(void)entry;
	return POKEYS_TASK_DONE;
}

const struct task_kind task_homing = {
	.limit_ns = 120 * SECOND,
	.is_working = is_working,
	.is_complete = is_complete,
	.waits = true,
	.start = start,
	.finish = finish,
	.take = take,
};
