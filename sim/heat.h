/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_HEAT_H
#define SIM_HEAT_H

#include <stdint.h>

#include "sim/prng.h"

/*
 * A heated block with a thermistor: what a heater does to it, what a fan takes away, and what can
 * be wrong with the sensor. Not a part of the device: it stands outside, between an output
 * and an analog input.
 */

struct sim_heat_config {
	double watts;              /* at full power */
	double capacity;           /* joules for a kelvin */
	double loss;               /* watts for each kelvin above the room */
	double fan_loss;           /* ... more, while the fan runs */
	double room;               /* degrees Celsius */
	double delay_s;            /* until a change reaches the sensor, at most 4.9 s */
	double lag_s;              /* time constant of the sensor; 0: none */
	double noise;              /* of a reading, K, up and down */
	double pull_up, ohm, beta; /* of the thermistor, at 25 degrees */
};

enum sim_heat_fault {
	SIM_HEAT_GOOD,
	SIM_HEAT_OPEN,
	SIM_HEAT_SHORT,
	SIM_HEAT_STUCK, /* says what it said when it got stuck, with the noise */
	SIM_HEAT_DRIFT, /* says more and more wrong: `drift` kelvin a second */
	SIM_HEAT_OUT,   /* fell out of the block: it is in the room */
};

#define SIM_HEAT_DELAYS 50	/* of 0.1 s */

struct sim_heat {
	struct sim_heat_config config;
	struct sim_prng prng;
	double block, sensor; /* degrees Celsius */
	double delayed[SIM_HEAT_DELAYS];
	unsigned int at;   /* the next one of them */
	double delay_left; /* seconds until it is taken */
	enum sim_heat_fault fault;
	double stuck, drift, drifted; /* degrees Celsius, K/s, K */
};

/* A hot end of 40 W, a bed of 250 W. */
extern const struct sim_heat_config sim_heat_hotend, sim_heat_bed;

/* At the room's temperature. */
void sim_heat_init(struct sim_heat *heat, const struct sim_heat_config *config, uint64_t seed);

/* So many seconds, at most 0.1, with a power of 0 to 1, with the fan or without. */
void sim_heat_run(struct sim_heat *heat, double seconds, double power, int fan);

/* From now on the sensor is like that. */
void sim_heat_break(struct sim_heat *heat, enum sim_heat_fault fault);

/* What a converter of 12 bits reads, 0 to 4095. */
uint16_t sim_heat_reading(struct sim_heat *heat);

#endif
