/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Jogging by the device (protocol sections 3.24.1 and 5.3): in engine state 10
 * each axis that is set up with an encoder follows it, through its own planner.
 *
 * The state has no mask: all axes in position mode with a hand wheel follow, for they
 * have a planner that does it, and all others stand.
 * So the task's axes are those, whatever the one-shot says. It is begun by
 * 0x02, which may be repeated: the wheels count from where they are at its
 * beginning. It ends by a stop like everything else.
 */

#include "daemon/device/internal.h"

static bool is_working(uint8_t state)
{
	return state == WIRE_ENGINE_JOGGING;
}

static bool is_complete(uint8_t state)
{
	(void)state;
	return false;
}

uint8_t jogging_axes(const struct device *device)
{
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct setting *setting = &device->configure.setting[SETTING_AXIS + i];

		if (motion_drivable(device, i) && setting->value.axis.config.mpg_encoder &&
		    device->image.engine.axis[i].mode == POKEYS_AXIS_POSITION)
			axes |= (uint8_t)(1u << i);
	}
	return axes;
}

struct refusal jogging_why_not(const struct device *device, const struct pokeys_one_shot *shot)
{
	const struct refusal why = task_why_not(device, false, shot);

	if (why.reason)
		return why;
	return refusal(jogging_axes(device) ? REFUSAL_NONE : REFUSAL_NO_HAND_WHEEL, 0);
}

static bool start(struct device *device, pokeys_parser_t parser)
{
	const struct wire_pulse_state_req request = {
		.state = WIRE_ENGINE_JOGGING,
		.limit_override = device->intake.limit_override,
		.enable_mask = motion_masked(device, device->task.shot.mask),
	};

	return request_send(device, WIRE_OP_PULSE_STATE, &request, parser, NULL, NULL);
}

/* Never asked for: it is stopped, not finished. */
static bool finish(struct device *device, pokeys_parser_t parser)
{
	(void)device;
	(void)parser;
	return false;
}

static uint8_t take(struct device *device, const mailbox_entry_t *entry)
{
	(void)device;
	(void)entry;
	return POKEYS_TASK_DONE;
}

const struct task_kind task_jogging = {
	.limit_ns = UINT64_MAX,
	.endless = true,
	.is_working = is_working,
	.is_complete = is_complete,
	.start = start,
	.finish = finish,
	.take = take,
};
