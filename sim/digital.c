// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Reading inputs and writing outputs (protocol sections 3.3 and 3.4).
 *
 * A pin which is not configured as an output is not touched by any write, so
 * a client which forgets the configuration sees nothing move. An output reads
 * back the logical value last written, whatever its polarity; an unused pin
 * reads 0.
 */
#include "sim/request.h"

SIM_HANDLER(sim_do_input)
{
	unsigned int pin = rq[P1];

	if (pin >= SIM_PINS) {
		rp[P1] = 1;
		return SIM_ANSWER;
	}
	rp[P2] = sim_pins_inputs(dev) >> pin & 1;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_inputs)
{
	uint64_t inputs = sim_pins_inputs(dev);

	if (rq[WIRE_AT_OP] == 0x31) {
		wire_put_u32(rp + 2, (uint32_t)inputs);
	} else {
		wire_put_u16(rp + 2, (uint16_t)(inputs >> 32));
		rp[4] = (uint8_t)(inputs >> 48);
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_output)
{
	unsigned int pin = rq[P1];

	if (pin >= SIM_PINS || !(dev->config.pins.function[pin] & SIM_PIN_DIGITAL_OUT)) {
		rp[P1] = 1;
		return SIM_ANSWER;
	}
	sim_pins_write(dev, rq[P2] ? UINT64_MAX : 0, UINT64_C(1) << pin);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_outputs)
{
	uint64_t high = (uint64_t)wire_get_u16(rq + 2) | (uint64_t)rq[4] << 16;

	(void)rp;
	if (rq[WIRE_AT_OP] == 0x42)
		sim_pins_write(dev, wire_get_u32(rq + 2), UINT32_MAX);
	else
		sim_pins_write(dev, high << 32, UINT64_MAX << 32);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_io)
{
	if (rq[P1] == 1) {
		sim_pins_write(dev, wire_get_u56(rq + 8), ~wire_get_u56(rq + 20));
		sim_pins_settle(dev);
	}
	wire_put_u56(rp + 8, sim_pins_inputs(dev));
	for (unsigned int i = 0; i < 5; i++)
		wire_put_u16be(rp + 15 + 2 * i, sim_analog_value(dev, i + 2));
	for (unsigned int i = 0; i < SIM_BASIC_ENCODERS; i++)
		rp[25 + i] = (uint8_t)dev->encoders.raw[i];
	memcpy(rp + 50, dev->bench.keys, 8);
	if (!(dev->config.panel.keyboard[0] & 1))
		memset(rp + 50, 0, 8);
	wire_put_u32(rp + 58, dev->encoders.raw[SIM_ULTRA_FAST]);
	return SIM_ANSWER;
}
