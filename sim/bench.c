// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Changes of the world outside. Each sets something and then lets the pins
 * settle at once: an edge made here is counted before the next one can be
 * made, however little time lies between the two.
 */
#include "sim/bench.h"

void sim_bench_pin(struct sim_device *dev, unsigned int pin, unsigned int level)
{
	uint64_t bit = UINT64_C(1) << pin;

	dev->bench.pins.level = level ? dev->bench.pins.level | bit : dev->bench.pins.level & ~bit;
	sim_pins_settle(dev);
}

void sim_bench_blink(struct sim_device *dev, unsigned int pin, uint32_t ms)
{
	uint64_t bit = UINT64_C(1) << pin;

	dev->bench.blink_ms[pin] = ms;
	dev->bench.blinking = ms ? dev->bench.blinking | bit : dev->bench.blinking & ~bit;
}

void sim_bench_wire(struct sim_device *dev, unsigned int from, unsigned int to)
{
	dev->bench.pins.wire[to] = (uint8_t)from;
	sim_pins_settle(dev);
}

void sim_bench_emergency(struct sim_device *dev, bool pressed)
{
	dev->bench.machine.emergency_pressed = pressed;
	sim_pins_settle(dev);
}

void sim_bench_switch(struct sim_device *dev, struct sim_switch *place,
		      const struct sim_switch *value)
{
	*place = *value;
	sim_machine_rewired(&dev->bench.machine);
	sim_pins_settle(dev);
}

void sim_bench_couple(struct sim_device *dev, unsigned int axis, int encoder, int32_t num,
		      int32_t den, int64_t index_every)
{
	struct sim_mechanics *m = &dev->bench.machine.axis[axis];

	m->encoder = encoder;
	m->ratio_num = num;
	m->ratio_den = den > 0 ? den : 1;
	m->ratio_rest = 0;
	m->index_every = index_every;
}

void sim_bench_encoder(struct sim_device *dev, unsigned int encoder, uint32_t raw)
{
	dev->encoders.raw[encoder] = raw;
}

void sim_bench_spindle(struct sim_device *dev, int64_t rpm, int64_t steps)
{
	struct sim_shaft *shaft = &dev->bench.shaft[SIM_ULTRA_FAST];

	shaft->index_every = steps ? steps : SIM_SPINDLE_STEPS;
	shaft->rate = rpm * shaft->index_every / 60;
}
