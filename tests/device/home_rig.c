/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The axes stand at 0 and search for their home switches downwards, limit switches beyond
 * those.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/home_rig.h"
#include "wire/pulse.h"

struct world world;

void wire_limit(unsigned int axis, int32_t from, int32_t to)
{
	const struct sim_switch limit = {
		.wired = true,
		.pin = SIM_DEDICATED,
		.from = from,
		.to = to,
	};

	sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.axis[axis].minus,
			 &limit);
}

void set_up(uint8_t options, uint8_t switches)
{
	set_up_without(options, switches, 0);
}

void set_up_without(uint8_t options, uint8_t switches, uint8_t without)
{
	const struct sim_switch home = {
		.wired = true,
		.pin = SIM_DEDICATED,
		.from = INT32_MIN,
		.to = HOME_AT,
	};

	world_init(&world, NULL);
	world_axes(&world);
	for (unsigned int i = 0; i < 3; i++) {
		struct pokeys_axis_settings *axis = &world.config.settings.axis[i];

		axis->options |= options;
		axis->options_mask |= options;
		axis->switches = axis->switches_mask = WIRE_SWITCH_HOME | switches;
		if (without >> i & 1)
			axis->switches = switches;
		axis->set |= POKEYS_AXIS_SET_HOMING_SPEED | POKEYS_AXIS_SET_HOMING_RETURN;
		axis->homing_speed = axis->homing_return = 50;
		sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.axis[i].home,
				 &home);
		wire_limit(i, INT32_MIN, HOME_AT - 2000);
	}
	world_all_moving(&world);
}

int begin(void **state)
{
	(void)state;
	set_up(0, 0);
	return 0;
}

struct pokeys_one_shot home(uint8_t mask, uint8_t flags)
{
	return (struct pokeys_one_shot){
		.operation = POKEYS_ONE_SHOT_HOME,
		.mask = mask,
		.flags = flags,
		.value = { 100, 200, 300 },
	};
}

enum pokeys_outcome act(uint8_t operation)
{
	const struct pokeys_one_shot shot = { .operation = operation };

	return world_do(&world, &shot, 20 * SECOND);
}

bool is_idle(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_IDLE;
}

bool is_complete(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_COMPLETE;
}

bool is_working(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_WORKING;
}

void start(uint8_t mask)
{
	const struct pokeys_one_shot shot = home(mask, POKEYS_HOME_FINISH_ITSELF);

	world_one_shot(&world, &shot);
	world_until(&world, is_working, 200 * MS);
}
