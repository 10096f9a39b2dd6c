/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Aborting homing, probing or plain motion from any phase, with any packet
 * lost, ends with axes that stand and stay so.
 *
 * A picture of the whole world is taken in each phase and put back for each
 * try, so the tries differ in nothing but the packet that is lost: the k-th
 * request after the abort, or the k-th answer. Beside that every single packet
 * of an undisturbed task is lost once: it is then done, or it has failed and
 * says so; it is never half done.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/lose.h"
#include "wire/pulse.h"

enum {
	PACKETS = 40, /* about two rounds of all that an abort sends */
	PHASES = POKEYS_TASK_STOPPING + 1,
	PROBE_INPUT = 5,
};

static struct world world;

static void begin(void)
{
	const struct sim_switch home = {
		.wired = true,
		.pin = SIM_DEDICATED,
		.from = INT32_MIN,
		.to = -150,
	};
	const struct sim_switch probe = {
		.wired = true,
		.normally_open = true,
		.pin = SIM_PROBE_INPUT + PROBE_INPUT,
		.from = 300,
		.to = INT32_MAX,
	};
	struct pokeys_axis_settings *axis;

	world_init(&world, NULL);
	world_axes(&world);
	axis = &world.config.settings.axis[0];
	axis->switches = axis->switches_mask = WIRE_SWITCH_HOME;
	axis->set |= POKEYS_AXIS_SET_HOMING_SPEED | POKEYS_AXIS_SET_HOMING_RETURN;
	axis->homing_speed = axis->homing_return = 50;
	sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.axis[0].home, &home);
	sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.probe, &probe);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	world_go(&world, 0, 0, 0);
	world_go(&world, 1, 0, 0);
	world_machine_on(&world);
	world_run(&world, 30 * MS);
	lose_begin(&world);
}

/* Axis 1 goes on as far as it is let. */
static const struct pokeys_one_shot task_home = {
	.operation = POKEYS_ONE_SHOT_HOME,
	.mask = 1,
};
static const struct pokeys_one_shot task_probe = {
	.operation = POKEYS_ONE_SHOT_PROBE,
	.mask = 1,
	.index = PROBE_INPUT,
	.value = { 5000 },
	.parameter = { 0, 0.5f },
};

static void queue(uint8_t operation)
{
	const struct pokeys_one_shot shot = { .operation = operation };

	world_one_shot(&world, &shot);
}

static void cancel(struct world *w)
{
	(void)w;
	queue(world.state.engine.task == POKEYS_TASK_HOMING ? POKEYS_ONE_SHOT_HOME_CANCEL :
							      POKEYS_ONE_SHOT_PROBE_FINISH);
	world.command.axis[0].enable = world.command.axis[1].enable = 0;
}

static const struct {
	const char *name;
	void (*abort)(struct world *world);
	uint64_t settle_ns;
} aborts[] = {
	{ "cancel", cancel, 300 * MS },
	{ "machine off", world_machine_off, 300 * MS },
	{ "commander dies", world_commander_dies, 400 * MS },
	{ "emergency", world_emergency, 300 * MS },
	{ "link breaks", world_link_breaks, 900 * MS },
	{ "daemon ends", world_daemon_ends, 300 * MS },
};

static bool stands(void)
{
	sim_rig_run(&world.rig, world.now);
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (world.rig.device.engine.axis[i].planner.speed != 0)
			return false;
	}
	return true;
}

static void check_stands(const char *what, unsigned int way)
{
	const uint8_t state = world.rig.device.engine.state;
	int64_t before[2];

	if (!stands())
		fail_msg("%s, %s: an axis moves, lost %d %d", what, aborts[way].name, lose_request,
			 lose_reply);
	for (unsigned int i = 0; i < 2; i++)
		before[i] = world.rig.device.engine.axis[i].pulses;
	world_run(&world, 100 * MS);
	assert_true(stands());
	for (unsigned int i = 0; i < 2; i++)
		assert_int_equal(world.rig.device.engine.axis[i].pulses, before[i]);
	assert_true(state == SIM_PE_STOPPED || state == SIM_PE_STOP_EMERGENCY ||
		    (aborts[way].abort == cancel && state == SIM_PE_RUNNING));
	if (world.state.link == POKEYS_LINK_RUNNING)
		assert_int_equal(world.state.engine.task_phase, POKEYS_TASK_IDLE);
}

/* Each way to abort x each packet lost, from the picture. */
static void abort_here(const char *what)
{
	for (unsigned int way = 0; way < sizeof(aborts) / sizeof(aborts[0]); way++) {
		for (int k = 0; k < 2 * PACKETS; k += WORLD_STRIDE) {
			lose_put_back(&world);
			lose_one(k, PACKETS);
			aborts[way].abort(&world);
			world_run(&world, aborts[way].settle_ns);
			check_stands(what, way);
		}
	}
}

static void abort_in_each_phase(const struct pokeys_one_shot *task)
{
	for (uint8_t phase = POKEYS_TASK_PREPARING; phase < PHASES; phase++) {
		unsigned int left = 1000;
		char what[40];

		begin();
		world_go(&world, 1, 100000, 0); /* and it does not stand at the beginning */
		world_run(&world, 60 * MS);
		world_one_shot(&world, task);
		while (world.state.engine.task_phase != phase && left--) {
			if (world.state.engine.task_phase == POKEYS_TASK_COMPLETE &&
			    world.command.one_shot_head == 1)
				queue(POKEYS_ONE_SHOT_HOME_FINISH);
			world_cycle(&world);
		}
		if (world.state.engine.task_phase != phase) {
			assert_int_equal(phase, POKEYS_TASK_COMPLETE); /* probing does not wait */
			continue;
		}
		snprintf(what, sizeof(what), "operation %u phase %u", task->operation, phase);
		lose_keep(&world);
		abort_here(what);
	}
}

static void homing_ends_standing_from_any_phase_with_any_packet_lost(void **state)
{
	(void)state;
	abort_in_each_phase(&task_home);
}

static void probing_ends_standing_from_any_phase_with_any_packet_lost(void **state)
{
	(void)state;
	abort_in_each_phase(&task_probe);
}

static void motion_ends_standing_from_any_phase_with_any_packet_lost(void **state)
{
	(void)state;
	begin();
	world_go(&world, 0, 100000, 0);
	world_go(&world, 1, -100000, 0);
	world_run(&world, 80 * MS);
	lose_keep(&world);
	abort_here("position mode");
	/* and from each moment of its beginning */
	begin();
	world.command.flags = 0;
	world_run(&world, 100 * MS);
	world_go(&world, 0, 100000, 0);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	for (unsigned int cycle = 0; cycle < 6; cycle++) {
		world_cycle(&world);
		lose_keep(&world);
		abort_here("start of the engine");
		lose_put_back(&world);
	}
}

static uint8_t late[64];

static void keep_back(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0x85 && (packet[2] == 0x21 || packet[2] == 0x23) && !late[1];
	if (w->swallow)
		memcpy(late, packet, sizeof(late));
}

/* The network kept the start back and delivers it so many ms after the abort. */
static void start_that_arrives_after_the_abort(const struct pokeys_one_shot *task, unsigned int way,
					       uint64_t delay_ns)
{
	begin();
	memset(late, 0, sizeof(late));
	world.watch = keep_back;
	world_one_shot(&world, task);
	while (!late[1])
		world_cycle(&world);
	aborts[way].abort(&world);
	world_run(&world, delay_ns);
	sim_rig_send_from(&world.rig, world.now, 77, late, sizeof(late));
	world_run(&world, 50 * MS);
	world_run(&world, aborts[way].settle_ns);
	check_stands("late start", way);
}

static void start_that_arrives_late_is_stopped(void **state)
{
	(void)state;
	for (unsigned int way = 0; way < sizeof(aborts) / sizeof(aborts[0]); way++) {
		if (aborts[way].abort == world_daemon_ends)
			continue; /* nobody is left to see it */
		for (uint64_t delay = 0; delay < 60; delay++) {
			start_that_arrives_after_the_abort(&task_home, way, delay * MS);
			start_that_arrives_after_the_abort(&task_probe, way, delay * MS);
		}
	}
}

static bool is_idle(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_IDLE && w->state.engine.task_count;
}

/* No abort: done, or failed and said so. Returns how many were not done. */
static unsigned int lose_each(const struct pokeys_one_shot *task, int packets)
{
	unsigned int undone = 0;

	begin();
	lose_keep(&world);
	for (int k = 0; k < 2 * packets; k += WORLD_STRIDE) {
		struct pokeys_one_shot shot = *task;
		uint32_t id;

		lose_put_back(&world);
		if (task->operation == POKEYS_ONE_SHOT_HOME)
			shot.flags = POKEYS_HOME_FINISH_ITSELF;
		id = world_one_shot(&world, &shot);
		lose_one(k, packets);
		world_until(&world, is_idle, 3 * SECOND);
		assert_int_equal(world_outcome(&world, id) == POKEYS_OUTCOME_DONE,
				 world.state.engine.task_result == POKEYS_TASK_DONE);
		assert_true(world_outcome(&world, id) != POKEYS_OUTCOME_NONE);
		assert_true(stands());
		undone += world.state.engine.task_result != POKEYS_TASK_DONE;
		if (task->operation == POKEYS_ONE_SHOT_HOME)
			assert_int_equal(world.state.engine.axis[0].homed,
					 world.state.engine.task_result == POKEYS_TASK_DONE);
	}
	return undone;
}

static void single_lost_packet_does_not_fail_a_task(void **state)
{
	(void)state;
	assert_int_equal(lose_each(&task_home, 400), 0);
	assert_int_equal(lose_each(&task_probe, 400), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(homing_ends_standing_from_any_phase_with_any_packet_lost),
		cmocka_unit_test(probing_ends_standing_from_any_phase_with_any_packet_lost),
		cmocka_unit_test(motion_ends_standing_from_any_phase_with_any_packet_lost),
		cmocka_unit_test(start_that_arrives_late_is_stopped),
		cmocka_unit_test(single_lost_packet_does_not_fail_a_task),
	};
	const int failed = cmocka_run_group_tests(tests, NULL, NULL);

	lose_end();
	free(world.device);
	return failed;
}
