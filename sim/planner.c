// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Trapezoidal motion in 1 ms steps.
 *
 * The trap: the textbook braking law v = sqrt(2 d r) belongs to continuous
 * time. Taken at 1 ms it overshoots, and swings for ever once d is a few
 * pulses/ms^2. The law used here is the exact one for steps of 1 ms: from
 * rest backwards d, 2d, 3d ... sum to r, so v = d (sqrt(1/4 + 2r/d) - 1/2).
 * The last step takes what is left, whatever it is, and lands on the target
 * to the bit (protocol section 5.3).
 */
#include "sim/planner.h"

#include <math.h>

static double towards(double speed, double target, double step)
{
	if (fabs(target - speed) <= step)
		return target;
	return target > speed ? speed + step : speed - step;
}

double sim_planner_ramp(double speed, double target, const struct sim_planner_limits *limits)
{
	if (speed * target < 0)
		return towards(speed, 0, limits->decel);
	if (fabs(target) > fabs(speed))
		return towards(speed, target, limits->accel);
	return towards(speed, target, limits->decel);
}

void sim_planner_run(struct sim_planner *p, double speed, const struct sim_planner_limits *limits)
{
	double target = fmax(-limits->speed, fmin(limits->speed, speed));

	p->speed = sim_planner_ramp(p->speed, target, limits);
	p->position += p->speed;
}

/* The highest speed from which `distance` suffices to stop. */
static double braking_speed(double distance, double decel)
{
	if (decel <= 0)
		return 0;
	return decel * (sqrt(0.25 + 2 * distance / decel) - 0.5);
}

void sim_planner_go(struct sim_planner *p, double target, const struct sim_planner_limits *limits)
{
	double rest = target - p->position;
	double speed = fmin(limits->speed, braking_speed(fabs(rest), limits->decel));
	double reach;

	p->speed = sim_planner_ramp(p->speed, copysign(speed, rest), limits);
	reach = fabs(p->speed);
	if (p->speed * rest > 0 && fabs(rest) <= reach && reach <= limits->decel) {
		p->speed = rest;
		p->position = target;
		return;
	}
	p->position += p->speed;
}
