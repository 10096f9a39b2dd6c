/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One-shots of heaters. Nothing goes to the device, so they are done or refused at once, also
 * while the device does not answer or has no place for another request.
 */

#include <math.h>
#include "daemon/device/internal.h"

static bool reset(struct device *device, const struct pokeys_one_shot *shot)
{
	return heating_reset(device, shot->index);
}

static bool tune(struct device *device, const struct pokeys_one_shot *shot)
{
	const float target = shot->parameter[0];

	return isfinite(target) && target >= 0 && heating_tune(device, shot->index, (double)target);
}

static bool gain(struct device *device, const struct pokeys_one_shot *shot)
{
	return heating_regain(device, shot->index, shot->mask, (double)shot->parameter[0]);
}

const struct operation operation_heater_reset = { .act = reset };
const struct operation operation_heater_tune = { .act = tune };
const struct operation operation_heater_gain = { .act = gain };
