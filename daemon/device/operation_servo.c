/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One-shots of servo motors. Nothing goes to the device, so they are done or refused at once, also
 * while the device does not answer or has no place for another request.
 */

#include "daemon/device/internal.h"

static bool reset(struct device *device, const struct pokeys_one_shot *shot)
{
	return servoing_reset(device, shot->index);
}

static bool place(struct device *device, const struct pokeys_one_shot *shot)
{
	return servoing_place(device, shot->index, shot->value[0],
			      shot->flags & POKEYS_SERVO_HOMED);
}

static bool gain(struct device *device, const struct pokeys_one_shot *shot)
{
	return servoing_regain(device, shot->index, shot->mask, (double)shot->parameter[0]);
}

static bool home(struct device *device, const struct pokeys_one_shot *shot)
{
	return servoing_home(device, shot->index, shot->flags & POKEYS_SERVO_END_HOMING);
}

static bool tune(struct device *device, const struct pokeys_one_shot *shot)
{
	return servoing_tune(device, shot->index, (double)shot->parameter[0],
			     (double)shot->parameter[1]);
}

static bool move(struct device *device, const struct pokeys_one_shot *shot)
{
	return moving_add(device, shot);
}

static bool control(struct device *device, const struct pokeys_one_shot *shot)
{
	return moving_control(device, shot->index, (double)shot->parameter[0]);
}

const struct operation operation_servo_reset = { .act = reset };
const struct operation operation_servo_place = { .act = place };
const struct operation operation_servo_gain = { .act = gain };
const struct operation operation_servo_home = { .act = home };
const struct operation operation_servo_tune = { .act = tune };
const struct operation operation_move = { .act = move };
const struct operation operation_moves_control = { .act = control };
