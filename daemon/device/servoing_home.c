/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing of a device's servo motors (daemon/loops/servo_home.h): where the home switch is read, who
 * begins it, and what is said of it.
 *
 * The home switch may be the limit switch in the direction of the search. Until the motor stands
 * again, this switch does not stop it, and the way that it may go is what limits it.
 */

#include <math.h>
#include "daemon/device/internal.h"

/* The image shows the numbers of the loops. */
#define SAME(a, b) _Static_assert((int)(a) == (int)(b), #a " is not " #b)
SAME(SERVO_HOME_IDLE, POKEYS_SERVO_HOMING_NONE);
SAME(SERVO_HOME_APPROACH, POKEYS_SERVO_HOMING_APPROACH);
SAME(SERVO_HOME_STATES, POKEYS_SERVO_HOMING_HOLD + 1);
SAME(SERVO_HOME_STOPPED, POKEYS_SERVO_HOME_STOPPED);
SAME(SERVO_HOME_ENDS, POKEYS_SERVO_HOME_UNREAD + 1);

static void say(struct device *device, unsigned int index, enum servo_home_end end)
{
	const double position = device->servoings.servoing[index].servo.position;

	device->servoings.servoing[index].home_end = (uint8_t)end;
	device_say(device, EVENT_SERVO_HOME,
		   end == SERVO_HOME_NONE || end == SERVO_HOME_DONE ? EVENT_NOTICE : EVENT_WARNING,
		   index, end, llround(position * 1000));
}

static bool is_active(const struct device *device, const struct servoing_config *config)
{
	return config->home.search != 0 &&
	       servoing_is_pressed(device, config->home_pin, config->home_inverted);
}

/* The home switch is the limit switch in the direction of the search. */
static bool is_limit(const struct servoing_config *config)
{
	return config->home_pin == (config->home.search < 0 ? config->low : config->high);
}

bool servoing_seeks(const struct device *device, unsigned int index, bool low)
{
	const struct servoing_config *config = &device->config.servo[index];

	return config->home_pin == (low ? config->low : config->high) &&
	       (config->home.search < 0) == low &&
	       servo_home_moves(&device->servoings.servoing[index].home);
}

void servoing_home_step(struct device *device, unsigned int index, struct servo_wish *wish)
{
	const struct servoing_config *config = &device->config.servo[index];
	struct servoing *servoing = &device->servoings.servoing[index];
	/* in a doubt, by another device perhaps */
	const bool is_read = servoing_is_as_wanted(device, config->home_pin, WIRE_PIN_INPUT) &&
			     !plan_doubts(device);
	const struct servo_home_input input = {
		.active = is_active(device, config),
		.limit = is_limit(config),
		.read_ns = is_read ? device->image.t_digital_ns : 0,
	};

	servo_home_step(&servoing->home, &servoing->servo, &input, wish, device->now_ns);
	if (servoing->home.end != (enum servo_home_end)servoing->home_end)
		say(device, index, servoing->home.end);
}

void servoing_home_show(struct device *device, unsigned int index)
{
	const struct servoing_config *config = &device->config.servo[index];
	const struct servo_home *home = &device->servoings.servoing[index].home;
	struct pokeys_servo *image = &device->image.servo[index];

	image->homing = (uint8_t)home->state;
	image->home_end = (uint8_t)home->end;
	image->home = is_active(device, config);
}

bool servoing_home(struct device *device, unsigned int index, bool end)
{
	struct servoing *servoing;
	bool taken;

	if (index >= device->servoings.count || moving_moves(device, index) ||
	    servoing_tunes(device, index))
		return false;
	servoing = &device->servoings.servoing[index];
	taken = end ? servo_home_abort(&servoing->home, &servoing->servo) :
		      servo_home_begin(&servoing->home, &servoing->servo, device->now_ns);
	if (!taken)
		return false;
	moving_leave(device, index);
	say(device, index, servoing->home.end);
	servoing_home_show(device, index);
	return true;
}
