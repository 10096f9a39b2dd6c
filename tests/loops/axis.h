/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A servo with its motor and a screw of 5 mm, in virtual time. Every cycle of 1 ms: the motor goes
 * on, then a step with the encoder's count of the cycle before, as it comes over a network.
 */
#ifndef TESTS_AXIS_H
#define TESTS_AXIS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "daemon/loops/servo.h"
#include "sim/motor.h"

#define AXIS_CYCLE_NS UINT64_C(1000000)

struct axis {
	struct servo servo;
	struct sim_motor motor;
	struct servo_input input;
	struct servo_wish wish;
	uint64_t now_ns;
	bool silent;   /* no readings come */
	int32_t count; /* of the next reading */
	uint64_t count_ns;
	double output;
	double most; /* greatest error since it was set to 0, units */
};

/* The gains fit the motor. */
extern const struct servo_config axis_config;

void axis_init(struct axis *axis, const struct servo_config *config,
	       const struct sim_motor_config *motor);
void axis_step(struct axis *axis);
void axis_run(struct axis *axis, double seconds);
/* Off, then enabled where it is. */
void axis_enable(struct axis *axis);
bool axis_reset(struct axis *axis);
/* To there, with that speed and acceleration. */
void axis_move(struct axis *axis, double to, double speed, double acceleration);
/* Until it has a fault, or the time is over; how long it took in seconds, or -1. */
double axis_until_fault(struct axis *axis, double seconds);
void axis_expect_fault(const struct axis *axis, enum servo_fault fault);

#endif
