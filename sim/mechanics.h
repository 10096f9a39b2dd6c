/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_MECHANICS_H
#define SIM_MECHANICS_H

#include <stdbool.h>
#include <stdint.h>

/*
 * The machine hung on the pulse engine: what its axes do to switches, probe
 * and encoders (protocol section 5.3, "Mechanics"). It belongs to the test
 * bench: it knows nothing of the device's settings and outlives its reboots.
 */

#define SIM_AXES 8
#define SIM_DEDICATED 0xFE	/* wired to the axis' own input, not to a pin */

/*
 * A switch to ground, its input pulled up: closed reads 0, open reads 1. It is
 * actuated while the axis stands at from..to, both included.
 */
struct sim_switch {
	bool wired;
	bool normally_open;
	uint8_t pin; /* 0-based, or SIM_DEDICATED */
	int64_t from;
	int64_t to;
};

struct sim_mechanics {
	int64_t position; /* of the motor, in pulses; no command sets it */
	uint64_t steps;   /* pulses made, both ways added up */
	struct sim_switch minus;
	struct sim_switch plus;
	struct sim_switch home;
	int encoder;       /* driven by this axis, 0..25, or -1 */
	int32_t ratio_num; /* quadrature steps per ratio_den pulses */
	int32_t ratio_den;
	int64_t ratio_rest;
	int64_t index_every; /* pulses from index to index, 0 none */
};

struct sim_machine {
	struct sim_mechanics axis[SIM_AXES];
	uint8_t raw_minus, raw_plus, raw_home; /* dedicated inputs nothing is wired to */
	uint8_t driver_error;                  /* bit = axis, status @61 */
	uint8_t misc;                          /* external inputs, status @62 */
	int16_t mismatch[SIM_AXES];            /* steps lost, as the smart generator sees it */
	struct sim_switch probe;               /* pin may be 100 + n: external input n */
	uint8_t probe_axis;
	uint8_t told_slots;     /* size of the ring and time of a slot as the */
	uint8_t told_slot_time; /* status tells them: 128, 10 * 100 us */
	bool emergency_wired;
	bool emergency_pressed;
	bool emergency_open; /* normally open: pressed reads 0 */
	bool any_on_pin;     /* some switch stands on a pin */
};

#define SIM_PROBE_INPUT 100	/* sim_switch.pin of a probe on external input n: 100 + n */

/* Division rounding down, so that crossings are counted alike on both sides of zero. */
static inline int64_t sim_floor_div(int64_t a, int64_t b)
{
	return a / b - (a % b < 0);
}

/* Nothing wired, the emergency button released and closed to ground. */
void sim_machine_init(struct sim_machine *machine);

/* Level the switch puts on its input with the axis at `position`. */
unsigned int sim_switch_level(const struct sim_switch *sw, int64_t position);

/* To be called when any switch has been wired anew. */
void sim_machine_rewired(struct sim_machine *machine);

/*
 * What the machine drives onto a pin: 0 or 1, or -1 when none of it is wired
 * there. `emergency_pin` is where the emergency button is connected.
 */
int sim_machine_pin(const struct sim_machine *machine, unsigned int pin,
		    unsigned int emergency_pin);

/* Raw level of the axis' dedicated inputs, one bit per axis. */
uint8_t sim_machine_minus(const struct sim_machine *machine);
uint8_t sim_machine_plus(const struct sim_machine *machine);
uint8_t sim_machine_home(const struct sim_machine *machine);

/* External inputs 1..8 as bits 0..7. */
uint8_t sim_machine_misc(const struct sim_machine *machine);

#endif
