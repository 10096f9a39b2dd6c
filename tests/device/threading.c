/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Threading by the device: the axes follow the spindle's angle, whatever its speed does
 * and the network, and end exactly where they were led.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/thread_rig.h"
#include "wire/pulse.h"

static void ends_there(int32_t ms)
{
	world_run(&world, 500 * MS);
	assert_int_equal(pulses(Z), -ms * FEED);
	assert_int_equal(pulses(X), ms * FEED / 2);
	assert_int_equal(engine()->axis[Z].following_error, 0);
}

static void ends_exactly(int32_t ms)
{
	ends_there(ms);
	assert_int_equal(engine()->buffer_underruns, 0);
}

/* ... without a step too many on the way. */
static void made_no_detour(int32_t ms)
{
	assert_int_equal(world.rig.device.bench.machine.axis[Z].steps, (uint64_t)ms * FEED);
	assert_int_equal(world.rig.device.bench.machine.axis[X].steps, (uint64_t)ms * FEED / 2);
}

static void it_is_prepared_armed_released(void **state)
{
	(void)state;
	assert_int_equal(world.rig.device.stats.executed_pe[0x36], 1);
	prepare();
	assert_int_equal(engine()->task, POKEYS_TASK_THREADING);
	assert_int_equal(engine()->task_axes, 7);
	run(300, arm_with_the_motion);
	world_until(&world, is_active, 1 * SECOND);
	world_run(&world, 1 * SECOND);
	assert_int_equal(pulses(Z), -3000);
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	assert_int_equal(engine()->task_result, POKEYS_TASK_DONE);
	assert_int_equal(threading()->active | threading()->prepared | threading()->waiting, 0);
	ends_exactly(300);
	made_no_detour(300);
	/* and motion goes on as ever */
	for (int32_t i = 1; i <= 100; i++) {
		go(Z, -3000 + i * FEED);
		world_cycle(&world);
	}
	world_run(&world, 100 * MS);
	assert_int_equal(pulses(Z), -2000);
	assert_int_equal(engine()->buffer_resyncs, 0);
}

static double worst;
static uint64_t dry; /* ms without a slot, as long as there is something to play */

/* Pulses of Z behind the spindle's angle; while there is something to play. */
static void compare(void)
{
	const struct sim_thread *th = &world.rig.device.engine.thread;
	int64_t steps;

	sim_rig_run(&world.rig, world.now);
	steps = world.rig.device.bench.shaft[SIM_ULTRA_FAST].position - th->base;
	if (th->state == SIM_THREAD_ACTIVE && world.rig.device.engine.ring.used) {
		const double due = fmin((double)steps / STEPS * 60000 / TARGET * FEED, 3000 * FEED);

		worst = fmax(worst, fabs(due + (double)world.rig.device.engine.axis[Z].pulses));
		dry = th->dry;
	}
}

static void at_changing_speed(int32_t ms)
{
	arm_with_the_motion(ms);
	spin(ms < 500 ? 500 : 500 - 200 * sin((ms - 500) / 400.0) * sin((ms - 500) / 400.0));
	compare();
}

static void z_follows_the_angle_at_changing_speed(void **state)
{
	(void)state;
	worst = 0;
	dry = UINT64_MAX;
	prepare();
	run(3000, at_changing_speed);
	assert_true(threading()->behind > 200);
	for (int i = 0; i < 4000 && world.rig.device.engine.ring.used; i++) {
		world_cycle(&world);
		compare();
	}
	world_run(&world, 200 * MS);
	printf("within %.0f of 1000 pulses a turn\n", worst);
	assert_true(worst <= 15);
	assert_int_equal(pulses(Z), -30000);
	assert_int_equal(world.rig.device.engine.ring.underruns, 0);
	assert_int_equal(dry, 0);
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	ends_exactly(3000);
	made_no_detour(3000);
}

static void release_in_motion_goes_on_by_the_millisecond(void **state)
{
	(void)state;
	prepare();
	run(800, arm_with_the_motion);
	queue(POKEYS_ONE_SHOT_THREAD_RELEASE);
	for (int32_t i = 801; i <= 2000; i++) {
		go(Z, -i * FEED);
		go(X, i * FEED / 2);
		world_cycle(&world);
	}
	world_until(&world, is_idle, 10 * SECOND);
	assert_int_equal(engine()->task_result, POKEYS_TASK_DONE);
	ends_exactly(2000);
	made_no_detour(2000);
}

static unsigned int releases_to_lose;

static void lose_releases(struct world *w, const uint8_t *packet)
{
	w->swallow = releases_to_lose && packet[1] == 0x85 && packet[2] == 0x33;
	releases_to_lose -= w->swallow;
}

/* A line that is as bad as that for a while is no reason to stop in a thread. */
static void release_is_asked_for_until_it_is_heard(void **state)
{
	(void)state;
	prepare();
	run(300, arm_with_the_motion);
	world_until(&world, is_active, 1 * SECOND);
	world_run(&world, 1 * SECOND);
	releases_to_lose = 40;
	world.watch = lose_releases;
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	assert_int_equal(releases_to_lose, 0);
	assert_int_equal(engine()->task_result, POKEYS_TASK_DONE);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
	ends_exactly(300);
	made_no_detour(300);
}

static void force_does_not_wait(void **state)
{
	(void)state;
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_FORCE), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.rig.device.stats.executed_pe[0x31], 1);
	assert_int_equal(world.rig.device.stats.executed_pe[0x30], 0);
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
}

static void ignored_axis_waits_parked(void **state)
{
	(void)state;
	begin_with(true, 1 << X);
	prepare();
	assert_int_equal(engine()->task_axes, 5);
	assert_int_equal(engine()->axis[X].parked, 1);
	run(300, arm_with_the_motion);
	world_run(&world, 1 * SECOND);
	assert_int_equal(pulses(Z), -3000);
	assert_int_equal(pulses(X), 0);
	assert_int_equal(world.rig.device.engine.thread.ignored, 0);
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	world_run(&world, 500 * MS);
	assert_int_equal(pulses(X), 0);
	go(X, 0);
	world_run(&world, 20 * MS);
	go(X, 40);
	world_run(&world, 200 * MS);
	assert_int_equal(pulses(X), 40);
}

/* Two fast requests a cycle, as without it. */
static void it_costs_no_further_fast_request(void **state)
{
	uint64_t before, status;

	(void)state;
	prepare();
	before = world.sent.operation[0xCC];
	status = world.sent.pulse[0x00] + world.sent.pulse[0x35];
	world_run(&world, 1 * SECOND);
	before = world.sent.operation[0xCC] - before;
	status = world.sent.pulse[0x00] + world.sent.pulse[0x35] - status;
	assert_true(status <= before);
	assert_true(world.sent.pulse[0x35] >= 400);
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	world_run(&world, 1500 * MS);
	before = world.sent.pulse[0x35];
	world_run(&world, 500 * MS);
	assert_int_equal(world.sent.pulse[0x35], before);
}

static void beside(int32_t ms)
{
	arm_with_the_motion(ms);
	world_go(&world, 2, ms, 0);
}

/* Its references leave in every cycle. */
static void axis_in_position_mode_moves_beside_it(void **state)
{
	(void)state;
	begin_with(true, 0);
	world.config.settings.axis[2].options = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER |
						WIRE_AXIS_POSITION_MODE;
	switch_on(6);
	prepare();
	assert_int_equal(engine()->task_axes, 3);
	run(600, beside);
	assert_int_equal(threading()->active, 1);
	world_run(&world, 1 * SECOND);
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	ends_exactly(600);
	made_no_detour(600);
}

/* The command is there at once, and the device has to be far ahead of so slow a wire. */
static void all_of_the_way_at_once_is_armed_over_a_slow_wire(void **state)
{
	static const int32_t ways[] = { 30, 1500, 30000 };
	const struct sim_link_faults slow = { .delay = { .low_ns = 8 * MS } };

	(void)state;
	for (size_t k = 0; k < sizeof(ways) / sizeof(ways[0]); k++) {
		begin_with(true, 0);
		prepare();
		world_faults(&world, &slow);
		world_run(&world, 2 * SECOND);
		go(Z, -ways[k]);
		assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_ARM), POKEYS_OUTCOME_DONE);
		world_until(&world, is_active, 1 * SECOND);
		world_run(&world, 2 * SECOND);
		assert_int_equal(pulses(Z), -ways[k]);
		assert_int_equal(threading()->behind, 0);
		assert_int_equal(engine()->buffer_underruns, 0);
		assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
		assert_int_equal(engine()->axis[Z].following_error, 0);
		assert_int_equal(world.rig.device.bench.machine.axis[Z].steps, (uint64_t)ways[k]);
	}
}

/* It is slots of motion that wait, not what another axis does beside a standstill. */
static void standstill_beside_a_moving_axis_does_not_heap_up(void **state)
{
	uint16_t behind;

	(void)state;
	begin_with(true, 0);
	world.config.settings.axis[2].options = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER |
						WIRE_AXIS_POSITION_MODE;
	switch_on(6);
	prepare();
	spin(100);
	run(600, arm_with_the_motion);
	spin(0);
	world_run(&world, 100 * MS);
	behind = threading()->behind;
	assert_true(behind > 200);
	for (int32_t ms = 1; ms <= 400; ms++) {
		world_go(&world, 2, ms, 0);
		world_cycle(&world);
	}
	assert_int_equal(threading()->behind, behind);
}

static unsigned int whole_threads(bool count_free, double loss, double copies, unsigned int rounds)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 1 * MS, 0 },
		.loss = loss,
		.duplicate = copies,
		.reorder = copies,
		.reorder_ns = 2 * MS,
	};
	unsigned int whole = 0;

	for (unsigned int round = 0; round < rounds; round++) {
		begin_with(count_free, 0);
		sim_prng_init(&world.rig.link.way[0].prng, 1000 + round);
		sim_prng_init(&world.rig.link.way[1].prng, 2000 + round);
		world_faults(&world, &faults);
		queue(POKEYS_ONE_SHOT_THREAD_PREPARE);
		world_until(&world, is_prepared, SECOND);
		run(1500, arm_with_the_motion);
		world_run(&world, 1 * SECOND);
		if (engine()->task_phase == POKEYS_TASK_WORKING) {
			queue(POKEYS_ONE_SHOT_THREAD_RELEASE);
			world_until(&world, is_idle, 10 * SECOND);
		}
		whole += engine()->task_result == POKEYS_TASK_DONE;
		world_loss(&world, 0);
		/* a lost packet may make it late when it is released */
		if (engine()->task_result == POKEYS_TASK_DONE)
			ends_there(1500);
		else
			stopped(engine()->task_result);
	}
	printf("%u of %u threads whole\n", whole, rounds);
	return whole;
}

static void exact_where_the_device_tells_its_level(void **state)
{
	(void)state;
	assert_int_equal(whole_threads(true, 0.01, 0, 10), 10);
}

/* A fill that was executed twice has spoilt it; so may a lost one where only positions tell. */
static void exact_or_stopped_whatever_the_network_does(void **state)
{
	(void)state;
	whole_threads(true, 0.01, 0.01, 10);
	whole_threads(false, 0.001, 0, 10);
	whole_threads(false, 0.01, 0.01, 40);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(it_is_prepared_armed_released, begin),
		cmocka_unit_test_setup(z_follows_the_angle_at_changing_speed, begin),
		cmocka_unit_test_setup(release_in_motion_goes_on_by_the_millisecond, begin),
		cmocka_unit_test_setup(release_is_asked_for_until_it_is_heard, begin),
		cmocka_unit_test_setup(force_does_not_wait, begin),
		cmocka_unit_test(ignored_axis_waits_parked),
		cmocka_unit_test_setup(it_costs_no_further_fast_request, begin),
		cmocka_unit_test(all_of_the_way_at_once_is_armed_over_a_slow_wire),
		cmocka_unit_test(axis_in_position_mode_moves_beside_it),
		cmocka_unit_test(standstill_beside_a_moving_axis_does_not_heap_up),
		cmocka_unit_test(exact_where_the_device_tells_its_level),
		cmocka_unit_test(exact_or_stopped_whatever_the_network_does),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
