/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What heaters have in common: a supply that does not suffice for all of them at full power, and
 * fans that run when something is hot. Pure; realtime.
 */
#ifndef LOOPS_POWER_H
#define LOOPS_POWER_H

#include <stdbool.h>

/*
 * The limit (0 to 1) of all powers with which they need no more than `most` watts together; 1 if
 * they do not need that much. power[i] is what heater i asks for, watts[i] what it needs at 1.
 */
double power_limit(const double *power, const double *watts, unsigned int count, double most);

/* A fan that is bound to a temperature. */
struct fan_config {
	double above;      /* degrees Celsius: it runs */
	double hysteresis; /* ... until it is colder by so much, K */
};

/* Does it run from now on? It does if the temperature is not known (NAN): it may be hot. */
bool fan_step(const struct fan_config *config, bool runs, double temperature);

#endif
