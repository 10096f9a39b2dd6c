// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One lump of heat, a delay on the way to the sensor, and the sensor's own lag. That is the least
 * with which a controller that is too fast oscillates, as a real one does.
 *
 * The figures: a hot end of 40 W needs two minutes to 200 degrees and holds it with a third of
 * its power; a bed of 250 W needs five minutes to 100.
 */
#include "sim/heat.h"

#include <math.h>

#define STEP_S 0.1
#define KELVIN 273.15
#define STEPS 4095

const struct sim_heat_config sim_heat_hotend = {
	.watts = 40,
	.capacity = 15,
	.loss = 0.075,
	.fan_loss = 0.06,
	.room = 22,
	.delay_s = 0.5,
	.lag_s = 0.7,
	.noise = 0.2,
	.pull_up = 4700,
	.ohm = 100e3,
	.beta = 3950,
};

const struct sim_heat_config sim_heat_bed = {
	.watts = 250,
	.capacity = 600,
	.loss = 1.6,
	.fan_loss = 0.4,
	.room = 22,
	.delay_s = 2.5,
	.lag_s = 2,
	.noise = 0.1,
	.pull_up = 4700,
	.ohm = 100e3,
	.beta = 3950,
};

void sim_heat_init(struct sim_heat *heat, const struct sim_heat_config *config, uint64_t seed)
{
	*heat = (struct sim_heat){ .config = *config,
				   .block = config->room,
				   .sensor = config->room };
	for (int i = 0; i < SIM_HEAT_DELAYS; i++)
		heat->delayed[i] = config->room;
	heat->delay_left = STEP_S;
	sim_prng_init(&heat->prng, seed);
}

/* What is at the sensor now: the block as it was. */
static double arrived(const struct sim_heat *heat)
{
	const unsigned int steps = (unsigned int)(heat->config.delay_s / STEP_S);

	if (heat->fault == SIM_HEAT_OUT)
		return heat->config.room;
	return heat->delayed[(heat->at + SIM_HEAT_DELAYS - 1 - steps) % SIM_HEAT_DELAYS];
}

void sim_heat_run(struct sim_heat *heat, double seconds, double power, int fan)
{
	const struct sim_heat_config *config = &heat->config;
	const double loss = config->loss + (fan ? config->fan_loss : 0);

	heat->block += (config->watts * power - loss * (heat->block - config->room)) * seconds /
		       config->capacity;
	heat->delay_left -= seconds;
	if (heat->delay_left <= 0) {
		heat->delay_left += STEP_S;
		heat->delayed[heat->at] = heat->block;
		heat->at = (heat->at + 1) % SIM_HEAT_DELAYS;
	}
	heat->sensor += (arrived(heat) - heat->sensor) * seconds / (config->lag_s + seconds);
	if (heat->fault == SIM_HEAT_DRIFT)
		heat->drifted += heat->drift * seconds;
}

void sim_heat_break(struct sim_heat *heat, enum sim_heat_fault fault)
{
	heat->fault = fault;
	heat->stuck = heat->sensor;
	heat->drifted = 0;
}

uint16_t sim_heat_reading(struct sim_heat *heat)
{
	const struct sim_heat_config *config = &heat->config;
	const double noise = config->noise * (2 * sim_prng_unit(&heat->prng) - 1);
	double celsius = heat->sensor + noise + heat->drifted;
	double ohm;

	if (heat->fault == SIM_HEAT_OPEN || heat->fault == SIM_HEAT_SHORT)
		return heat->fault == SIM_HEAT_OPEN ? STEPS : 0;
	if (heat->fault == SIM_HEAT_STUCK)
		celsius = heat->stuck + noise;
	ohm = config->ohm * exp(config->beta * (1 / (celsius + KELVIN) - 1 / (25 + KELVIN)));
	return (uint16_t)lround(STEPS * ohm / (ohm + config->pull_up));
}
