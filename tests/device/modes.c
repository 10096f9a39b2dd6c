/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Axes of all modes in one device: at any period of the daemon, with clocks that
 * drift apart, stopped in the middle, and probing beside the commander's motion.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

#define SURFACE 700
#define INPUT 5

static struct world world;

static int64_t pulses(unsigned int axis)
{
	sim_rig_run(&world.rig, world_device_time(&world));
	return world.rig.device.engine.axis[axis].pulses;
}

static bool is_running(struct world *w)
{
	return w->state.engine.state == WIRE_ENGINE_RUNNING;
}

static void go(unsigned int axis, enum pokeys_axis_mode mode, int32_t position, float velocity)
{
	world.command.axis[axis] = (struct pokeys_axis_command){
		.position = position,
		.velocity = velocity,
		.mode = (uint8_t)mode,
		.enable = 1,
	};
}

static void begin(uint64_t period_ns, const enum pokeys_axis_mode modes[3])
{
	static const uint8_t options[] = {
		[POKEYS_AXIS_POSITION] = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER |
					 WIRE_AXIS_POSITION_MODE,
		[POKEYS_AXIS_VELOCITY] = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER,
		[POKEYS_AXIS_BUFFERED] = WIRE_AXIS_ENABLED,
	};
	const struct sim_rig_options rig = {
		.service_ns = 20 * US, .device.choices.count_free = true,
		.link.faults = {
			{ .delay = { .low_ns = 10 * US } }, { .delay = { .low_ns = 10 * US } },
		},
	};
	const struct sim_switch probe = {
		.wired = true,
		.normally_open = true,
		.pin = SIM_PROBE_INPUT + INPUT,
		.from = SURFACE,
		.to = INT32_MAX,
	};

	world_init(&world, &rig);
	world_axes(&world);
	for (unsigned int i = 0; i < 3; i++)
		world.config.settings.axis[i].options = options[modes[i]];
	sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.probe, &probe);
	world.config.period_ns = period_ns;
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, SECOND);
	for (unsigned int i = 0; i < 3; i++)
		go(i, modes[i], 0, 0);
	world_machine_on(&world);
	world_until(&world, is_running, SECOND);
	world_run(&world, 100 * MS);
}

static const enum pokeys_axis_mode mixed[3] = {
	POKEYS_AXIS_POSITION,
	POKEYS_AXIS_BUFFERED,
	POKEYS_AXIS_VELOCITY,
};
static const enum pokeys_axis_mode two_kinds[3] = {
	POKEYS_AXIS_POSITION,
	POKEYS_AXIS_BUFFERED,
	POKEYS_AXIS_POSITION,
};
static const enum pokeys_axis_mode all_buffered[3] = {
	POKEYS_AXIS_BUFFERED,
	POKEYS_AXIS_BUFFERED,
	POKEYS_AXIS_BUFFERED,
};

/* A sine of a second on all axes; those driven by speed run and stand again. */
static void ends_exactly(uint64_t period_ns, const enum pokeys_axis_mode modes[3])
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 10 * US, 2 * MS, 0 },
		.loss = 0.01,
	};
	const uint64_t from = world.tick;
	double t = 0;

	world_faults(&world, &faults);
	for (; t < 3; t = (double)(world.tick - from) / 1e9) {
		for (unsigned int i = 0; i < 3; i++)
			go(i, modes[i], (int32_t)(1000 * (i + 1) * (1 - cos(6.2831853 * t))),
			   modes[i] == POKEYS_AXIS_VELOCITY ? (float)(3000 * sin(6 * t)) : 0);
		world_cycle(&world);
	}
	for (unsigned int i = 0; i < 3; i++)
		go(i, modes[i], 12345 - 7000 * (int32_t)i, 0);
	world_run(&world, 4 * SECOND);
	for (unsigned int i = 0; i < 3; i++) {
		const int64_t there = pulses(i);

		if (modes[i] != POKEYS_AXIS_VELOCITY && there != 12345 - 7000 * (int32_t)i)
			fail_msg("period %llu us, axis %u is at %lld",
				 (unsigned long long)(period_ns / US), i, (long long)there);
		world_run(&world, 200 * MS);
		assert_int_equal(pulses(i), there);
	}
}

static void every_mode_at_every_period_under_loss(void **state)
{
	static const uint64_t periods[] = { 4 * MS, 2 * MS, 1 * MS, 500 * US, 250 * US };

	(void)state;
	for (size_t i = 0; i < sizeof(periods) / sizeof(periods[0]); i++) {
		begin(periods[i], mixed);
		ends_exactly(periods[i], mixed);
		begin(periods[i], two_kinds);
		ends_exactly(periods[i], two_kinds);
	}
}

/* 200 ppm in a minute is twelve slots: without a remedy too many or none would be left. */
static void clocks_that_drift_apart_leave_the_level_alone(void **state)
{
	static const int ppm[] = { 200, -200 };

	(void)state;
	for (size_t k = 0; k < 2; k++) {
		unsigned int outside = 0;

		begin(1 * MS, all_buffered);
		world.device_ppm = ppm[k];
		for (int32_t ms = 0; ms < 60000; ms++) {
			for (unsigned int i = 0; i < 3; i++)
				go(i, POKEYS_AXIS_BUFFERED, ms * 10, 0);
			world_cycle(&world);
			sim_rig_run(&world.rig, world_device_time(&world));
			outside += ms > 1000 && (world.rig.device.engine.ring.used < 4 ||
						 world.rig.device.engine.ring.used > 8);
		}
		assert_int_equal(world.rig.device.engine.ring.underruns, 0);
		assert_int_equal(outside, 0);
		world_run(&world, 500 * MS);
		for (unsigned int i = 0; i < 3; i++)
			assert_int_equal(pulses(i), 599990);
	}
}

/* ---- stopped in the middle, with any packet lost */

static unsigned int countdown;

static void lose_one(struct world *w, const uint8_t *packet)
{
	(void)packet;
	if (countdown && !--countdown)
		w->swallow = true;
}

static void an_abort_ends_standing_with_any_packet_lost(void **state)
{
	(void)state;
	for (unsigned int nth = 1; nth <= 40; nth++) {
		int64_t there[3];

		begin(1 * MS, all_buffered);
		for (int32_t ms = 0; ms < 150 + (int32_t)nth; ms++) {
			for (unsigned int i = 0; i < 3; i++)
				go(i, POKEYS_AXIS_BUFFERED, ms * 15, 0);
			world_cycle(&world);
		}
		countdown = nth;
		world.watch = lose_one;
		world.command.flags = 0;
		world_run(&world, 500 * MS);
		for (unsigned int i = 0; i < 3; i++)
			there[i] = pulses(i);
		assert_int_equal(world.rig.device.engine.state, WIRE_ENGINE_STOPPED);
		world_run(&world, 300 * MS);
		for (unsigned int i = 0; i < 3; i++) {
			assert_int_equal(pulses(i), there[i]);
			assert_int_equal(world.state.engine.axis[i].position, there[i]);
			go(i, POKEYS_AXIS_BUFFERED, (int32_t)there[i], 0);
		}
		world_machine_on(&world);
		for (unsigned int i = 0; i < 3; i++)
			go(i, POKEYS_AXIS_BUFFERED, 500, 0);
		world_run(&world, 1 * SECOND);
		for (unsigned int i = 0; i < 3; i++)
			assert_int_equal(pulses(i), 500);
	}
}

/* ---- the commander streams, the device watches the probe */

static bool is_working(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_WORKING;
}

static void hybrid_probing_stops_streamed_motion_with_any_packet_lost(void **state)
{
	static const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_PROBE,
		.index = INPUT,
		.flags = POKEYS_PROBE_HYBRID,
	};

	(void)state;
	for (unsigned int nth = 0; nth <= 40; nth++) {
		uint32_t id;
		int32_t at = 0;

		begin(1 * MS, all_buffered);
		id = world_one_shot(&world, &shot);
		world_until(&world, is_working, 500 * MS);
		countdown = nth ? 70 + nth : 0;
		world.watch = lose_one;
		for (unsigned int ms = 0; ms < 3000 && !world_outcome(&world, id); ms++) {
			at += 8;
			go(0, POKEYS_AXIS_BUFFERED, at, 0);
			world_cycle(&world);
		}
		assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_DONE);
		/* latched in the slot of the contact */
		assert_in_range(world.state.engine.axis[0].probe, SURFACE, SURFACE + 8);
		world_run(&world, 300 * MS);
		assert_int_equal(world.state.engine.axis[0].parked, 1);
		assert_in_range(pulses(0), SURFACE, SURFACE + 100);
		at = (int32_t)pulses(0);
		world_run(&world, 300 * MS);
		assert_int_equal(pulses(0), at);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_mode_at_every_period_under_loss),
		cmocka_unit_test(clocks_that_drift_apart_leave_the_level_alone),
		cmocka_unit_test(an_abort_ends_standing_with_any_packet_lost),
		cmocka_unit_test(hybrid_probing_stops_streamed_motion_with_any_packet_lost),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
