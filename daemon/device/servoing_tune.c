/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device's servo motors search for their gains (daemon/loops/servo_tune.h): who begins that, and
 * what is said of it. The gains that are found are shown, and change nothing.
 *
 * Readings of the encoder come with the times of the device's answers; what is written in a doubt
 * (plan.c) is not what was asked for, so a doubt ends the search.
 */

#include <string.h>
#include "daemon/device/internal.h"

/* The image shows the numbers of the loops. */
#define SAME(a, b) _Static_assert((int)(a) == (int)(b), #a " is not " #b)
SAME(SERVO_TUNE_RUNS, POKEYS_SERVO_TUNING_RUNS);
SAME(SERVO_TUNE_FAILED, POKEYS_SERVO_TUNING_FAILED);
SAME(SERVO_TUNE_REVERSED, POKEYS_SERVO_TUNE_REVERSED);
SAME(SERVO_TUNE_LATE, POKEYS_SERVO_TUNE_LATE);

static void say(struct device *device, unsigned int index)
{
	struct servoing *servoing = &device->servoings.servoing[index];
	const struct servo_tune *tune = &servoing->tune;

	servoing->tuning = (uint8_t)tune->state;
	device_say(device, EVENT_SERVO_TUNED,
		   tune->state == SERVO_TUNE_FAILED ? EVENT_WARNING : EVENT_NOTICE, index,
		   tune->state, tune->reason);
}

bool servoing_tunes(const struct device *device, unsigned int index)
{
	return device->servoings.servoing[index].tune.state == SERVO_TUNE_RUNS;
}

void servoing_tune_step(struct device *device, unsigned int index, bool settled)
{
	const struct servoing_config *config = &device->config.servo[index];
	struct servoing *servoing = &device->servoings.servoing[index];
	const double output = servoing->servo.output;
	const bool applied = settled && drive_passes(&servoing->drive, &config->drive,
						     config->inverted ? -output : output);

	if (plan_doubts(device))
		servo_tune_abort(&servoing->tune);
	if (servo_tune_step(&servoing->tune, &servoing->servo, applied, device->now_ns) ||
	    (servoing->tuning == SERVO_TUNE_RUNS && !servoing_tunes(device, index)))
		servo_off(&servoing->servo);
	if (servoing->tune.state != (enum servo_tune_state)servoing->tuning)
		say(device, index);
}

void servoing_tune_show(struct device *device, unsigned int index)
{
	const struct servo_tune *tune = &device->servoings.servoing[index].tune;
	struct pokeys_servo *image = &device->image.servo[index];

	image->tuning = (uint8_t)tune->state;
	image->tune_reason = (uint8_t)tune->reason;
	image->tuned_p = (float)tune->gains.p;
	image->tuned_i = (float)tune->gains.i;
	image->tuned_d = (float)tune->gains.d;
	image->tuned_velocity_gain = (float)tune->gains.velocity;
	image->tuned_acceleration_gain = (float)tune->gains.acceleration;
	image->tuned_acceleration = (float)tune->rate;
}

/* One that holds its place after homing or a path is as any other. */
static bool begin(struct device *device, unsigned int index, double distance, double most)
{
	struct servoing *servoing = &device->servoings.servoing[index];

	if (moving_moves(device, index) || servo_home_moves(&servoing->home) ||
	    !servo_tune_begin(&servoing->tune, &servoing->servo, distance, most, device->now_ns))
		return false;
	moving_leave(device, index);
	return servo_home_leave(&servoing->home);
}

bool servoing_tune(struct device *device, unsigned int index, double distance, double most)
{
	struct servo_tune *tune;

	if (index >= device->servoings.count)
		return false;
	tune = &device->servoings.servoing[index].tune;
	if (distance == 0 ? !servo_tune_abort(tune) : !begin(device, index, distance, most))
		return false;
	if (tune->state == SERVO_TUNE_RUNS)
		say(device, index);
	servoing_tune_show(device, index);
	return true;
}
