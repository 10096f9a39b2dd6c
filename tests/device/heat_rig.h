/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Heaters of a device, with the physics of a block and a sensor between its outputs and its analog
 * inputs: one by PWM, one by a digital output. What heats is asked of the simulated device, never
 * of the daemon's own image.
 */
#ifndef TESTS_DEVICE_HEAT_RIG_H
#define TESTS_DEVICE_HEAT_RIG_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "sim/heat.h"
#include "tests/device/world.h"

enum { HOTEND, BED, HEATERS };
enum { LAMP = 20, BED_PIN = 12, HOTEND_PWM = 2, FAN_PWM = 1, PERIOD = 25000 };

extern struct world world;
extern struct sim_heat heat[HEATERS];

/* The power that the device has on a heater, 0 to 1. */
double heat_power(unsigned int heater);

/* The physics alone go on; a cycle with them; cycles for so long. */
void heat_warm(double seconds);
void heat_cycle(void);
void heat_run(uint64_t for_ns);

/* A target in the command image. */
void heat_command(unsigned int heater, float target);

/* Two heaters in world.config, cold; then running, with a commander; both. */
int heat_prepare(void **state);
void heat_start(void);
int heat_begin(void **state);

/* To 150 and 60 degrees, and there. */
void heat_up(void);

/* What is published of a heater. */
const struct pokeys_heater *heat_shown(unsigned int heater);

/* No power reaches either of them any more, at most so much later, and a second long. */
void heat_expect_off(uint64_t within_ns);
void heat_expect_fault(unsigned int heater, enum pokeys_heater_fault fault);

/* One-shots. */
enum pokeys_outcome heat_reset(unsigned int heater);
enum pokeys_outcome heat_tune(unsigned int heater, float target);

/* The device is silent for so long. */
void heat_silence(uint64_t for_ns);

#endif
