/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a commander wants of PWM, PoExtBus, external outputs, PoNET, heaters and servo motors,
 * judged value by value like the rest of the image.
 *
 * A part that this device does not have is refused while something is commanded
 * in it: silence would look as if it were driven.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define KBD48_FLAGS (POKEYS_KBD48_LEDS | POKEYS_KBD48_BRIGHTNESS)

static bool any(const uint8_t *bytes, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		if (bytes[i])
			return true;
	}
	return false;
}

/* Whether to take this part; refused if it is commanded and the device has none. */
static bool offered(struct device *device, bool commanded, bool has, enum command_part part)
{
	if (!commanded)
		return true;
	if (running(device) && !has)
		intake_refuse(device, COMMAND_FAULT_NOT_OFFERED, part);
	return !running(device) || has;
}

static bool pwm_commanded(const struct pokeys_command *command)
{
	bool commanded = command->pwm_enable || command->pwm_period;

	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		commanded = commanded || command->pwm_duty[i];
	return commanded;
}

static void take_pwm(struct device *device, const struct pokeys_command *command)
{
	struct output_wish *wish = &device->intake.output;
	const uint32_t period = command->pwm_period ? command->pwm_period :
						      device->image.pwm_period;
	const uint32_t loops = loops_channels(device) | loops_channels_forbidden(device);

	if (!offered(device, pwm_commanded(command), device->image.capability.pwm,
		     COMMAND_PART_PWM))
		return;
	if (command->pwm_enable >> POKEYS_PWM) {
		intake_refuse(device, COMMAND_FAULT_PWM_CHANNEL, command->pwm_enable);
		wish->pwm_enable &= command->pwm_enable;
	} else {
		wish->pwm_enable = command->pwm_enable & ~loops;
	}
	if (command->pwm_enable & loops)
		intake_refuse(device, COMMAND_FAULT_PWM_LOOP,
			      __builtin_ctz(command->pwm_enable & loops));
	wish->pwm = wish->pwm || pwm_commanded(command);
	shared_pwm(device, wish->pwm_enable);
	if (loops_channels(device) && command->pwm_period &&
	    command->pwm_period != device->config.settings.pwm_period)
		intake_refuse(device, COMMAND_FAULT_PWM_PERIOD, command->pwm_period);
	else
		wish->pwm_period = command->pwm_period;
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		if (!period || command->pwm_duty[i] <= period)
			wish->pwm_duty[i] = command->pwm_duty[i];
		else
			intake_refuse(device, COMMAND_FAULT_PWM_DUTY, i);
	}
}

static void take_bus(struct device *device, const struct pokeys_command *command)
{
	struct output_wish *wish = &device->intake.output;
	const uint8_t *mask = command->poextbus_mask;

	if (!offered(device, any(mask, sizeof(command->poextbus_mask)),
		     device->image.capability.poextbus, COMMAND_PART_POEXTBUS))
		return;
	if (any(mask + POKEYS_POEXTBUS, sizeof(command->poextbus_mask) - POKEYS_POEXTBUS)) {
		intake_refuse(device, COMMAND_FAULT_POEXTBUS, POKEYS_POEXTBUS);
		return;
	}
	memcpy(wish->poextbus, command->poextbus, POKEYS_POEXTBUS);
	memcpy(wish->poextbus_mask, mask, POKEYS_POEXTBUS);
}

static void take_external(struct device *device, const struct pokeys_command *command)
{
	struct output_wish *wish = &device->intake.output;

	if (!offered(device, command->external_outputs_mask || command->relays_mask,
		     device->image.capability.pulse_engine >= 2, COMMAND_PART_EXTERNAL_OUTPUTS))
		return;
	wish->external = command->external_outputs;
	wish->external_mask = command->external_outputs_mask;
	wish->relays = command->relays;
	wish->relays_mask = command->relays_mask;
}

/* The first module that is commanded and known not to be there; POKEYS_PONET = none. */
static unsigned int missing_module(const struct device *device, uint32_t mask)
{
	if (mask >> POKEYS_PONET)
		return (unsigned int)__builtin_ctz(mask >> POKEYS_PONET) + POKEYS_PONET + 1;
	for (unsigned int i = 0; i < POKEYS_PONET && device->ponet.complete; i++) {
		if (mask >> i & 1 && !device->image.ponet[i].type)
			return i;
	}
	return POKEYS_PONET;
}

static void take_ponet(struct device *device, const struct pokeys_command *command)
{
	struct output_wish *wish = &device->intake.output;
	const unsigned int missing = missing_module(device, command->ponet_mask);

	if (!offered(device, command->ponet_mask || command->kbd48_flags,
		     device->image.capability.ponet, COMMAND_PART_PONET))
		return;
	if (missing != POKEYS_PONET)
		intake_refuse(device, COMMAND_FAULT_PONET, missing);
	wish->ponet_mask = command->ponet_mask;
	memcpy(wish->ponet_data, command->ponet_data, sizeof(wish->ponet_data));
	memcpy(wish->ponet_brightness, command->ponet_brightness, sizeof(wish->ponet_brightness));
	if (command->kbd48_flags & ~KBD48_FLAGS || command->kbd48_leds >> WIRE_KBD48_KEYS) {
		intake_refuse(device, COMMAND_FAULT_KBD48, command->kbd48_flags);
		return;
	}
	wish->kbd48_flags = command->kbd48_flags;
	wish->kbd48_brightness = command->kbd48_brightness;
	wish->kbd48_leds = command->kbd48_leds;
}

/* With a target that is not a number the heater is off, but off was not commanded. */
static void take_heaters(struct device *device, const struct pokeys_command *command)
{
	const uint32_t beyond = command->heater_mask >> device->config.heaters;
	uint32_t mask = command->heater_mask;

	if (beyond)
		intake_refuse(device, COMMAND_FAULT_HEATER,
			      device->config.heaters + __builtin_ctz(beyond));
	for (unsigned int i = 0; i < device->config.heaters; i++) {
		const bool commanded = command->heater_mask >> i & 1;
		const double target = commanded ? (double)command->heater_target[i] : 0;

		if (!isfinite(target)) {
			intake_refuse(device, COMMAND_FAULT_HEATER_TARGET, i);
			mask &= ~(UINT32_C(1) << i);
		}
		device->intake.heating.target[i] = target;
	}
	device->intake.heating.mask = mask;
}

/* Positions that are no numbers are passed on: for a motor that is enabled, that is a fault. */
static void take_servos(struct device *device, const struct pokeys_command *command)
{
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++) {
		const struct pokeys_servo_command *from = &command->servo[i];

		if (from->enable && i >= device->config.servos)
			intake_refuse(device, COMMAND_FAULT_SERVO, i);
		if (from->enable && (!isfinite(from->position) || isinf(from->velocity)))
			intake_refuse(device, COMMAND_FAULT_SERVO_POSITION, i);
		device->intake.servoing[i] = (struct servoing_wish){
			.enable = from->enable,
			.position = from->position,
			.velocity = (double)from->velocity,
		};
	}
}

void intake_outputs(struct device *device, const struct pokeys_command *command)
{
	take_pwm(device, command);
	take_bus(device, command);
	take_external(device, command);
	take_ponet(device, command);
	take_heaters(device, command);
	take_servos(device, command);
}
