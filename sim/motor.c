// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Torque by current, current by voltage less what the turning motor makes itself. The winding's
 * inductance is left out, which delays the current of a real motor by 0.5 to 2 ms: real loops have
 * less margin than this one. An output of 0 brakes, as with an amplifier that shorts the winding.
 * What pushes from outside pushes the shaft.
 *
 * Dry friction holds a shaft that stands, until it is pushed harder.
 */
#include "sim/motor.h"

#include <math.h>

#define STEP_S 50e-6
#define TURN 6.283185307179586

const struct sim_motor_config sim_motor_small = {
	.volts = 24,
	.ohm = 1,
	.constant = 0.05,
	.inertia = 5e-5,
	.viscous = 1e-5,
	.friction = 0.02,
	.counts = 2000,
};

void sim_motor_init(struct sim_motor *motor, const struct sim_motor_config *config)
{
	*motor = (struct sim_motor){ .config = *config };
}

static void step(struct sim_motor *motor, double seconds, double output)
{
	const struct sim_motor_config *config = &motor->config;
	const double current = motor->fault == SIM_MOTOR_CUT ?
				       0 :
				       (output * config->volts - config->constant * motor->speed) /
					       config->ohm;
	const double push = config->constant * current + motor->torque -
			    config->viscous * motor->speed;
	const double slower = config->friction / config->inertia * seconds;

	if (motor->fault == SIM_MOTOR_STALLED) {
		motor->speed = 0;
		return;
	}
	motor->speed += push / config->inertia * seconds;
	if (fabs(motor->speed) <= slower)
		motor->speed = 0;
	else
		motor->speed -= copysign(slower, motor->speed);
	motor->angle += motor->speed * seconds;
}

/* The encoder is taken along by either side of the play. */
static void count(struct sim_motor *motor)
{
	const double play = motor->config.backlash / 2, before = motor->load;
	const double counts = motor->config.counts / TURN;

	motor->load = fmin(fmax(motor->load, motor->angle - play), motor->angle + play);
	if (motor->fault != SIM_MOTOR_SILENT)
		motor->counted += (motor->load - before) * counts *
				  (motor->fault == SIM_MOTOR_REVERSED ? -1 : 1);
}

void sim_motor_run(struct sim_motor *motor, double seconds, double output)
{
	for (; seconds > 0; seconds -= STEP_S) {
		step(motor, fmin(seconds, STEP_S), output);
		count(motor);
	}
}

void sim_motor_break(struct sim_motor *motor, enum sim_motor_fault fault)
{
	motor->fault = fault;
}

int32_t sim_motor_count(const struct sim_motor *motor)
{
	return (int32_t)(uint32_t)(uint64_t)(int64_t)floor(motor->counted);
}
