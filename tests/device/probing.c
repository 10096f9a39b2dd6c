/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Probing by the device: the latched position is exact whatever the network
 * does; nothing touched, already touching, hybrid, cancelled, refused.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

#define SURFACE 700
#define INPUT 5

static struct world world;

static const struct pokeys_engine *engine(void)
{
	return &world.state.engine;
}

static int begin(void **state)
{
	const struct sim_switch probe = {
		.wired = true,
		.normally_open = true,
		.pin = SIM_PROBE_INPUT + INPUT,
		.from = SURFACE,
		.to = INT32_MAX,
	};

	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.probe, &probe);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	world_run(&world, 5 * MS);
	return 0;
}

static struct pokeys_one_shot probe(int32_t most)
{
	return (struct pokeys_one_shot){
		.operation = POKEYS_ONE_SHOT_PROBE,
		.mask = 1,
		.index = INPUT,
		.value = { most },
		.parameter = { 0, 0.25f },
	};
}

static enum pokeys_outcome finish(void)
{
	const struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_PROBE_FINISH };

	return world_do(&world, &shot, 2 * SECOND);
}

static bool is_working(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_WORKING;
}

static void contact_is_latched_exactly(void **state)
{
	const struct pokeys_one_shot shot = probe(5000);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	assert_int_equal(engine()->task_result, POKEYS_TASK_DONE);
	assert_in_range(engine()->axis[0].probe, SURFACE, SURFACE + 5);
	assert_int_equal(engine()->axis[0].probe, world.rig.device.engine.probe_position[0]);
	assert_int_equal(engine()->probe_status, 1);
	assert_int_equal(engine()->task_phase, POKEYS_TASK_IDLE);
}

static void touching_nothing_is_not_found(void **state)
{
	const struct pokeys_one_shot shot = probe(-400);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_FAILED);
	assert_int_equal(engine()->task_result, POKEYS_TASK_NOT_FOUND);
	assert_int_equal(engine()->probe_status, 0);
}

static void probed_axis_does_not_follow_the_old_command(void **state)
{
	const struct pokeys_one_shot shot = probe(5000);
	int32_t there;

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	there = engine()->axis[0].position;
	world_run(&world, 300 * MS);
	assert_int_equal(engine()->axis[0].position, there);
	world.command.axis[0].enable = 0;
	world_run(&world, 3 * MS);
	world_go(&world, 0, 0, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(engine()->axis[0].position, 0);
}

static void finish_ends_it_at_once(void **state)
{
	const struct pokeys_one_shot shot = probe(5000);

	(void)state;
	world_one_shot(&world, &shot);
	world_until(&world, is_working, 200 * MS);
	assert_int_equal(finish(), POKEYS_OUTCOME_DONE);
	assert_int_equal(engine()->task_result, POKEYS_TASK_CANCELLED);
	assert_true(engine()->axis[0].position < SURFACE);
	assert_int_equal(finish(), POKEYS_OUTCOME_DONE);
}

static void hybrid_probe_stops_the_commanders_own_motion(void **state)
{
	struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_PROBE,
					.index = INPUT,
					.flags = POKEYS_PROBE_HYBRID };
	const uint32_t id = world_one_shot(&world, &shot);

	(void)state;
	world_until(&world, is_working, 200 * MS);
	world_go(&world, 0, 5000, 4000);
	while (world_outcome(&world, id) == POKEYS_OUTCOME_NONE)
		world_cycle(&world);
	assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_DONE);
	assert_in_range(engine()->axis[0].probe, SURFACE, SURFACE + 5);
	world_run(&world, 500 * MS);
	assert_in_range(engine()->axis[0].position, SURFACE, SURFACE + 60);
	assert_int_equal(engine()->axis[0].parked, 1);
}

static void hybrid_probe_without_contact_lets_the_motion_go_on(void **state)
{
	struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_PROBE,
					.index = INPUT,
					.flags = POKEYS_PROBE_HYBRID };
	const uint32_t id = world_one_shot(&world, &shot);

	(void)state;
	world_until(&world, is_working, 200 * MS);
	world_go(&world, 0, -3000, 4000);
	world_run(&world, 100 * MS);
	assert_int_equal(finish(), POKEYS_OUTCOME_DONE);
	assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_FAILED);
	assert_int_equal(engine()->task_result, POKEYS_TASK_NOT_FOUND);
	assert_int_equal(engine()->state, WIRE_ENGINE_RUNNING);
	world_run(&world, 1 * SECOND);
	assert_int_equal(engine()->axis[0].position, -3000);
}

static void what_is_not_valid_is_refused(void **state)
{
	const float speeds[] = { NAN, INFINITY, 0, -0.5f, 1.5f };
	struct pokeys_one_shot shot;

	(void)state;
	for (size_t i = 0; i < sizeof(speeds) / sizeof(speeds[0]); i++) {
		shot = probe(5000);
		shot.parameter[1] = speeds[i];
		world_refuses(&world, &shot, REFUSAL_VALUE, 0);
	}
	shot = probe(5000);
	shot.index = 0;
	world_refuses(&world, &shot, REFUSAL_PROBE_INPUT, 0);
	shot.index = 64;
	world_refuses(&world, &shot, REFUSAL_PROBE_INPUT, 0);
	shot = probe(5000);
	shot.flags = 4;
	world_refuses(&world, &shot, REFUSAL_VALUE, 0);
	shot = probe(1 << 25);
	world_refuses(&world, &shot, REFUSAL_POSITION, 0);
	shot = probe(5000);
	shot.flags = POKEYS_PROBE_HYBRID;
	world_refuses(&world, &shot, REFUSAL_HYBRID_AXES, 0);
	shot = probe(5000);
	shot.mask = 0x80;
	world_refuses(&world, &shot, REFUSAL_AXIS_OFF, 7);
	shot = probe(0);
	shot.mask = 0;
	world_refuses(&world, &shot, REFUSAL_NO_AXIS, 0);
	world.command.flags = 0;
	world_run(&world, 100 * MS);
	shot = probe(5000);
	world_refuses(&world, &shot, REFUSAL_MACHINE_OFF, 0);
	assert_int_equal(world.sent.pulse[0x23], 0);
}

/* Loss either delays it or fails it in words; a position that is told is the right one. */
static void what_is_told_is_exact_under_loss(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 0, 2 * MS, 0 },
		.loss = 0.05,
	};
	unsigned int done = 0;

	for (unsigned int round = 0; round < 60; round++) {
		const struct pokeys_one_shot shot = probe(5000);

		begin(state);
		sim_prng_init(&world.rig.link.way[0].prng, 100 + round);
		sim_prng_init(&world.rig.link.way[1].prng, 200 + round);
		world_faults(&world, &faults);
		if (world_do(&world, &shot, 5 * SECOND) != POKEYS_OUTCOME_DONE)
			continue;
		done++;
		assert_int_equal(engine()->axis[0].probe,
				 world.rig.device.engine.probe_position[0]);
	}
	assert_true(done > 40);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(contact_is_latched_exactly, begin),
		cmocka_unit_test_setup(touching_nothing_is_not_found, begin),
		cmocka_unit_test_setup(probed_axis_does_not_follow_the_old_command, begin),
		cmocka_unit_test_setup(finish_ends_it_at_once, begin),
		cmocka_unit_test_setup(hybrid_probe_stops_the_commanders_own_motion, begin),
		cmocka_unit_test_setup(hybrid_probe_without_contact_lets_the_motion_go_on, begin),
		cmocka_unit_test_setup(what_is_not_valid_is_refused, begin),
		cmocka_unit_test(what_is_told_is_exact_under_loss),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
