// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The machine on the test bench.
 *
 * The motor's position is kept apart from the device's counter. Homing and
 * "set position" change the counter only; the switches do not move with it.
 * A model with one position for both cannot be homed twice, and hides every
 * overrun behind a limit (protocol section 5.3).
 *
 * Switches are given as they are wired - normally closed or open, to ground -
 * and only their level is handed on. Whether a level means "tripped" is for
 * the device to say, from the polarity it was configured with; so a machine
 * configured for the wrong kind of switch behaves here as it would in iron.
 */
#include "sim/mechanics.h"

#include <string.h>

#include "sim/engine.h"

void sim_machine_init(struct sim_machine *machine)
{
	memset(machine, 0, sizeof(*machine));
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		machine->axis[i].encoder = -1;
		machine->axis[i].ratio_num = 1;
		machine->axis[i].ratio_den = 1;
	}
	machine->raw_minus = 0xFF;
	machine->raw_plus = 0xFF;
	machine->raw_home = 0xFF;
	machine->emergency_wired = true;
	machine->told_slots = SIM_RING_SLOTS;
	machine->told_slot_time = 10;
}

unsigned int sim_switch_level(const struct sim_switch *sw, int64_t position)
{
	bool actuated = position >= sw->from && position <= sw->to;

	return actuated != sw->normally_open;
}

static bool is_on_pin(const struct sim_switch *sw)
{
	return sw->wired && sw->pin < SIM_PROBE_INPUT;
}

void sim_machine_rewired(struct sim_machine *machine)
{
	machine->any_on_pin = is_on_pin(&machine->probe);
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		const struct sim_mechanics *axis = &machine->axis[i];

		machine->any_on_pin |= is_on_pin(&axis->minus) || is_on_pin(&axis->plus) ||
				       is_on_pin(&axis->home);
	}
}

static int level_on(const struct sim_switch *sw, unsigned int pin, int64_t position)
{
	if (!sw->wired || sw->pin != pin)
		return -1;
	return (int)sim_switch_level(sw, position);
}

int sim_machine_pin(const struct sim_machine *machine, unsigned int pin, unsigned int emergency_pin)
{
	int level;

	if (machine->emergency_wired && pin == emergency_pin)
		return machine->emergency_pressed != machine->emergency_open;
	if (!machine->any_on_pin)
		return -1;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		const struct sim_mechanics *axis = &machine->axis[i];

		level = level_on(&axis->minus, pin, axis->position);
		if (level < 0)
			level = level_on(&axis->plus, pin, axis->position);
		if (level < 0)
			level = level_on(&axis->home, pin, axis->position);
		if (level >= 0)
			return level;
	}
	return level_on(&machine->probe, pin, machine->axis[machine->probe_axis].position);
}

static void dedicated(uint8_t *bits, unsigned int axis, const struct sim_switch *sw,
		      int64_t position)
{
	uint8_t bit = (uint8_t)(1u << axis);

	if (!sw->wired || sw->pin != SIM_DEDICATED)
		return;
	*bits = (uint8_t)(sim_switch_level(sw, position) ? *bits | bit : *bits & ~bit);
}

uint8_t sim_machine_minus(const struct sim_machine *machine)
{
	uint8_t bits = machine->raw_minus;

	for (unsigned int i = 0; i < SIM_AXES; i++)
		dedicated(&bits, i, &machine->axis[i].minus, machine->axis[i].position);
	return bits;
}

uint8_t sim_machine_plus(const struct sim_machine *machine)
{
	uint8_t bits = machine->raw_plus;

	for (unsigned int i = 0; i < SIM_AXES; i++)
		dedicated(&bits, i, &machine->axis[i].plus, machine->axis[i].position);
	return bits;
}

uint8_t sim_machine_home(const struct sim_machine *machine)
{
	uint8_t bits = machine->raw_home;

	for (unsigned int i = 0; i < SIM_AXES; i++)
		dedicated(&bits, i, &machine->axis[i].home, machine->axis[i].position);
	return bits;
}

uint8_t sim_machine_misc(const struct sim_machine *machine)
{
	const struct sim_switch *probe = &machine->probe;
	uint8_t bits = machine->misc;
	unsigned int input;

	if (!probe->wired || probe->pin <= SIM_PROBE_INPUT || probe->pin > SIM_PROBE_INPUT + 8)
		return bits;
	input = 1u << (probe->pin - SIM_PROBE_INPUT - 1);
	if (sim_switch_level(probe, machine->axis[machine->probe_axis].position))
		return (uint8_t)(bits | input);
	return (uint8_t)(bits & ~input);
}
