/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_POSTEP_H
#define SIM_POSTEP_H

#include <stdbool.h>
#include <stdint.h>

/*
 * PoStep motor drivers on the I2C bus of the pulse engine (protocol section 3.24.3,
 * 0x85/50 to 54). They belong to the test bench: what one is set up for is in itself and
 * not in the device, and it has power or not.
 */

#define SIM_POSTEP_TURN_MS 40	/* from talk to talk with one of them */

struct sim_postep {
	uint8_t powered;
	uint8_t address;     /* I2C */
	uint8_t supply;      /* 0.25 V */
	uint8_t temperature; /* degrees C */
	uint8_t inputs, state, faults;
	uint8_t mode, step, limit;
	uint16_t current[3]; /* full scale, idle, overheat */
	uint8_t version[4];  /* hardware, firmware */
	uint8_t saved;       /* times its own memory was written */
};

struct sim_device;

/* Healthy ones on all axes: 24 V, 40 degrees, at the addresses 33 to 40. */
void sim_postep_init(struct sim_postep *postep);

/* One slot of 1 ms: the device talks to one of them when it is its turn. */
void sim_postep_slot(struct sim_device *dev);

#endif
