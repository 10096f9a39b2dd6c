/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The fans of heaters: a hot end whose cold end gets hot is clogged, whatever the program does
 * that commands it. So a fan depends on the temperature alone: it runs while the heater is off, has
 * a fault, or is still hot from a daemon before, and also if the temperature is not known.
 *
 * A heater whose fan cannot run is not ready.
 */

#include <math.h>
#include "daemon/device/internal.h"

static const struct heating_fan_config *config_of(const struct device *device, unsigned int i)
{
	return &device->config.heater[i].fan;
}

bool heating_fan_usable(const struct device *device, unsigned int index)
{
	const struct heating_fan_config *config = config_of(device, index);

	switch ((enum heating_output)config->kind) {
	case HEATING_PWM:
		return !device->heatings.heating[index].fan_shared &&
		       loops_have_pwm(device, config->output, HEATING_PERIOD_LEAST,
				      HEATING_PERIOD_MOST);
	case HEATING_PIN:
		return !device->heatings.heating[index].fan_shared &&
		       heating_is_as_wanted(device, config->output);
	case HEATING_NO_OUTPUT:
		break;
	}
	return true;
}

static double temperature(const struct device *device, unsigned int i)
{
	const struct heater *heater = &device->heatings.heating[i].heater;
	const bool is_old = device->now_ns > heater->good_ns &&
			    device->now_ns - heater->good_ns > heater->config.stale_ns;

	return is_old ? NAN : heater->temperature;
}

void heating_fans(struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++) {
		struct heating *heating = &device->heatings.heating[i];

		heating->fan = config_of(device, i)->kind != HEATING_NO_OUTPUT &&
			       fan_step(&config_of(device, i)->fan, heating->fan,
					temperature(device, i));
	}
}

static bool runs(const struct device *device, unsigned int i)
{
	return device->heatings.heating[i].fan && heating_fan_usable(device, i);
}

uint64_t heating_fan_pins(const struct device *device)
{
	uint64_t pins = 0;

	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (config_of(device, i)->kind == HEATING_PIN)
			pins |= UINT64_C(1) << config_of(device, i)->output;
	return pins;
}

uint64_t heating_fan_pins_on(const struct device *device)
{
	uint64_t pins = 0;

	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (config_of(device, i)->kind == HEATING_PIN && runs(device, i))
			pins |= UINT64_C(1) << config_of(device, i)->output;
	return pins;
}

uint8_t heating_fan_channels(const struct device *device)
{
	unsigned int channels = 0;

	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (config_of(device, i)->kind == HEATING_PWM)
			channels |= 1u << config_of(device, i)->output;
	return (uint8_t)channels;
}

void heating_fan_pwm(const struct device *device, struct wire_pwm_req *pwm)
{
	for (unsigned int i = 0; i < device->heatings.count; i++) {
		const struct heating_fan_config *config = config_of(device, i);
		const double speed = runs(device, i) ? config->speed : 0;

		if (config->kind != HEATING_PWM)
			continue;
		pwm->enabled |= (uint8_t)(1u << config->output);
		pwm->duty[config->output] = (uint32_t)llround(speed * pwm->period);
	}
}

enum pokeys_heater_fan heating_fan_state(const struct device *device, unsigned int index)
{
	if (config_of(device, index)->kind == HEATING_NO_OUTPUT)
		return POKEYS_HEATER_FAN_NONE;
	return runs(device, index) ? POKEYS_HEATER_FAN_ON : POKEYS_HEATER_FAN_OFF;
}
