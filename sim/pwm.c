// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * PWM (protocol section 3.7) and the simple pulse generator (0x4C). Duties
 * stand at @9, one byte off any alignment.
 */
#include "sim/request.h"

SIM_HANDLER(sim_do_pwm)
{
	struct sim_pwm_config *pwm = &dev->config.pwm;

	if (rq[P1]) {
		for (unsigned int i = 0; i < 6; i++)
			pwm->duty[i] = wire_get_u32(rq + 9 + 4 * i);
		if (rq[P2] != 1) {
			pwm->enabled = rq[8];
			pwm->period = wire_get_u32(rq + 33);
			dev->run.pwm_begun++;
		}
	}
	rp[8] = pwm->enabled;
	for (unsigned int i = 0; i < 6; i++)
		wire_put_u32(rp + 9 + 4 * i, pwm->duty[i]);
	wire_put_u32(rp + 33, pwm->period);
	return SIM_ANSWER;
}

static bool is_blipping(const struct sim_device *dev, unsigned int pin)
{
	const struct sim_blip *blip = &dev->run.blip[pin];

	return blip->period && (!blip->left || dev->now_ns < blip->end_ns);
}

/* Start, stop and status; pins count from 1, a count of 0 goes on until stopped. */
SIM_HANDLER(sim_do_blip)
{
	unsigned int pin = rq[8] - 1u;

	rp[P1] = rq[P1];
	if (rq[P1] == 0x10) {
		for (unsigned int i = 0; i < SIM_PINS; i++)
			rp[8 + i] = is_blipping(dev, i);
		return SIM_ANSWER;
	}
	if (rq[P1] > 1)
		return SIM_ANSWER_UNKNOWN;
	if (pin >= SIM_PINS) {
		rp[P2] = 1;
		return SIM_ANSWER;
	}
	memset(&dev->run.blip[pin], 0, sizeof(dev->run.blip[pin]));
	if (rq[P1] == 0x01)
		return SIM_ANSWER;
	dev->run.blip[pin].period = wire_get_u16(rq + 9);
	dev->run.blip[pin].left = wire_get_u16(rq + 11);
	dev->run.blip[pin].duty = rq[13];
	dev->run.blip[pin].end_ns = dev->now_ns + UINT64_C(100000) *
				    dev->run.blip[pin].period * dev->run.blip[pin].left;
	return SIM_ANSWER;
}
