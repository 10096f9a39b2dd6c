/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_ANALOG_H
#define SIM_ANALOG_H

#include <stdint.h>

/* Analog inputs, pins 41 to 47, 12 bit, with the RC filter (protocol section 3.6). */

#define SIM_ANALOGS 7
#define SIM_FIRST_ANALOG_PIN 40	/* 0-based */
#define SIM_ANALOG_MAX 4095

struct sim_analog {
	double filtered[SIM_ANALOGS];
};

/* Outside: a fixed value, or a triangle between two. */
struct sim_source {
	uint16_t low;
	uint16_t high;
	uint32_t period_ms; /* 0: `low` all the time */
};

struct sim_device;

/* One sample of each input, every millisecond. */
void sim_analog_slot(struct sim_device *dev);

/* What the converter gives now, 0..4095; 0 for a pin which is not an analog input. */
uint16_t sim_analog_value(const struct sim_device *dev, unsigned int input);

#endif
