/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Hand wheels at the device: axes follow them while it is wished, and at no other
 * time. Afterwards no axis jumps to where its commander still points.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

enum { WHEEL = 5, PULSES = 10 }; /* of one count */

static struct world world;

static bool is_idle(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_IDLE;
}

static bool is_working(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_WORKING;
}

/* Axes 0 and 2 have the wheel, axis 1 has none. */
static int begin(void **state)
{
	struct pokeys_settings *settings = &world.config.settings;

	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	settings->encoder[WHEEL].options = settings->encoder[WHEEL].options_mask = 3;
	for (unsigned int i = 0; i < 3; i += 2) {
		struct pokeys_axis_settings *axis = &settings->axis[i];

		axis->set |= POKEYS_AXIS_SET_MPG_ENCODER | POKEYS_AXIS_SET_MPG_MULTIPLIER |
			     POKEYS_AXIS_SET_MPG_DIVIDER;
		axis->mpg_encoder = WHEEL + 1;
		axis->mpg_multiplier = i ? -PULSES : PULSES;
		axis->mpg_divider = 1;
	}
	world_all_moving(&world);
	return 0;
}

static void turn(int64_t counts)
{
	sim_rig_run(&world.rig, world.now);
	sim_encoder_turn(&world.rig.device, WHEEL, counts);
	world_run(&world, 500 * MS);
}

static void jog(void)
{
	const struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_JOG };

	world_one_shot(&world, &shot);
	world_until(&world, is_working, 500 * MS);
}

static enum pokeys_outcome end(void)
{
	const struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_JOG_END };

	return world_do(&world, &shot, 2 * SECOND);
}

static void axes_follow_their_wheel(void **state)
{
	(void)state;
	turn(50);
	assert_int_equal(world_pulses(&world, 0), 0);
	jog();
	assert_int_equal(world.state.engine.task, POKEYS_TASK_JOGGING);
	assert_int_equal(world.state.engine.task_axes, 5);
	turn(30);
	assert_int_equal(world_pulses(&world, 0), 30 * PULSES);
	assert_int_equal(world_pulses(&world, 2), -30 * PULSES);
	assert_int_equal(world_pulses(&world, 1), 0);
	turn(-70);
	assert_int_equal(world_pulses(&world, 0), -40 * PULSES);
	assert_int_equal(end(), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_DONE);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_DONE);
	turn(50);
	assert_int_equal(world_pulses(&world, 0), -40 * PULSES);
}

static void jogged_axis_does_not_jump_back(void **state)
{
	(void)state;
	jog();
	turn(30);
	assert_int_equal(end(), POKEYS_OUTCOME_DONE);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 30 * PULSES);
	assert_int_equal(world.state.engine.axis[0].parked, 1);
	world_go(&world, 1, 700, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 1), 700);
	world_go(&world, 0, 30 * PULSES, 0);
	world_run(&world, 20 * MS);
	world_go(&world, 0, 0, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 0);
}

/* From each of these nothing moves any more, whatever the wheel does. */
static void stands(uint8_t result)
{
	int64_t stopped;

	world_until(&world, is_idle, 1 * SECOND);
	assert_int_equal(world.state.engine.task_result, result);
	world_run(&world, 100 * MS);
	stopped = world_pulses(&world, 0);
	turn(40);
	assert_int_equal(world_pulses(&world, 0), stopped);
}

static void machine_off_ends_it(void **state)
{
	(void)state;
	jog();
	turn(20);
	world.command.flags = 0;
	stands(POKEYS_TASK_CANCELLED);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
}

static void lost_commander_ends_it(void **state)
{
	(void)state;
	jog();
	turn(20);
	world.commanding = false;
	stands(POKEYS_TASK_CANCELLED);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
}

static void emergency_ends_it(void **state)
{
	(void)state;
	jog();
	turn(20);
	sim_bench_emergency(&world.rig.device, true);
	stands(POKEYS_TASK_TRIPPED);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOP_EMERGENCY);
}

static void time_limit_ends_it(void **state)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_JOG,
		.parameter = { 0.5f },
	};

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_FAILED);
	stands(POKEYS_TASK_TIMED_OUT);
}

static void it_is_refused_without_permission_or_wheel(void **state)
{
	const struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_JOG };

	(void)state;
	world.command.flags = 0;
	world_run(&world, 200 * MS);
	world_refuses(&world, &shot, REFUSAL_MACHINE_OFF, 0);
	for (unsigned int i = 0; i < 3; i++)
		world.config.settings.axis[i].mpg_encoder = 0;
	world_start(&world);
	world_commander(&world, 6);
	world_until(&world, world_is_running, 500 * MS);
	world_machine_on(&world);
	world_refuses(&world, &shot, REFUSAL_NO_HAND_WHEEL, 0);
}

static unsigned int starts;

static void five_starts_do_not_arrive(struct world *w, const uint8_t *p)
{
	if (p[1] != 0x85 || p[2] != 0x02 || p[3] != WIRE_ENGINE_JOGGING)
		return;
	w->swallow = ++starts <= 5;
}

static void it_is_asked_for_until_it_is_heard(void **state)
{
	(void)state;
	starts = 0;
	world.watch = five_starts_do_not_arrive;
	jog();
	assert_int_equal(starts, 6);
	turn(10);
	assert_int_equal(world_pulses(&world, 0), 10 * PULSES);
	assert_int_equal(end(), POKEYS_OUTCOME_DONE);
}

/* At any lost packet: it begins and ends, and the axis is where the wheel has led it. */
static void lost_packets_do_not_matter(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 2 * MS, 0 },
		.loss = 0.1,
	};
	const uint64_t seed = world_seed();

	(void)state;
	sim_prng_init(&world.rig.link.way[0].prng, seed);
	sim_prng_init(&world.rig.link.way[1].prng, ~seed);
	world_faults(&world, &faults);
	for (int i = 1; i <= 20; i++) {
		jog();
		turn(10);
		assert_int_equal(world_pulses(&world, 0), 10 * i * PULSES);
		assert_int_equal(end(), POKEYS_OUTCOME_DONE);
		turn(5);
		assert_int_equal(world_pulses(&world, 0), 10 * i * PULSES);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(axes_follow_their_wheel, begin),
		cmocka_unit_test_setup(jogged_axis_does_not_jump_back, begin),
		cmocka_unit_test_setup(machine_off_ends_it, begin),
		cmocka_unit_test_setup(lost_commander_ends_it, begin),
		cmocka_unit_test_setup(emergency_ends_it, begin),
		cmocka_unit_test_setup(time_limit_ends_it, begin),
		cmocka_unit_test_setup(it_is_refused_without_permission_or_wheel, begin),
		cmocka_unit_test_setup(it_is_asked_for_until_it_is_heard, begin),
		cmocka_unit_test_setup(lost_packets_do_not_matter, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
