// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Motors between outputs and encoders.
 *
 * A digital output is on while it is latched, whatever its level at the terminal is: how an
 * amplifier is wired is the installer's choice.
 */
#include "sim/servo.h"

#include "sim/device.h"

#define SLOT_S 0.001

void sim_servo_fit(struct sim_device *dev, unsigned int encoder, const struct sim_servo *servo,
		   const struct sim_motor_config *config)
{
	struct sim_servo *fitted = &dev->bench.servo[encoder];

	*fitted = *servo;
	fitted->fitted = true;
	sim_motor_init(&fitted->motor, config);
	fitted->count = sim_motor_count(&fitted->motor);
	sim_servos_rewired(dev);
}

void sim_servo_remove(struct sim_device *dev, unsigned int encoder)
{
	dev->bench.servo[encoder].fitted = false;
	sim_servos_rewired(dev);
}

void sim_servos_rewired(struct sim_device *dev)
{
	dev->bench.servo_switches = false;
	for (unsigned int i = 0; i < SIM_ENCODERS; i++) {
		const struct sim_servo *servo = &dev->bench.servo[i];

		for (unsigned int k = 0; k < 3; k++)
			dev->bench.servo_switches |= servo->fitted && servo->end[k].wired;
	}
	dev->dirty = true;
}

int sim_servos_pin(const struct sim_device *dev, unsigned int pin)
{
	if (!dev->bench.servo_switches)
		return -1;
	for (unsigned int i = 0; i < SIM_ENCODERS; i++) {
		const struct sim_servo *servo = &dev->bench.servo[i];

		for (unsigned int k = 0; k < 3 && servo->fitted; k++)
			if (servo->end[k].wired && servo->end[k].pin == pin)
				return (int)sim_switch_level(&servo->end[k], servo->count);
	}
	return -1;
}

static double duty_of(const struct sim_device *dev, unsigned int channel)
{
	const struct sim_pwm_config *pwm = &dev->config.pwm;

	if (!(pwm->enabled >> channel & 1) || !pwm->period)
		return 0;
	return sim_pwm_duty(dev, channel) < pwm->period ?
		       (double)sim_pwm_duty(dev, channel) / pwm->period :
		       1;
}

double sim_servo_output(const struct sim_device *dev, unsigned int encoder)
{
	const struct sim_servo *servo = &dev->bench.servo[encoder];
	const double duty = duty_of(dev, servo->pwm);

	if (servo->enable != SIM_SERVO_NONE && !(dev->pins.latch >> servo->enable & 1))
		return 0;
	switch (servo->kind) {
	case SIM_SERVO_SIGN:
		return dev->pins.latch >> servo->other & 1 ? -duty : duty;
	case SIM_SERVO_ANTIPHASE:
		return 2 * duty - 1;
	case SIM_SERVO_TWO_PWM:
		break;
	}
	return duty - duty_of(dev, servo->other);
}

void sim_servos_slot(struct sim_device *dev)
{
	for (unsigned int i = 0; i < SIM_ENCODERS; i++) {
		struct sim_servo *servo = &dev->bench.servo[i];
		int32_t count;

		if (!servo->fitted)
			continue;
		sim_motor_run(&servo->motor, SLOT_S, sim_servo_output(dev, i));
		count = sim_motor_count(&servo->motor);
		sim_encoder_turn(dev, i, (int32_t)((uint32_t)count - (uint32_t)servo->count));
		servo->count = count;
	}
	if (dev->bench.servo_switches)
		dev->dirty = true;
}
