/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_PLANNER_H
#define SIM_PLANNER_H

#include <stdbool.h>

/*
 * The internal planner of one axis, one 1 ms slot at a time (protocol section
 * 5.3, "Motion per axis and slot"). Pure. Positions in pulses, speeds in
 * pulses/ms, accelerations in pulses/ms^2; all three limits >= 0.
 */

struct sim_planner_limits {
	double speed;
	double accel;
	double decel;
};

struct sim_planner {
	double position; /* with its fraction */
	double speed;
};

/* Speed after one slot on the way to `target`, through zero on a change of sign. */
double sim_planner_ramp(double speed, double target, const struct sim_planner_limits *limits);

/* One slot towards a constant speed (clamped to the limit). */
void sim_planner_run(struct sim_planner *p, double speed, const struct sim_planner_limits *limits);

/* One slot towards a position; ends exactly on it, without overshoot. */
void sim_planner_go(struct sim_planner *p, double target, const struct sim_planner_limits *limits);

#endif
