/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A PID controller whose output has limits. Pure; realtime.
 *
 * The derivative is that of the measurement, so a new target makes no kick. The integral stands
 * still while the output is at a limit and the error would drive it further (conditional
 * integration), and is kept in units of the output, so new gains make no jump. Without an integral
 * gain nothing would take back what the integral held: it is let go by and by.
 */
#ifndef LOOPS_PID_H
#define LOOPS_PID_H

#include <stdbool.h>

struct pid_gains {
	double p;      /* output for each unit of the error */
	double i;      /* ... and second */
	double d;      /* output for each unit a second of the measurement */
	double smooth; /* time constant of the derivative's filter, seconds */
};

struct pid {
	double integral; /* in units of the output */
	double bridge;   /* ... from gains of before with one to those without; goes to 0 */
	double rate;     /* of the measurement, filtered, units a second */
	double last;     /* measurement */
	double added;    /* to the integral by the last step */
	bool primed;     /* there is a last one */
};

/* The next measurement is the first one; nothing is left of those before it. */
void pid_reset(struct pid *pid);

/* One step, `seconds` after the last one: an output from least to most. */
double pid_step(struct pid *pid, const struct pid_gains *gains, double target, double measured,
		double seconds, double least, double most);

/*
 * The last output was too much for something behind this controller: a limit that nobody knew
 * before. As at a limit, that step has not filled the integral.
 */
void pid_cut(struct pid *pid);

/* From now on the gains are `to`; an output within its limits goes on from where it is. */
void pid_regain(struct pid *pid, const struct pid_gains *from, const struct pid_gains *to,
		double target, double least, double most);

#endif
