/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A supply that does not suffice for all heaters at once: each gets less of what it asks for.
 *
 * A heater that a digital output switches has all of its power or none, so it goes first; the
 * configuration makes sure that the supply suffices for all of those. One that finds its gains is
 * next, because its gains would be those of a weaker heater. PWM outputs share the rest.
 *
 * This is the mean of a PWM period, in which all outputs are on at first.
 */

#include <math.h>
#include "daemon/device/internal.h"

enum turn { SWITCHED, TUNING, SHARING };

static enum turn turn_of(const struct device *device, unsigned int i)
{
	if (device->config.heater[i].kind == HEATING_PIN)
		return SWITCHED;
	return device->heatings.heating[i].heater.tune.state == TUNE_RUNS ? TUNING : SHARING;
}

static void give(struct device *device, unsigned int i, double power)
{
	struct heating *heating = &device->heatings.heating[i];

	/* If it made no step, it asks for what it got before. */
	if (heating->heater.step_ns == device->now_ns)
		heating->limited = power < heating->heater.power;
	heater_delivered(&heating->heater, power);
}

static double take_first(struct device *device, unsigned int i, double left)
{
	const struct heating *heating = &device->heatings.heating[i];
	const double watts = device->config.heater[i].watts;
	const double power = fmin(heating->heater.power, fmax(left, 0) / watts);

	if (turn_of(device, i) == SWITCHED)
		return heating->on ? watts : 0;
	give(device, i, power);
	return power * watts;
}

void heating_supply(struct device *device)
{
	const unsigned int count = device->heatings.count;
	double power[POKEYS_HEATERS] = { 0 }, watts[POKEYS_HEATERS] = { 0 };
	double left = device->config.heater_watts;

	if (left <= 0)
		return;
	for (enum turn turn = SWITCHED; turn < SHARING; turn++)
		for (unsigned int i = 0; i < count; i++)
			if (turn_of(device, i) == turn)
				left -= take_first(device, i, left);
	for (unsigned int i = 0; i < count; i++) {
		if (turn_of(device, i) != SHARING)
			continue;
		power[i] = device->heatings.heating[i].heater.power;
		watts[i] = device->config.heater[i].watts;
	}
	power_share(power, watts, count, left);
	for (unsigned int i = 0; i < count; i++)
		if (turn_of(device, i) == SHARING)
			give(device, i, power[i]);
}
