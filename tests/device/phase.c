/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device that moves while the cycle is laid to the commander's thread: neither
 * buffered steps nor references see more of it than the 2 % by which a cycle may be
 * longer or shorter, from whatever phase the lock begins, and not one step is lost.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/rt/phase.h"
#include "tests/device/world.h"
#include "wire/pulse.h"

enum {
	STEPS = 100, /* a servo period */
	RAMP = 15,   /* cycles until the axis has its speed; a lock is sought for 50 and more */
};

#define WRITE_NS (40 * US)		/* from the servo thread's read to its write */

static struct world world;
static struct phase phase;
static uint64_t read_ns, period_ns; /* of the servo thread: its next read */
static int32_t position;
static uint8_t mode;
static bool following, still;

static void go(int32_t to, float velocity)
{
	world.command.axis[0] = (struct pokeys_axis_command){
		.position = to,
		.velocity = velocity,
		.mode = mode,
		.enable = 1,
	};
}

static void begin(uint8_t axis_mode)
{
	struct pokeys_settings *settings = &world.config.settings;

	mode = axis_mode;
	world_init(&world, NULL);
	world_axes(&world);
	settings->axes = 1;
	settings->axis[0].options = (uint8_t)(WIRE_AXIS_ENABLED |
					      (mode == POKEYS_AXIS_POSITION ?
						       WIRE_AXIS_INTERNAL_PLANNER |
							       WIRE_AXIS_POSITION_MODE :
						       0));
	settings->axis[0].options_mask = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER |
					 WIRE_AXIS_POSITION_MODE;
	settings->axis[0].max_speed = 125000;
	settings->axis[0].max_acceleration = 1e8f;
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	go(0, 0);
	world_machine_on(&world);
	world_until(&world, world_is_machine_on, 500 * MS);
	world_run(&world, 100 * MS);
	phase_init(&phase, world.config.period_ns);
	following = still = false;
	position = 0;
}

/* The servo thread up to the next tick, then the cycle that begins there. */
static void cycle(void)
{
	struct phase_stamp stamp = { .period_ns = period_ns };

	world.commanding = false;
	while (read_ns + WRITE_NS <= world.tick) {
		position += still ? 0 : STEPS;
		world.command.period_ns = period_ns;
		go(position, still ? 0 : STEPS * 1e9f / (float)period_ns);
		stamp.read_ns = read_ns;
		stamp.write_ns = read_ns + WRITE_NS;
		read_ns += period_ns;
		world.commanding = true;
	}
	if (following && world.commanding)
		phase_read(&phase, &stamp, world.tick - phase.period_ns,
			   world.state.t_publish_ns - world.tick + phase.period_ns);
	world.length_ns = following ? phase_next(&phase, world.tick) : 0;
	world_cycle(&world);
}

/* The steps of each slot that the device has got in the last cycle. */
static void look_at_slots(uint64_t before, int *least, int *most)
{
	const struct sim_ring *ring = &world.rig.device.engine.ring;

	for (uint64_t i = ring->slots_accepted - before; i > 0; i--) {
		const struct sim_ring_slot *slot =
			&ring->slot[(ring->head + ring->used - i) % SIM_RING_SLOTS];
		const int steps = slot->negative & 1 ? -slot->magnitude[0] : slot->magnitude[0];

		*least = steps < *least ? steps : *least;
		*most = steps > *most ? steps : *most;
	}
}

static void buffered_steps_stay_even_while_the_cycle_is_shifted(void **state)
{
	const struct sim_ring *ring = &world.rig.device.engine.ring;

	(void)state;
	for (uint64_t at = 5; at < 1000; at += 55) {
		int least = INT32_MAX, most = 0;

		begin(POKEYS_AXIS_BUFFERED);
		period_ns = MS + at % 3 * 2 * US; /* up to 0.4 % off, too */
		read_ns = world.tick + at * US;
		following = true;
		for (int i = 0; i < 1500; i++) {
			const uint64_t before = ring->slots_accepted;

			cycle();
			if (i >= RAMP)
				look_at_slots(before, &least, &most);
		}
		assert_true(phase.locked && phase.losses == 0);
		/* 2 % of the cycle, 1 % by which the buffer's level is kept, and rounding */
		assert_in_range(least, STEPS * 97 / 100 - 1, STEPS);
		assert_in_range(most, STEPS, STEPS * 103 / 100 + 1);
		still = true;
		for (int i = 0; i < 200; i++)
			cycle();
		assert_int_equal(world.rig.device.engine.axis[0].pulses, position);
		assert_int_equal(ring->underruns, 0);
		assert_int_equal(world.state.engine.buffer_resyncs, 0);
	}
}

static void each_reference_reaches_the_device_while_the_cycle_is_shifted(void **state)
{
	(void)state;
	for (uint64_t at = 5; at < 1000; at += 55) {
		int32_t before;

		begin(POKEYS_AXIS_POSITION);
		period_ns = MS;
		read_ns = world.tick + at * US;
		for (int i = 0; i < 200; i++)
			cycle();
		following = true;
		for (int i = 0; i < 1500; i++) {
			before = world.state.engine.axis[0].reference;
			cycle();
			/* from then on it leads, by what this speed needs for braking */
			if (i >= RAMP)
				assert_int_equal(world.state.engine.axis[0].reference - before,
						 STEPS);
		}
		assert_true(phase.locked && phase.losses == 0);
		still = true;
		world_run(&world, 2 * SECOND);
		assert_int_equal(world.state.engine.axis[0].position, position);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(buffered_steps_stay_even_while_the_cycle_is_shifted),
		cmocka_unit_test(each_reference_reaches_the_device_while_the_cycle_is_shifted),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
