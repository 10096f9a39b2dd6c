// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Levels on the pins (protocol sections 3.3 and 5.2).
 *
 * A level is worked out, never stored as truth: an axis enable or an output
 * drives its pin, else a wire from another pin does, else a switch of the machine, else the
 * bench, and with nothing connected the pull-up makes it 1. After any change
 * all levels are worked out again (sim_pins_settle) and compared with those
 * before, and that comparison is the only place where edges are seen:
 * counters and encoders on pins cannot miss one or count it twice.
 *
 * The electrical rule of an output is odd and from the sheet: not inverted,
 * writing 0 drives the pin high.
 */
#include "sim/request.h"

static uint64_t bit(unsigned int pin)
{
	return UINT64_C(1) << pin;
}

static bool is_output(const struct sim_device *dev, unsigned int pin)
{
	return dev->config.pins.function[pin] & SIM_PIN_DIGITAL_OUT;
}

static bool is_input(const struct sim_device *dev, unsigned int pin)
{
	return dev->config.pins.function[pin] &
	       (SIM_PIN_DIGITAL_IN | SIM_PIN_TRIGGERED_IN | SIM_PIN_COUNTER);
}

static unsigned int inverted(const struct sim_device *dev, unsigned int pin)
{
	return dev->config.pins.function[pin] & SIM_PIN_INVERT ? 1 : 0;
}

void sim_pins_reset(struct sim_device *dev)
{
	const struct sim_pins_config *config = &dev->config.pins;

	memset(&dev->pins, 0, sizeof(dev->pins));
	if (config->startup_valid)
		dev->pins.latch = wire_get_u56(config->startup_values);
	dev->pins.level = dev->bench.pins.level;
	dev->dirty = true;
}

void sim_pins_bench_init(struct sim_pins_bench *bench)
{
	bench->level = UINT64_MAX;
	memset(bench->wire, SIM_NO_PIN, sizeof(bench->wire));
}

static unsigned int emergency_pin(const struct sim_device *dev)
{
	unsigned int setting = dev->config.engine.emergency_pin;
	unsigned int base = dev->options.choices.emergency_base;

	return setting > base ? setting - base - 1 : SIM_DEFAULT_EMERGENCY_PIN;
}

/* Level of a pin, following wires at most `hops` far: a ring of wires floats high. */
static unsigned int level_of(const struct sim_device *dev, unsigned int pin, unsigned int hops)
{
	const struct sim_pins_bench *bench = &dev->bench.pins;
	int driven;

	driven = sim_engine_enable_pin(dev, pin);
	if (driven >= 0)
		return (unsigned int)driven;
	if (is_output(dev, pin))
		return (dev->pins.latch >> pin & 1) == inverted(dev, pin);
	if (bench->wire[pin] < SIM_PINS)
		return hops ? level_of(dev, bench->wire[pin], hops - 1) : 1;
	driven = sim_machine_pin(&dev->bench.machine, pin, emergency_pin(dev));
	if (driven < 0)
		driven = sim_servos_pin(dev, pin);
	if (driven >= 0)
		return (unsigned int)driven;
	return bench->level >> pin & 1;
}

unsigned int sim_pin_level(const struct sim_device *dev, unsigned int pin)
{
	return pin < SIM_PINS ? level_of(dev, pin, SIM_PINS) : 1;
}

/* One count for each enabled edge; down while the direction pin is high. */
static void count_edges(struct sim_device *dev, uint64_t before, uint64_t after)
{
	const struct sim_pins_config *config = &dev->config.pins;

	for (uint64_t rest = before ^ after; rest; rest &= rest - 1) {
		unsigned int pin = (unsigned int)__builtin_ctzll(rest);
		uint8_t edge = after & bit(pin) ? SIM_COUNT_RISING : SIM_COUNT_FALLING;
		unsigned int way = config->direction[pin];

		if (!(config->function[pin] & SIM_PIN_COUNTER) ||
		    !(config->counter_option[pin] & edge))
			continue;
		if (way && way < SIM_PINS && (after & bit(way)))
			dev->pins.counter[pin]--;
		else
			dev->pins.counter[pin]++;
	}
}

void sim_pins_settle(struct sim_device *dev)
{
	uint64_t before = dev->pins.level;
	uint64_t after = 0;

	dev->dirty = false;
	for (unsigned int pin = 0; pin < SIM_PINS; pin++) {
		if (sim_pin_level(dev, pin))
			after |= bit(pin);
	}
	dev->pins.level = after;
	before &= bit(SIM_PINS) - 1;
	if (before == after)
		return;
	count_edges(dev, before, after);
	sim_encoders_pins(dev, before, after);
}

uint64_t sim_pins_inputs(const struct sim_device *dev)
{
	uint64_t inputs = 0;

	for (unsigned int pin = 0; pin < SIM_PINS; pin++) {
		unsigned int value = 0;

		if (is_output(dev, pin))
			value = dev->pins.latch >> pin & 1;
		else if (is_input(dev, pin))
			value = (dev->pins.level >> pin & 1) ^ inverted(dev, pin);
		inputs |= (uint64_t)value << pin;
	}
	return inputs;
}

void sim_pins_write(struct sim_device *dev, uint64_t values, uint64_t mask)
{
	mask &= bit(SIM_PINS) - 1;
	for (unsigned int pin = 0; pin < SIM_PINS; pin++) {
		if (!is_output(dev, pin))
			mask &= ~bit(pin);
	}
	dev->pins.latch = (dev->pins.latch & ~mask) | (values & mask);
	dev->dirty = true;
}
