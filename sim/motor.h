/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_MOTOR_H
#define SIM_MOTOR_H

#include <stdbool.h>
#include <stdint.h>

/*
 * A DC motor with its load and an encoder, and what can be wrong with them. Not a part of the
 * device: it stands outside, between an output and an encoder input.
 */

struct sim_motor_config {
	double volts;    /* at an output of 1 */
	double ohm;      /* of the winding */
	double constant; /* newton metres for each ampere, and volts for each radian/s */
	double inertia;  /* of motor and load, kg m^2 */
	double viscous;  /* friction, newton metres for each radian/s */
	double friction; /* Coulomb's, newton metres */
	double backlash; /* play between motor and encoder, radians; 0: it is on the motor */
	double counts;   /* of the encoder, for each turn */
};

enum sim_motor_fault {
	SIM_MOTOR_GOOD,
	SIM_MOTOR_STALLED,  /* the shaft is held */
	SIM_MOTOR_REVERSED, /* encoder channels swapped: it counts the other way from now on */
	SIM_MOTOR_SILENT,   /* the encoder's cable is off */
	SIM_MOTOR_CUT,      /* the motor's cable is off */
};

struct sim_motor {
	struct sim_motor_config config;
	enum sim_motor_fault fault;
	double angle, speed; /* of the shaft: radians, radians/s */
	double load;         /* angle where the encoder is */
	double torque;       /* from outside, newton metres */
	double counted;      /* what the encoder has counted, before it is rounded */
};

/* A servo motor of 24 V, 70 W, 500 lines. */
extern const struct sim_motor_config sim_motor_small;

/* It stands at 0. */
void sim_motor_init(struct sim_motor *motor, const struct sim_motor_config *config);

/* So many seconds, at most 0.1, with an output of -1 to 1. */
void sim_motor_run(struct sim_motor *motor, double seconds, double output);

/* From now on it is like that. */
void sim_motor_break(struct sim_motor *motor, enum sim_motor_fault fault);

/* What a counter of 32 bits shows, which wraps. */
int32_t sim_motor_count(const struct sim_motor *motor);

#endif
