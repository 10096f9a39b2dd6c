/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_OVEN_H
#define SIM_OVEN_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/heat.h"

/*
 * A heated block on the bench: an output of the device heats it, and its thermistor lies at an
 * analog input, with a resistor to the reference. One for each analog input.
 */

struct sim_oven {
	bool fitted;
	bool by_pwm; /* output is a PWM channel, else a pin, both 0-based */
	uint8_t output;
	bool fan; /* blows at it */
	struct sim_heat heat;
};

struct sim_device;

/* Fit one to analog input `input` (0 = pin 41), at the room's temperature. */
void sim_oven_fit(struct sim_device *dev, unsigned int input, const struct sim_heat_config *config,
		  bool by_pwm, unsigned int output);

/* Take it off; the input keeps what it reads last. */
void sim_oven_remove(struct sim_device *dev, unsigned int input);

/* What the device heats it with, 0 to 1. */
double sim_oven_power(const struct sim_device *dev, unsigned int input);

/* A millisecond. */
void sim_oven_slot(struct sim_device *dev);

#endif
