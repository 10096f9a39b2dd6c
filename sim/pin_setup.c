// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What each pin is (protocol section 3.2 and the start-up part of 3.1).
 *
 * Functions are kept as written, also those the pin cannot do: reading back
 * must give what was written, and the sources do not say that a device would
 * refuse. What a pin of this model can do is told by 0x1F.
 */
#include "sim/request.h"

#define CAPS_PER_RANGE 13

SIM_HANDLER(sim_do_pin_set)
{
	unsigned int pin = rq[P1];

	if (pin >= SIM_PINS || sim_locked(dev)) {
		rp[P1] = 1;
		return SIM_ANSWER;
	}
	dev->config.pins.function[pin] = rq[P2];
	dev->config.pins.counter_option[pin] = rq[P3];
	dev->dirty = true;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_pin_get)
{
	unsigned int pin = rq[P1];

	if (pin >= SIM_PINS) {
		rp[P1] = 0xFF;
		return SIM_ANSWER;
	}
	rp[P1] = rq[P1];
	rp[P2] = dev->config.pins.function[pin];
	rp[P3] = dev->config.pins.counter_option[pin];
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_pin_all)
{
	struct sim_pins_config *pins = &dev->config.pins;
	bool options = rq[P2] != 0;

	if (rq[P1] == 1 && !options && !sim_locked(dev))
		memcpy(pins->function, rq + 8, SIM_PINS);
	if (rq[P2] == 2 && !sim_locked(dev))
		memcpy(pins->counter_option, rq + 8, SIM_PINS);
	dev->dirty = true;
	memcpy(rp + 8, options ? pins->counter_option : pins->function, SIM_PINS);
	return SIM_ANSWER;
}

/* Capability bits of a pin: as the function byte, and PWM beyond it. */
static uint32_t caps(const struct sim_device *dev, unsigned int pin)
{
	static const struct {
		enum wire_pin_use use;
		uint32_t bit;
	} uses[] = {
		{ WIRE_USE_INPUT, SIM_PIN_DIGITAL_IN },
		{ WIRE_USE_OUTPUT, SIM_PIN_DIGITAL_OUT },
		{ WIRE_USE_ANALOG, SIM_PIN_ANALOG_IN },
		{ WIRE_USE_COUNTER, SIM_PIN_COUNTER },
		{ WIRE_USE_PWM, 1u << 13 },
	};
	const struct wire_model *model = wire_model(dev->options.hardware);
	uint32_t bits = 0;

	for (unsigned int i = 0; i < sizeof(uses) / sizeof(uses[0]); i++) {
		if (wire_pin_can(model, pin + 1, uses[i].use))
			bits |= uses[i].bit;
	}
	return bits;
}

SIM_HANDLER(sim_do_pin_caps)
{
	unsigned int first = rq[P1] * CAPS_PER_RANGE;

	rp[P1] = rq[P1];
	for (unsigned int i = 0; i < CAPS_PER_RANGE && first + i < SIM_PINS; i++)
		wire_put_u32(rp + 8 + 4 * i, caps(dev, first + i));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_connection_signal)
{
	if (rq[P1] == 1 && !sim_locked(dev))
		dev->config.pins.connection_signal = rq[P2];
	rp[P2] = dev->config.pins.connection_signal;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_startup)
{
	struct sim_pins_config *pins = &dev->config.pins;

	if (rq[P1] == 1 && !sim_locked(dev)) {
		pins->startup_auto = rq[P2];
		pins->startup_valid = rq[P3];
		if (rq[P3])
			memcpy(pins->startup_values, rq + 8, sizeof(pins->startup_values));
	}
	rp[P1] = pins->startup_auto;
	rp[P2] = pins->startup_valid;
	memcpy(rp + 8, pins->startup_values, sizeof(pins->startup_values));
	return SIM_ANSWER;
}
