/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A heater with its block, in virtual time. Every period: ten readings, then a step.
 */
#ifndef TESTS_OVEN_H
#define TESTS_OVEN_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "daemon/loops/heater.h"
#include "sim/heat.h"

struct oven {
	struct heater heater;
	struct sim_heat heat;
	uint64_t now_ns;
	double target;
	bool device, commander, fan, silent; /* silent: no readings come */
	double power;                        /* of the last step */
	double energy;                       /* joules since it was set to 0 */
	double most, least;                  /* of the sensor, since oven_mark() */
};

void oven_init(struct oven *oven, const struct heater_config *config,
	       const struct sim_heat_config *heat);
void oven_step(struct oven *oven);
void oven_run(struct oven *oven, double seconds);
/* Until the heater has a fault, or the time is over; how long it took in seconds, or -1. */
double oven_until_fault(struct oven *oven, double seconds);
void oven_mark(struct oven *oven);
/* Heated to a target, and there for a while. */
void oven_warm(struct oven *oven, double target);
void oven_expect_fault(const struct oven *oven, enum heater_fault fault);

#endif
