// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Analog inputs (protocol section 3.6). Values are big endian on the wire, the
 * exception in this protocol.
 *
 * The RC filter runs once a millisecond, the sources do not give the rate; it
 * starts from what it finds when it is switched on. A
 * pin which is not an analog input reads 0, so a client which forgot to
 * configure it is found out.
 */
#include "sim/request.h"

#include <math.h>

static double source_value(const struct sim_device *dev, unsigned int input)
{
	const struct sim_source *source = &dev->bench.analog[input];
	double phase;

	if (!source->period_ms)
		return source->low;
	phase = 2.0 * (double)(dev->stats.slots % source->period_ms) / source->period_ms;
	if (phase > 1)
		phase = 2 - phase;
	return source->low + phase * (source->high - source->low);
}

void sim_analog_slot(struct sim_device *dev)
{
	double rc = dev->config.analog_filter;

	for (unsigned int i = 0; rc > 0 && i < SIM_ANALOGS; i++) {
		double *y = &dev->analog.filtered[i];

		*y = (*y * rc + source_value(dev, i)) / (rc + 1);
	}
}

uint16_t sim_analog_value(const struct sim_device *dev, unsigned int input)
{
	unsigned int pin = SIM_FIRST_ANALOG_PIN + input;
	double value;

	if (input >= SIM_ANALOGS || !(dev->config.pins.function[pin] & SIM_PIN_ANALOG_IN))
		return 0;
	value = dev->config.analog_filter ? dev->analog.filtered[input] : source_value(dev, input);
	return (uint16_t)lrint(fmin(value, SIM_ANALOG_MAX));
}

static uint16_t by_pin(const struct sim_device *dev, unsigned int pin)
{
	return pin < SIM_FIRST_ANALOG_PIN ? 0 : sim_analog_value(dev, pin - SIM_FIRST_ANALOG_PIN);
}

SIM_HANDLER(sim_do_analog_one)
{
	unsigned int pin = rq[P1];
	uint16_t value = by_pin(dev, pin);

	if (pin < SIM_FIRST_ANALOG_PIN || pin >= SIM_FIRST_ANALOG_PIN + SIM_ANALOGS) {
		rp[P1] = 1;
		return SIM_ANSWER;
	}
	rp[3] = (uint8_t)(value >> 4);
	rp[4] = (uint8_t)(value >> 8);
	rp[5] = (uint8_t)value;
	return SIM_ANSWER;
}

/* Old forms: four pins of 8 bits, or three of 10 bits packed low bits first. */
SIM_HANDLER(sim_do_analog_packed)
{
	uint32_t packed = 0;

	if (rq[WIRE_AT_OP] == 0x36) {
		for (unsigned int i = 0; i < 4; i++)
			rp[2 + i] = (uint8_t)(by_pin(dev, rq[2 + i]) >> 4);
		return SIM_ANSWER;
	}
	for (unsigned int i = 0; i < 3; i++)
		packed |= (uint32_t)(by_pin(dev, rq[2 + i]) >> 2) << (10 * i);
	wire_put_u32(rp + 2, packed);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_analog_filter)
{
	if (rq[WIRE_AT_OP] == 0x39 && !sim_locked(dev)) {
		for (unsigned int i = 0; !dev->config.analog_filter && i < SIM_ANALOGS; i++)
			dev->analog.filtered[i] = source_value(dev, i);
		dev->config.analog_filter = wire_get_u32(rq + 2);
	}
	wire_put_u32(rp + 2, dev->config.analog_filter);
	return SIM_ANSWER;
}

/* With a count of 0 all seven come from pin 41 on, whatever the first pin says (D9). */
SIM_HANDLER(sim_do_analog_all)
{
	unsigned int first = rq[P2] ? rq[P1] : SIM_FIRST_ANALOG_PIN;
	unsigned int count = rq[P2] ? rq[P2] : SIM_ANALOGS;

	for (unsigned int i = 0; i < count && i < WIRE_PAYLOAD_LEN / 2; i++)
		wire_put_u16be(rp + 8 + 2 * i, by_pin(dev, first + i));
	return SIM_ANSWER;
}

/* Series 55 only has an analog output; all others refuse. */
SIM_HANDLER(sim_do_analog_out)
{
	(void)dev;
	(void)rq;
	rp[P1] = 1;
	return SIM_ANSWER;
}
