/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The encoders of servo motors: nobody else may change their counts. The axis would be somewhere
 * else all at once, and its controller would push it back.
 */

#include "daemon/device/internal.h"

/* Its index input would set the counter of this encoder to 0, and the axis to another place. */
bool servoing_index_resets(const struct device *device, uint8_t encoder)
{
	const struct wire_fast_encoders_rep *fast =
		&device->configure.setting[SETTING_FAST_ENCODERS].value.fast;

	return encoder < device->image.capability.fast_encoders &&
	       (fast->status & 0x0F) != WIRE_FAST_OFF && fast->index & 1;
}

/* Counters are written thirteen at a time, and one that turns meanwhile loses counts. */
bool servoing_may_write(const struct device *device, unsigned int encoder)
{
	for (unsigned int i = 0; i < device->servoings.count; i++) {
		const unsigned int own = device->config.servo[i].encoder;
		const bool beside = own / WIRE_ENCODER_BANK == encoder / WIRE_ENCODER_BANK;

		if (own == encoder || (beside && device->servoings.servoing[i].servo.enabled))
			return false;
	}
	return true;
}

bool servoing_may_arm(const struct device *device, unsigned int encoder)
{
	const unsigned int fast = device->image.capability.fast_encoders;

	for (unsigned int i = 0; i < device->servoings.count; i++) {
		const unsigned int own = device->config.servo[i].encoder;

		if (own == encoder || (own < fast && encoder < fast))
			return false;
	}
	return true;
}

void servoing_written(struct device *device, uint32_t encoders)
{
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		if (encoders >> i & 1)
			device->servoings.counts_epoch[i]++;
}
