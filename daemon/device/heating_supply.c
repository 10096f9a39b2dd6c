/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A supply that does not suffice for all heaters at once: none with a PWM output gets more than a
 * common part of its rated power.
 *
 * A heater that a digital output switches has all of its power or none, so it goes first; the
 * configuration makes sure that the supply suffices for all of those. PWM outputs share the rest.
 *
 * This is the mean of a PWM period, in which all outputs are on at first.
 */

#include "daemon/device/internal.h"

static bool is_switched(const struct device *device, unsigned int i)
{
	return device->config.heater[i].kind == HEATING_PIN;
}

void heating_supply(struct device *device)
{
	const unsigned int count = device->heatings.count;
	double power[POKEYS_HEATERS] = { 0 }, watts[POKEYS_HEATERS] = { 0 };
	double left = device->config.heater_watts, limit;

	if (left <= 0)
		return;
	for (unsigned int i = 0; i < count; i++) {
		const struct heating *heating = &device->heatings.heating[i];

		if (is_switched(device, i)) {
			left -= heating->on ? device->config.heater[i].watts : 0;
			continue;
		}
		power[i] = heating->heater.power;
		watts[i] = device->config.heater[i].watts;
	}
	limit = power_limit(power, watts, count, left);
	for (unsigned int i = 0; i < count; i++)
		if (!is_switched(device, i))
			heater_available(&device->heatings.heating[i].heater, limit);
}
