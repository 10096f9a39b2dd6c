// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The device's own watchdog on the network (protocol section 3.21): when nobody
 * has sent a valid packet for the time set, the stored state is taken, once.
 * Any valid packet counts as talking, and so does an opened TCP connection's
 * traffic. What the pulse engine does is not in the sources: it stops.
 */
#include "sim/failsafe.h"

#include "sim/engine_part.h"

#define PART_DIGITAL 0x01
#define PART_POEXT 0x02
#define PART_PWM 0x04
#define PART_ENGINE 0x08

static void apply(struct sim_device *dev)
{
	const struct sim_failsafe_config *fs = &dev->config.failsafe;
	struct sim_pwm_config *pwm = &dev->config.pwm;

	if (fs->peripherals & PART_DIGITAL)
		sim_pins_write(dev, wire_get_u56(fs->outputs), UINT64_MAX);
	if (fs->peripherals & PART_POEXT)
		memcpy(dev->bus.poext, fs->poext, sizeof(dev->bus.poext));
	for (unsigned int i = 0; (fs->peripherals & PART_PWM) && i < 6; i++) {
		pwm->duty[i] = (uint32_t)((uint64_t)pwm->period * fs->pwm[i] / 100);
		dev->run.pwm_until_ns[i] = 0;
	}
	if ((fs->peripherals & PART_ENGINE) && dev->engine.state != SIM_PE_STOP_EMERGENCY &&
	    dev->engine.state != SIM_PE_STOP_LIMIT)
		sim_engine_set_state(dev, SIM_PE_STOPPED);
	dev->stats.failsafes++;
	sim_device_log(dev, 0x81);
}

void sim_failsafe_slot(struct sim_device *dev)
{
	uint64_t timeout_ns = UINT64_C(100000000) * dev->config.failsafe.timeout;

	if (!timeout_ns || dev->run.failsafe_applied ||
	    dev->now_ns - dev->run.heard_ns < timeout_ns)
		return;
	dev->run.failsafe_applied = true;
	apply(dev);
}

SIM_HANDLER(sim_do_failsafe)
{
	struct sim_failsafe_config *fs = &dev->config.failsafe;

	if (rq[P1] == 1 && !sim_locked(dev)) {
		fs->timeout = rq[P2];
		fs->peripherals = rq[P3];
		memcpy(fs->outputs, rq + 8, sizeof(fs->outputs));
		memcpy(fs->poext, rq + 15, sizeof(fs->poext));
		memcpy(fs->pwm, rq + 25, sizeof(fs->pwm));
	}
	rp[P1] = rq[P1];
	rp[P2] = fs->timeout;
	rp[P3] = fs->peripherals;
	memcpy(rp + 8, fs->outputs, sizeof(fs->outputs));
	memcpy(rp + 15, fs->poext, sizeof(fs->poext));
	memcpy(rp + 25, fs->pwm, sizeof(fs->pwm));
	return SIM_ANSWER;
}
