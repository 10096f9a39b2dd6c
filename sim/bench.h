/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_BENCH_H
#define SIM_BENCH_H

/*
 * Hands on the test bench: what a person with switches, wires and a screwdriver
 * can do to the device. Each takes effect at once. Pins count from 0 here.
 * Fields of dev->bench not named here may be written directly.
 */

#include "sim/device.h"

/* Level driven onto a pin from outside; 1 is also what an open pin reads. */
void sim_bench_pin(struct sim_device *dev, unsigned int pin, unsigned int level);

/* Toggles a pin by itself every so many milliseconds; 0 stops it. */
void sim_bench_blink(struct sim_device *dev, unsigned int pin, uint32_t ms);

/* Pin `to` takes its level from pin `from`; SIM_NO_PIN cuts the wire. */
void sim_bench_wire(struct sim_device *dev, unsigned int from, unsigned int to);

/* Presses or releases the emergency button. */
void sim_bench_emergency(struct sim_device *dev, bool pressed);

/* Puts a switch of the machine (a field of dev->bench.machine) in place. */
void sim_bench_switch(struct sim_device *dev, struct sim_switch *place,
		      const struct sim_switch *value);

/*
 * Fastens an encoder to an axis: num quadrature steps for den pulses, an index
 * every index_every pulses (0 none). encoder -1 takes it off.
 */
void sim_bench_couple(struct sim_device *dev, unsigned int axis, int encoder, int32_t num,
		      int32_t den, int64_t index_every);

/* Sets a counter directly, as the shaft of a new encoder. */
void sim_bench_encoder(struct sim_device *dev, unsigned int encoder, uint32_t raw);

/* Turns the ultra-fast encoder's shaft: so many quadrature steps to a turn, 0 the usual. */
#define SIM_SPINDLE_STEPS 4096
void sim_bench_spindle(struct sim_device *dev, int64_t rpm, int64_t steps);

#endif
