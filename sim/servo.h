/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_SERVO_H
#define SIM_SERVO_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/mechanics.h"
#include "sim/motor.h"

/*
 * A motor on the bench: outputs of the device drive it by an amplifier, and it turns the shaft of
 * an encoder. One for each encoder.
 */

enum sim_servo_kind {
	SIM_SERVO_SIGN,      /* a PWM channel, and a pin for the direction */
	SIM_SERVO_ANTIPHASE, /* a PWM channel, whose middle is standstill */
	SIM_SERVO_TWO_PWM,   /* a PWM channel for each direction */
};

#define SIM_SERVO_NONE 255

struct sim_servo {
	bool fitted;
	enum sim_servo_kind kind;
	uint8_t pwm;              /* channel */
	uint8_t other;            /* SIGN: pin, from 0; TWO_PWM: channel */
	uint8_t enable;           /* pin, from 0; SIM_SERVO_NONE: it is always enabled */
	int32_t count;            /* of the motor's encoder, when it turned the shaft last */
	struct sim_switch end[3]; /* minus, plus, home; from..to in counts, on a pin */
	struct sim_motor motor;
};

struct sim_device;

/* Fit one to an encoder, at 0. */
void sim_servo_fit(struct sim_device *dev, unsigned int encoder, const struct sim_servo *servo,
		   const struct sim_motor_config *config);

/* Take it off; the encoder stays where it is. */
void sim_servo_remove(struct sim_device *dev, unsigned int encoder);

/* What the device drives it with, -1 to 1. */
double sim_servo_output(const struct sim_device *dev, unsigned int encoder);

/* To be called when a switch of a motor was wired, or a motor with switches was removed. */
void sim_servos_rewired(struct sim_device *dev);

/* The level that a motor's switch puts on a pin, or -1 if there is none. */
int sim_servos_pin(const struct sim_device *dev, unsigned int pin);

/* A millisecond. */
void sim_servos_slot(struct sim_device *dev);

#endif
