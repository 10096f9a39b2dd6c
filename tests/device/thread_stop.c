/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Threading by the device: what does not fit is refused before the wire, and what
 * disturbs it stops the axes.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/thread_rig.h"

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
		.operation = POKEYS_ONE_SHOT_THREAD_PREPARE,
		.parameter = { -1 },
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
	const uint64_t restarts = world.rig.device.stats.executed_pe[0x05];

	(void)state;
	world.command.flags = 0; /* what is found running is asked */
	world_run(&world, 100 * MS);
	world.config.settings.set &= ~(uint32_t)POKEYS_SET_THREADING;
	world.config.settings.set |= POKEYS_SET_POWER_STATES;
	world.config.settings.power_states = 1;
	world.rig.device.stats.executed_pe[0x35] = world.rig.device.stats.executed_pe[0x36] = 0;
	switch_on(6);
	assert_int_equal(world.rig.device.stats.executed_pe[0x05], restarts + 1);
	refused(POKEYS_ONE_SHOT_THREAD_PREPARE, POKEYS_THREADING_NOT_SET);
	assert_int_equal(world.rig.device.stats.executed_pe[0x35], 0);
	assert_int_equal(world.rig.device.stats.executed_pe[0x36], 0);
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

static int most_waiting; /* slots, beside those that the device has */

static void look_how_far(int32_t ms)
{
	(void)ms;
	if (threading()->behind - engine()->buffer_level > most_waiting)
		most_waiting = threading()->behind - engine()->buffer_level;
}

static void spindle_that_stands_still_is_too_far_behind(void **state)
{
	(void)state;
	prepare();
	run(500, arm_with_the_motion);
	spin(0);
	most_waiting = 0;
	run(5000, look_how_far);
	/* of 4096 places as many are left free as a fill may bring back that was lost */
	assert_int_equal(most_waiting, 4096 - 64);
	stopped(POKEYS_TASK_BEHIND);
}

static void does_not_begin(struct world *w, const uint8_t *packet)
{
	(void)packet;
	w->rig.device.engine.thread.state = SIM_THREAD_OFF;
}

static void device_that_answers_but_does_not_begin_is_late(void **state)
{
	(void)state;
	world.watch = does_not_begin;
	queue(POKEYS_ONE_SHOT_THREAD_PREPARE);
	world_run(&world, 4 * SECOND);
	assert_int_equal(engine()->task_phase, POKEYS_TASK_WORKING);
	world_run(&world, 1500 * MS);
	stopped(POKEYS_TASK_TIMED_OUT);
}

/* What was to be armed was not, although all ends as it was asked to. */
static void release_before_it_could_be_armed(void **state)
{
	uint32_t id;

	(void)state;
	prepare();
	id = queue(POKEYS_ONE_SHOT_THREAD_ARM);
	world_run(&world, 50 * MS);
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
	assert_int_equal(engine()->task_result, POKEYS_TASK_DONE);
	assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_FAILED);
	assert_int_equal(world.rig.device.stats.executed_pe[0x32], 0);
}

static void axis_that_is_switched_off_ends_it(void **state)
{
	(void)state;
	prepare();
	run(300, arm_with_the_motion);
	world.command.axis[X].enable = 0;
	stopped(POKEYS_TASK_CANCELLED);
}

/* The engine is set up and restarted while the daemon begins: it knows nothing any more. */
static void engine_that_was_restarted_is_told_the_parameters_anew(void **state)
{
	struct pokeys_settings *settings = &world.config.settings;
	const struct sim_device_stats *stats = &world.rig.device.stats;
	const uint64_t restarts = stats->executed_pe[0x05];
	const uint8_t *thread = world.rig.device.config.engine.thread;

	(void)state;
	settings->set |= POKEYS_SET_POWER_STATES;
	settings->power_states = 1;
	switch_on(6);
	assert_int_equal(stats->executed_pe[0x05], restarts + 1);
	assert_int_equal(thread[0], 1);
	assert_int_equal(thread[6] | thread[7] << 8, TARGET);
	prepare();
	assert_int_equal(shot(POKEYS_ONE_SHOT_THREAD_RELEASE), POKEYS_OUTCOME_DONE);
}

static unsigned int cancels_to_lose;

/* A device that a stop alone does not bring out of it. */
static void only_cancel_ends_it(struct world *w, const uint8_t *packet)
{
	const bool cancel = packet[1] == 0x85 && packet[2] == 0x34;

	w->swallow = cancel && cancels_to_lose;
	cancels_to_lose -= w->swallow;
	if (!w->rig.device.stats.executed_pe[0x34])
		w->rig.device.engine.thread.state = SIM_THREAD_PREPARED;
}

static void daemon_that_ends_waits_for_the_cancel(void **state)
{
	(void)state;
	prepare();
	cancels_to_lose = 4;
	world.watch = only_cancel_ends_it;
	device_stop(world.device, world.now);
	world_until(&world, world_is_stopped, SECOND);
	assert_int_equal(cancels_to_lose, 0);
	assert_int_not_equal(world.rig.device.stats.executed_pe[0x34], 0);
	assert_int_equal(world.rig.device.engine.thread.state, SIM_THREAD_OFF);
}

static bool asked_meanwhile;

static void find_it_prepared_without_a_stop(struct world *w, const uint8_t *packet)
{
	asked_meanwhile = asked_meanwhile || (packet[1] == 0x85 && packet[2] == 0x35);
	if (!w->rig.device.stats.executed_pe[0x34])
		w->rig.device.engine.thread.state = SIM_THREAD_PREPARED;
}

static void daemon_without_settings_finds_what_runs_in_threading(void **state)
{
	(void)state;
	prepare();
	world.config.settings.set &= ~(uint32_t)POKEYS_SET_THREADING;
	world.watch = find_it_prepared_without_a_stop;
	asked_meanwhile = false;
	switch_on(7);
	assert_true(asked_meanwhile);
	assert_int_not_equal(world.rig.device.stats.executed_pe[0x34], 0);
	assert_int_equal(world.rig.device.engine.thread.state, SIM_THREAD_OFF);
}

/* Nor does it take the number of axes that is wanted. */
static void find_it_stubborn(struct world *w, const uint8_t *packet)
{
	only_cancel_ends_it(w, packet);
	w->swallow = packet[1] == 0x85 && packet[2] == 0x01;
}

static bool is_refused(struct world *w)
{
	return w->state.fault == POKEYS_FAULT_CONFIG_REFUSED;
}

/* The cable was out, and meanwhile somebody set it up otherwise: it may not run. */
static void device_that_may_not_run_is_brought_out_of_it(void **state)
{
	(void)state;
	prepare();
	run(300, arm_with_the_motion);
	sim_rig_silence(&world.rig, world.now, 500 * MS);
	world.rig.device.config.engine.axes = 2;
	world.watch = find_it_stubborn;
	cancels_to_lose = 0;
	world_until(&world, world_is_lost, SECOND);
	world_until(&world, is_refused, 10 * SECOND);
	world_until(&world, world_is_safe, SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	assert_int_not_equal(world.rig.device.stats.executed_pe[0x34], 0);
	assert_int_equal(world.rig.device.engine.thread.state, SIM_THREAD_OFF);
}

static void whole_has_a_limit(void **state)
{
	const struct pokeys_one_shot one = {
		.operation = POKEYS_ONE_SHOT_THREAD_PREPARE,
		.parameter = { 1.5f },
	};

	(void)state;
	world_one_shot(&world, &one);
	world_until(&world, is_prepared, SECOND);
	world_run(&world, 1400 * MS);
	assert_int_equal(threading()->prepared, 1);
	stopped(POKEYS_TASK_TIMED_OUT);
}

static uint64_t writes_before; /* of the parameters: behind these nobody stops the engine */

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

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(what_does_not_fit_is_refused_with_its_reason, begin),
		cmocka_unit_test_setup(without_settings_it_is_refused_and_never_asked_for, begin),
		cmocka_unit_test_setup(spindle_without_index_times_out, begin),
		cmocka_unit_test_setup(spindle_above_its_target_starves_it, begin),
		cmocka_unit_test_setup(spindle_that_stands_still_is_too_far_behind, begin),
		cmocka_unit_test_setup(device_that_answers_but_does_not_begin_is_late, begin),
		cmocka_unit_test_setup(release_before_it_could_be_armed, begin),
		cmocka_unit_test_setup(axis_that_is_switched_off_ends_it, begin),
		cmocka_unit_test_setup(engine_that_was_restarted_is_told_the_parameters_anew,
				       begin),
		cmocka_unit_test_setup(daemon_that_ends_waits_for_the_cancel, begin),
		cmocka_unit_test_setup(daemon_without_settings_finds_what_runs_in_threading, begin),
		cmocka_unit_test_setup(device_that_may_not_run_is_brought_out_of_it, begin),
		cmocka_unit_test_setup(whole_has_a_limit, begin),
		cmocka_unit_test_setup(left_over_threading_is_cancelled_before_anything_moves,
				       begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
