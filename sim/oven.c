// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Heated blocks between outputs and analog inputs.
 *
 * A digital output heats while it is on, whatever its level at the terminal is: how a driver is
 * wired is the installer's choice.
 */
#include "sim/oven.h"

#include "sim/device.h"

#define SLOT_S 0.001

void sim_oven_fit(struct sim_device *dev, unsigned int input, const struct sim_heat_config *config,
		  bool by_pwm, unsigned int output)
{
	struct sim_oven *oven = &dev->bench.oven[input];

	*oven = (struct sim_oven){ .fitted = true, .by_pwm = by_pwm, .output = (uint8_t)output };
	sim_heat_init(&oven->heat, config, 20055 + input);
}

void sim_oven_remove(struct sim_device *dev, unsigned int input)
{
	dev->bench.oven[input].fitted = false;
}

double sim_oven_power(const struct sim_device *dev, unsigned int input)
{
	const struct sim_oven *oven = &dev->bench.oven[input];
	const struct sim_pwm_config *pwm = &dev->config.pwm;

	if (!oven->by_pwm)
		return dev->pins.latch >> oven->output & 1 ? 1 : 0;
	if (!(pwm->enabled >> oven->output & 1) || !pwm->period)
		return 0;
	return sim_pwm_duty(dev, oven->output) < pwm->period ?
		       (double)sim_pwm_duty(dev, oven->output) / pwm->period :
		       1;
}

void sim_oven_slot(struct sim_device *dev)
{
	for (unsigned int i = 0; i < SIM_ANALOGS; i++) {
		struct sim_oven *oven = &dev->bench.oven[i];

		if (!oven->fitted)
			continue;
		sim_heat_run(&oven->heat, SLOT_S, sim_oven_power(dev, i), oven->fan);
		dev->bench.analog[i] = (struct sim_source){
			.low = sim_heat_reading(&oven->heat),
		};
	}
}
