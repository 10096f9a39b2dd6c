// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The engine's pins: limits, home switches, probe, emergency button in, axis
 * enables out (protocol section 3.24.2, "Switch evaluation").
 *
 * raw is the input level, 1 when the switch is open. Tripped is raw XOR the
 * configured polarity, and never for a switch the axis is not configured to
 * have. So an input with nothing wired to it trips an axis configured for a
 * normally closed switch, as a cut cable must.
 */
#include "sim/engine_part.h"

struct wiring {
	uint8_t present;
	uint8_t invert;
};

static const struct wiring minus_wiring = { SIM_SW_LIMIT_MINUS, SIM_SW_INVERT_MINUS };
static const struct wiring plus_wiring = { SIM_SW_LIMIT_PLUS, SIM_SW_INVERT_PLUS };
static const struct wiring home_wiring = { SIM_SW_HOME, SIM_SW_INVERT_HOME };

/* `dedicated` is the raw level of the axis' own input, used when pin is 0. */
static bool tripped(const struct sim_device *dev, const struct wiring *wiring, uint8_t switches,
		    uint8_t pin, unsigned int dedicated)
{
	unsigned int raw = pin ? sim_pin_level(dev, pin - 1u) : dedicated;

	if (!(switches & wiring->present))
		return false;
	return raw != (switches & wiring->invert ? 1u : 0u);
}

void sim_engine_read_switches(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;
	unsigned int minus = sim_machine_minus(&dev->bench.machine);
	unsigned int plus = sim_machine_plus(&dev->bench.machine);
	unsigned int home = sim_machine_home(&dev->bench.machine);

	pe->minus = pe->plus = pe->home = 0;
	for (unsigned int i = 0; i < dev->config.engine.axes && i < SIM_AXES; i++) {
		const struct sim_axis_setup *setup = &pe->axis[i].setup;
		uint8_t sw = setup->switches;
		uint8_t bit = (uint8_t)(1u << i);

		if (tripped(dev, &minus_wiring, sw, setup->minus_pin, minus >> i & 1u))
			pe->minus = (uint8_t)(pe->minus | bit);
		if (tripped(dev, &plus_wiring, sw, setup->plus_pin, plus >> i & 1u))
			pe->plus = (uint8_t)(pe->plus | bit);
		if (tripped(dev, &home_wiring, sw, setup->home_pin, home >> i & 1u))
			pe->home = (uint8_t)(pe->home | bit);
		if (sw & SIM_SW_HOME_ON_MINUS)
			pe->home = (uint8_t)((pe->home & ~bit) | (pe->minus & bit));
		if (sw & SIM_SW_HOME_ON_PLUS)
			pe->home = (uint8_t)((pe->home & ~bit) | (pe->plus & bit));
	}
}

bool sim_engine_emergency(const struct sim_device *dev)
{
	const struct sim_engine_config *config = &dev->config.engine;
	unsigned int base = dev->options.choices.emergency_base;
	unsigned int pin = SIM_DEFAULT_EMERGENCY_PIN;

	if (!config->emergency_pin)
		return false;
	if (config->emergency_pin > base)
		pin = config->emergency_pin - base - 1;
	return sim_pin_level(dev, pin) != (config->emergency_invert ? 1u : 0u);
}

bool sim_axis_powered(const struct sim_device *dev, unsigned int axis)
{
	const struct sim_engine *pe = &dev->engine;
	uint8_t options = pe->axis[axis].setup.options;

	if (!sim_axis_usable(dev, axis))
		return false;
	if ((options & SIM_AC_MASKED) && !(pe->output_mask >> axis & 1))
		return false;
	if (pe->state == SIM_PE_STOPPED)
		return pe->power_states & 0x01;
	if (pe->state == SIM_PE_STOP_LIMIT)
		return pe->power_states & 0x02;
	if (pe->state == SIM_PE_STOP_EMERGENCY)
		return pe->power_states & 0x04;
	return true;
}

int sim_engine_enable_pin(const struct sim_device *dev, unsigned int pin)
{
	for (unsigned int i = 0; i < dev->config.engine.axes && i < SIM_AXES; i++) {
		const struct sim_axis_setup *setup = &dev->engine.axis[i].setup;

		if (setup->enable_pin == pin + 1)
			return sim_axis_powered(dev, i) != (setup->enable_invert != 0);
	}
	return -1;
}

/* Limits of an axis which is homing on that very switch do not count. */
static uint8_t shared(const struct sim_device *dev, uint8_t option)
{
	const struct sim_engine *pe = &dev->engine;
	uint8_t mask = 0;

	if (pe->state != SIM_PE_HOMING)
		return 0;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if ((pe->home_mask >> i & 1) && pe->axis[i].state != SIM_AX_HOME &&
		    (pe->axis[i].setup.switches & option))
			mask |= (uint8_t)(1u << i);
	}
	return mask;
}

static uint8_t usable_axes(const struct sim_device *dev)
{
	uint8_t mask = 0;

	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (sim_axis_usable(dev, i))
			mask |= (uint8_t)(1u << i);
	}
	return mask;
}

bool sim_engine_limit(const struct sim_device *dev)
{
	const struct sim_engine *pe = &dev->engine;
	unsigned int minus = pe->minus & ~shared(dev, SIM_SW_HOME_ON_MINUS);
	unsigned int plus = pe->plus & ~shared(dev, SIM_SW_HOME_ON_PLUS);

	return !pe->override && ((minus | plus) & usable_axes(dev));
}

bool sim_engine_probe_active(const struct sim_device *dev)
{
	const struct sim_engine *pe = &dev->engine;
	unsigned int level;

	if (!pe->probe_input)
		return false;
	if (pe->probe_input <= 8)
		level = sim_machine_misc(&dev->bench.machine) >> (pe->probe_input - 1) & 1;
	else
		level = sim_pin_level(dev, pe->probe_input - 9u);
	return level == (pe->probe_level ? 1u : 0u);
}
