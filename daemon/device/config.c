/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a device's configuration says when nobody says anything.
 *
 * A setting of the device itself has no default here: "leave it as the device
 * has it" is the only answer that cannot turn a motor the wrong way. The
 * daemon's own times are chosen for a loop of 1 kHz: an answer takes under a
 * millisecond, a cable that was touched is out for some tens of them, and a
 * servo thread that has been silent for a tenth of a second is dead.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/device.h"

#define MS UINT64_C(1000000)

static void axis_defaults(struct device_axis_config *axis)
{
	axis->mode = POKEYS_AXIS_OFF;
	axis->invert = -1;
	axis->max_speed = NAN;
	axis->max_acceleration = NAN;
	axis->max_deceleration = NAN;
	axis->soft_limits = -1;
}

void device_config_defaults(struct device_config *config)
{
	memset(config, 0, sizeof(*config));
	config->port = 20055;
	config->period_ns = 1 * MS;
	config->heartbeat_timeout_ns = 100 * MS;
	config->stale_after_ns = 8 * MS;
	config->lost_after_ns = 200 * MS;
	config->fast_divider = 1;
	config->slow_hz = 5;
	config->encoder_hz = 50;
	config->analog_hz = 50;
	config->emergency_pin = -1;
	config->fast_encoders = -1;
	config->ultra_fast_encoder = -1;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		axis_defaults(&config->axis[i]);
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		config->encoder[i].sampling = 4;
		config->encoder[i].pin_a = 255;
		config->encoder[i].pin_b = 255;
	}
}
