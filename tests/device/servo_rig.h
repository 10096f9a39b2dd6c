/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Servo motors of a device, each with a simulated motor between its outputs and its encoder: one by
 * PWM and direction, one by antiphase, one by two PWMs. What drives a motor is asked of the
 * simulated device, never of the daemon's own image.
 */
#ifndef TESTS_DEVICE_SERVO_RIG_H
#define TESTS_DEVICE_SERVO_RIG_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/world.h"

enum { SIGN, ANTIPHASE, TWO_PWM, MOTORS };
enum { DIRECTION_PIN = 30, LOW_PIN = 20, HIGH_PIN = 21, LAMP = 22, PWM_PERIOD = 1250 };
/* A 57CNC has terminals of four channels: 0, 1, 2 and this one. */
enum { REVERSE_PWM = 5 };

extern struct world world;

/* Encoder, and pin that enables the amplifier; that of TWO_PWM has none. */
extern const uint8_t servo_encoder[MOTORS], servo_enable_pin[MOTORS];

/* What the device drives a motor with, -1 to 1; what a motor does. */
double servo_output(unsigned int motor);
struct sim_motor *servo_motor(unsigned int motor);

/*
 * A cycle, and cycles for so long. The direction never changes while there is voltage, and the
 * amplifier with antiphase is never enabled at the voltage of another duty than the middle.
 */
void servo_cycle(void);
void servo_run(uint64_t for_ns);

/* Motors in world.config; then running, with a commander; both. */
int servo_prepare(void **state);
void servo_start(void);
int servo_begin(void **state);

/* Off, then enabled where it is; all of them. */
void servo_enable(unsigned int motor);
void servo_enable_all(void);

/* Each of them is pushed against, so that it has voltage from now on for some time. */
void servo_push_all(void);

/* The commanded position goes there, units and units/s; all of them. */
void servo_move(double to, double speed);

/* What is published of a motor. */
const struct pokeys_servo *servo_shown(unsigned int motor);

/* A fault within so long, and no voltage a cycle later; the motor's fault. */
void servo_expect_fault(unsigned int motor, enum pokeys_servo_fault fault, uint64_t within_ns);
/* No voltage at any motor, at most so much later, and for half a second. */
void servo_expect_off(uint64_t within_ns);

/* One-shots. */
enum pokeys_outcome servo_do(enum pokeys_one_shot_operation operation, unsigned int index,
			     int32_t value, uint8_t flags);

#endif
