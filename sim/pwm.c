// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * PWM (protocol section 3.7) and the simple pulse generator (0x4C). Duties
 * stand at @9, one byte off any alignment.
 */
#include "sim/request.h"
#include "wire/io.h"

uint32_t sim_pwm_duty(const struct sim_device *dev, unsigned int channel)
{
	const uint32_t duty = dev->config.pwm.duty[channel];

	return dev->now_ns < dev->run.pwm_until_ns[channel] ? dev->run.pwm_pulse[channel] : duty;
}

/* CHOICE: duties alone have their effect with the next period, as timers have it. */
static void write_duties(struct sim_device *dev, const uint8_t *rq)
{
	struct sim_pwm_config *pwm = &dev->config.pwm;
	const uint64_t period_ns = (uint64_t)pwm->period * WIRE_PWM_TICK_NS;
	const uint64_t passed_ns = period_ns ? (dev->now_ns - dev->run.pwm_begun_ns) % period_ns :
					       0;

	for (unsigned int i = 0; i < 6; i++) {
		dev->run.pwm_pulse[i] = sim_pwm_duty(dev, i);
		dev->run.pwm_until_ns[i] = dev->now_ns + period_ns - passed_ns;
		pwm->duty[i] = wire_get_u32(rq + 9 + 4 * i);
	}
}

static void begin_period(struct sim_device *dev, const uint8_t *rq)
{
	struct sim_pwm_config *pwm = &dev->config.pwm;

	for (unsigned int i = 0; i < 6; i++) {
		pwm->duty[i] = wire_get_u32(rq + 9 + 4 * i);
		dev->run.pwm_until_ns[i] = 0;
	}
	pwm->enabled = rq[8];
	pwm->period = wire_get_u32(rq + 33);
	dev->run.pwm_begun++;
	dev->run.pwm_begun_ns = dev->now_ns;
}

SIM_HANDLER(sim_do_pwm)
{
	struct sim_pwm_config *pwm = &dev->config.pwm;

	if (rq[P1] && rq[P2] == 1)
		write_duties(dev, rq);
	else if (rq[P1])
		begin_period(dev, rq);
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
	dev->run.blip[pin].end_ns = dev->now_ns + UINT64_C(100000) * dev->run.blip[pin].period *
							  dev->run.blip[pin].left;
	return SIM_ANSWER;
}
