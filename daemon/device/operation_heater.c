/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One-shots of heaters. Nothing goes to the device, so they are done or refused at once.
 */

#include <math.h>
#include "daemon/device/internal.h"

static bool reset_send(struct device *device)
{
	const bool done = heating_reset(device, device->one_shots.now.index);

	one_shot_end(device, done ? POKEYS_OUTCOME_DONE : POKEYS_OUTCOME_REFUSED);
	return false;
}

static bool tune_allowed(const struct device *device, const struct pokeys_one_shot *shot)
{
	(void)device;
	return isfinite(shot->parameter[0]) && shot->parameter[0] >= 0;
}

static bool tune_send(struct device *device)
{
	const struct pokeys_one_shot *shot = &device->one_shots.now;
	const bool done = heating_tune(device, shot->index, (double)shot->parameter[0]);

	one_shot_end(device, done ? POKEYS_OUTCOME_DONE : POKEYS_OUTCOME_REFUSED);
	return false;
}

const struct operation operation_heater_reset = { NULL, reset_send, NULL, NULL };
const struct operation operation_heater_tune = { tune_allowed, tune_send, NULL, NULL };
