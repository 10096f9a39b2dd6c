/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The lathe's commander sets the pace of a spindle at its target speed, as a G-code of
 * its own would; what the device makes of it is what the tests look at.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/thread_rig.h"
#include "wire/pulse.h"

struct world world;

const struct pokeys_engine *engine(void)
{
	return &world.state.engine;
}

const struct pokeys_threading *threading(void)
{
	return &world.state.threading;
}

int64_t pulses(unsigned int axis)
{
	sim_rig_run(&world.rig, world.now);
	return world.rig.device.engine.axis[axis].pulses;
}

bool is_idle(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_IDLE;
}

bool is_prepared(struct world *w)
{
	return w->state.threading.prepared;
}

bool is_active(struct world *w)
{
	return w->state.threading.active;
}

static bool is_on(struct world *w)
{
	return w->state.engine.state == WIRE_ENGINE_RUNNING && w->state.engine.axis[Z].enabled;
}

void go(unsigned int axis, int32_t position)
{
	world.command.axis[axis] = (struct pokeys_axis_command){
		.position = position,
		.mode = POKEYS_AXIS_BUFFERED,
		.enable = 1,
	};
}

void spin(double rpm)
{
	struct sim_shaft *shaft = &world.rig.device.bench.shaft[SIM_ULTRA_FAST];

	sim_rig_run(&world.rig, world.now);
	shaft->index_every = STEPS;
	shaft->rate = (int64_t)(rpm * STEPS / 60);
}

void switch_on(uint32_t session)
{
	world_start(&world);
	world_commander(&world, session);
	world_until(&world, world_is_running, 3 * SECOND); /* the engine may be restarted */
	for (unsigned int i = 0; i < 3; i++)
		go(i, (int32_t)pulses(i));
	world_machine_on(&world);
	world_until(&world, is_on, 500 * MS);
	world_run(&world, 100 * MS);
}

void begin_with(bool count_free, uint8_t ignore)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US, .device.choices.count_free = count_free,
		.link.faults = {
			{ .delay = { .low_ns = 25 * US } }, { .delay = { .low_ns = 25 * US } },
		},
	};
	struct pokeys_settings *settings = &world.config.settings;

	world_init(&world, &options);
	world_axes(&world);
	world_fast_encoders(&world, false, true);
	for (unsigned int i = 0; i < 3; i++) {
		settings->axis[i] = settings->axis[0];
		settings->axis[i].options = WIRE_AXIS_ENABLED;
		settings->axis[i].options_mask = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER |
						 WIRE_AXIS_POSITION_MODE;
		settings->axis[i].max_speed = 125000;
		settings->axis[i].max_acceleration = 1e7f;
	}
	settings->set |= POKEYS_SET_THREADING;
	settings->threading_mode = 1;
	settings->threading_ticks = STEPS / 4; /* every fourth edge is counted */
	settings->threading_rpm = TARGET;
	settings->threading_speed_gain = 200;
	settings->threading_position_gain = 100;
	settings->threading_ignore = ignore;
	switch_on(5);
	spin(500);
	world_run(&world, 300 * MS);
}

int begin(void **state)
{
	(void)state;
	begin_with(true, 0);
	return 0;
}

enum pokeys_outcome shot(uint8_t operation)
{
	const struct pokeys_one_shot one = { .operation = operation };

	return world_do(&world, &one, 12 * SECOND);
}

uint32_t queue(uint8_t operation)
{
	const struct pokeys_one_shot one = { .operation = operation };

	return world_one_shot(&world, &one);
}

void prepare(void)
{
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_PREPARE), POKEYS_OUTCOME_DONE);
	assert_int_equal(threading()->prepared, 1);
}

void run(int32_t ms, void (*each)(int32_t ms))
{
	for (int32_t i = 1; i <= ms; i++) {
		go(Z, -i * FEED);
		go(X, i * FEED / 2);
		if (each)
			each(i);
		world_cycle(&world);
	}
}

void arm_with_the_motion(int32_t ms)
{
	if (ms == 1)
		queue(POKEYS_ONE_SHOT_THREAD_ARM);
}

/* All commands pass where the axes stand: none of them takes anything up again. */
static void stays_although_the_command_passes(int64_t here)
{
	for (unsigned int i = 0; i < 3; i++)
		go(i, (int32_t)pulses(i));
	world_run(&world, 200 * MS);
	go(Z, (int32_t)here - 100);
	world_run(&world, 200 * MS);
	assert_int_equal(pulses(Z), here);
	assert_int_equal(engine()->state, WIRE_ENGINE_STOPPED);
	go(Z, (int32_t)here);
	world_machine_on(&world);
	world_until(&world, is_on, 500 * MS);
}

void stopped(uint8_t result)
{
	int64_t here;

	world_until(&world, is_idle, 8 * SECOND);
	assert_int_equal(engine()->task_result, result);
	world_run(&world, 100 * MS);
	here = pulses(Z);
	if (engine()->axis[Z].parked)
		go(Z, -100000);
	world_run(&world, 300 * MS);
	assert_int_equal(pulses(Z), here);
	assert_int_equal(world.rig.device.engine.thread.state, SIM_THREAD_OFF);
	stays_although_the_command_passes(here);
}
