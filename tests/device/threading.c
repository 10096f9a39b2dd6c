/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Threading by the device: the axes follow the spindle's angle, whatever its speed does
 * and the network, and end exactly where they were led; what disturbs it stops them.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

enum { Z = 0, X = 1, STEPS = 4096, TARGET = 600, FEED = 10 };	/* FEED: pulses a ms */

static struct world world;

static const struct pokeys_engine *engine(void)
{
	return &world.state.engine;
}

static const struct pokeys_threading *threading(void)
{
	return &world.state.threading;
}

static int64_t pulses(unsigned int axis)
{
	sim_rig_run(&world.rig, world.now);
	return world.rig.device.engine.axis[axis].pulses;
}

static bool is_idle(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_IDLE;
}

static bool is_prepared(struct world *w)
{
	return w->state.threading.prepared;
}

static bool is_active(struct world *w)
{
	return w->state.threading.active;
}

static bool is_on(struct world *w)
{
	return w->state.engine.state == WIRE_ENGINE_RUNNING && w->state.engine.axis[Z].enabled;
}

static void go(unsigned int axis, int32_t position)
{
	world.command.axis[axis] = (struct pokeys_axis_command){
		.position = position, .mode = POKEYS_AXIS_BUFFERED, .enable = 1,
	};
}

static void spin(double rpm)
{
	struct sim_shaft *shaft = &world.rig.device.bench.shaft[SIM_ULTRA_FAST];

	sim_rig_run(&world.rig, world.now);
	shaft->index_every = STEPS;
	shaft->rate = (int64_t)(rpm * STEPS / 60);
}

/* A daemon that begins, and a commander; the axes stay where they are. */
static void switch_on(uint32_t session)
{
	world_start(&world);
	world_commander(&world, session);
	world_until(&world, world_is_running, 500 * MS);
	for (unsigned int i = 0; i < 3; i++)
		go(i, (int32_t)pulses(i));
	world_machine_on(&world);
	world_until(&world, is_on, 500 * MS);
	world_run(&world, 100 * MS);
}

static void begin_with(bool count_free, uint8_t ignore)
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
	settings->threading_ticks = STEPS / 4;	/* every fourth edge is counted */
	settings->threading_rpm = TARGET;
	settings->threading_speed_gain = 200;
	settings->threading_position_gain = 100;
	settings->threading_ignore = ignore;
	switch_on(5);
	spin(500);
	world_run(&world, 300 * MS);
}

static int begin(void **state)
{
	(void)state;
	begin_with(true, 0);
	return 0;
}

static enum pokeys_outcome shot(uint8_t operation)
{
	const struct pokeys_one_shot one = { .operation = operation };

	return world_do(&world, &one, 12 * SECOND);
}

static uint32_t queue(uint8_t operation)
{
	const struct pokeys_one_shot one = { .operation = operation };

	return world_one_shot(&world, &one);
}

static void prepare(void)
{
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_PREPARE), POKEYS_OUTCOME_DONE);
	assert_int_equal(threading()->prepared, 1);
}

/* Z goes so many ms with FEED, X half of it, as at the target speed; `each` sees every ms. */
static void run(int32_t ms, void (*each)(int32_t ms))
{
	for (int32_t i = 1; i <= ms; i++) {
		go(Z, -i * FEED);
		go(X, i * FEED / 2);
		if (each)
			each(i);
		world_cycle(&world);
	}
}

static void arm_with_the_motion(int32_t ms)
{
	if (ms == 1)
		queue(POKEYS_ONE_SHOT_THREAD_ARM);
}

static void ends_exactly(int32_t ms)
{
	world_run(&world, 500 * MS);
	assert_int_equal(pulses(Z), -ms * FEED);
	assert_int_equal(pulses(X), ms * FEED / 2);
	assert_int_equal(engine()->axis[Z].following_error, 0);
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
	assert_int_equal(world.rig.device.engine.thread.dry, world.rig.device.engine.thread.dry);
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

/* Refusals: nothing of it reaches the wire. */
static void refused(uint8_t operation, uint8_t why)
{
	uint64_t sent = 0;

	for (unsigned int sub = 0x30; sub <= 0x33; sub++)
		sent -= world.rig.device.stats.executed_pe[sub];
	assert_int_equal(shot(operation), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(threading()->refused, why);
	assert_int_equal(world.last_event[EVENT_THREADING].b, why);
	for (unsigned int sub = 0x30; sub <= 0x33; sub++)
		sent += world.rig.device.stats.executed_pe[sub];
	assert_int_equal(sent, 0);
}

static void what_does_not_fit_is_refused_with_its_reason(void **state)
{
	const struct pokeys_one_shot forever = {
		.operation = POKEYS_ONE_SHOT_THREAD_PREPARE, .parameter = { -1 },
	};

	(void)state;
	refused(POKEYS_ONE_SHOT_THREAD_ARM, POKEYS_THREADING_NOT_PREPARED);
	refused(POKEYS_ONE_SHOT_THREAD_RELEASE, POKEYS_THREADING_NOT_BEGUN);
	assert_int_equal(world_do(&world, &forever, SECOND), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(threading()->refused, POKEYS_THREADING_BAD_LIMIT);
	run(50, NULL);
	refused(POKEYS_ONE_SHOT_THREAD_PREPARE, POKEYS_THREADING_MOVING);
	world_run(&world, 100 * MS);
	prepare();
	assert_int_equal(threading()->refused, POKEYS_THREADING_WELL);
	refused(POKEYS_ONE_SHOT_THREAD_FORCE, POKEYS_THREADING_BUSY);
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	for (unsigned int i = 0; i < 3; i++)
		world.command.axis[i].enable = 0;
	world_run(&world, 50 * MS);
	refused(POKEYS_ONE_SHOT_THREAD_PREPARE, POKEYS_THREADING_NO_AXIS);
	world.command.flags = 0;
	world_run(&world, 50 * MS);
	refused(POKEYS_ONE_SHOT_THREAD_PREPARE, POKEYS_THREADING_OFF);
}

static void without_settings_it_is_refused_and_never_asked_for(void **state)
{
	(void)state;
	world.config.settings.set &= ~(uint32_t)POKEYS_SET_THREADING;
	world.rig.device.stats.executed_pe[0x35] = world.rig.device.stats.executed_pe[0x36] = 0;
	switch_on(6);
	refused(POKEYS_ONE_SHOT_THREAD_PREPARE, POKEYS_THREADING_NOT_SET);
	assert_int_equal(world.rig.device.stats.executed_pe[0x35], 0);
	assert_int_equal(world.rig.device.stats.executed_pe[0x36], 0);
}

/* Everything stands, and stays so although the spindle turns and the command goes on. */
static void stopped(uint8_t result)
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
}

static void spindle_without_index_times_out(void **state)
{
	(void)state;
	prepare();
	spin(0);
	run(100, arm_with_the_motion);
	world_run(&world, 9 * SECOND);
	assert_int_equal(threading()->waiting, 1);
	assert_int_equal(pulses(Z), 0);
	stopped(POKEYS_TASK_TIMED_OUT);
}

static void spindle_above_its_target_starves_it(void **state)
{
	(void)state;
	prepare();
	spin(1500);
	run(3000, arm_with_the_motion);
	stopped(POKEYS_TASK_STARVED);
	assert_int_equal(engine()->buffer_underruns, 1);
}

static void spindle_that_stands_still_is_too_far_behind(void **state)
{
	(void)state;
	prepare();
	run(500, arm_with_the_motion);
	spin(0);
	run(5000, NULL);
	stopped(POKEYS_TASK_BEHIND);
}

static void axis_that_is_switched_off_ends_it(void **state)
{
	(void)state;
	prepare();
	run(300, arm_with_the_motion);
	world.command.axis[X].enable = 0;
	stopped(POKEYS_TASK_CANCELLED);
}

static void whole_has_a_limit(void **state)
{
	const struct pokeys_one_shot one = {
		.operation = POKEYS_ONE_SHOT_THREAD_PREPARE, .parameter = { 1.5f },
	};

	(void)state;
	world_one_shot(&world, &one);
	world_until(&world, is_prepared, SECOND);
	world_run(&world, 1400 * MS);
	assert_int_equal(threading()->prepared, 1);
	stopped(POKEYS_TASK_TIMED_OUT);
}

static uint64_t writes_before;	/* of the parameters: behind these nobody stops the engine */

static void find_it_prepared(struct world *w, const uint8_t *packet)
{
	if (packet[1] != 0x85 || packet[2] != 0x35 ||
	    w->rig.device.stats.executed_pe[0x36] < writes_before)
		return;
	w->rig.device.engine.thread.state = SIM_THREAD_PREPARED;
	w->watch = NULL;
}

/* A daemon before us, or a copy that was late, has left the device in it. */
static void left_over_threading_is_cancelled_before_anything_moves(void **state)
{
	(void)state;
	writes_before = world.rig.device.stats.executed_pe[0x36] + 1;
	world.watch = find_it_prepared;
	switch_on(9);
	assert_int_equal(world.rig.device.engine.thread.state, SIM_THREAD_OFF);
	assert_int_equal(world.rig.device.stats.executed_pe[0x34], 1);
	prepare();
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	world.watch = find_it_prepared;
	world_run(&world, 200 * MS);
	assert_int_equal(world.rig.device.engine.thread.state, SIM_THREAD_OFF);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
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

static unsigned int whole_threads(bool count_free, double loss, double copies, unsigned int rounds)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 1 * MS, 0 }, .loss = loss,
		.duplicate = copies, .reorder = copies, .reorder_ns = 2 * MS,
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
		if (engine()->task_result == POKEYS_TASK_DONE)
			ends_exactly(1500);
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
	whole_threads(false, 0.01, 0.01, 10);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(it_is_prepared_armed_released, begin),
		cmocka_unit_test_setup(z_follows_the_angle_at_changing_speed, begin),
		cmocka_unit_test_setup(release_in_motion_goes_on_by_the_millisecond, begin),
		cmocka_unit_test_setup(force_does_not_wait, begin),
		cmocka_unit_test(ignored_axis_waits_parked),
		cmocka_unit_test_setup(what_does_not_fit_is_refused_with_its_reason, begin),
		cmocka_unit_test_setup(without_settings_it_is_refused_and_never_asked_for, begin),
		cmocka_unit_test_setup(spindle_without_index_times_out, begin),
		cmocka_unit_test_setup(spindle_above_its_target_starves_it, begin),
		cmocka_unit_test_setup(spindle_that_stands_still_is_too_far_behind, begin),
		cmocka_unit_test_setup(axis_that_is_switched_off_ends_it, begin),
		cmocka_unit_test_setup(whole_has_a_limit, begin),
		cmocka_unit_test_setup(left_over_threading_is_cancelled_before_anything_moves,
				       begin),
		cmocka_unit_test_setup(it_costs_no_further_fast_request, begin),
		cmocka_unit_test(exact_where_the_device_tells_its_level),
		cmocka_unit_test(exact_or_stopped_whatever_the_network_does),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
