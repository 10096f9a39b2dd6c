/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Threading aborted in any step, in any way, with any packet lost, ends with axes that
 * stand although the spindle turns, and a device that is not in it any more. Without
 * an abort every single packet is lost once: the thread is whole all the same.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/lose.h"
#include "wire/pulse.h"

enum { PACKETS = 30, STEPS = 4096, FEED = 10, THREAD_MS = 250 };

static struct world world;
static int32_t moved_ms;       /* how long the commander has moved */
static uint32_t prepared_head; /* of the one-shots, when it was asked to prepare */

static void go(unsigned int axis, int32_t position)
{
	world.command.axis[axis] = (struct pokeys_axis_command){
		.position = position,
		.mode = POKEYS_AXIS_BUFFERED,
		.enable = 1,
	};
}

static bool is_on(struct world *w)
{
	return w->state.engine.state == WIRE_ENGINE_RUNNING && w->state.engine.axis[0].enabled;
}

static void begin(void)
{
	const struct sim_rig_options options = { .device.choices.count_free = true };
	struct pokeys_settings *settings = &world.config.settings;
	struct sim_shaft *spindle;

	moved_ms = 0;
	world_init(&world, &options);
	world_axes(&world);
	world_fast_encoders(&world, false, true);
	for (unsigned int i = 0; i < 2; i++) {
		settings->axis[i].options = WIRE_AXIS_ENABLED;
		settings->axis[i].options_mask = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER |
						 WIRE_AXIS_POSITION_MODE;
		settings->axis[i].max_speed = 125000;
		settings->axis[i].max_acceleration = 1e7f;
	}
	settings->set |= POKEYS_SET_THREADING;
	settings->threading_mode = 1;
	settings->threading_ticks = STEPS / 4;
	settings->threading_rpm = 1200;
	settings->threading_speed_gain = 200;
	settings->threading_position_gain = 100;
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	go(0, 0);
	go(1, 0);
	world_machine_on(&world);
	world_until(&world, is_on, 500 * MS);
	spindle = &world.rig.device.bench.shaft[SIM_ULTRA_FAST];
	spindle->index_every = STEPS;
	spindle->rate = 15 * STEPS; /* 900 rpm */
	world_run(&world, 200 * MS);
	lose_begin(&world);
}

/* The buffer holds something then, and it has been seen whether the device tells that. */
static void there_and_back(void)
{
	for (int32_t i = 1; i <= 30; i++) {
		go(0, i < 15 ? i : 30 - i);
		world_cycle(&world);
	}
}

static uint32_t queue(uint8_t operation)
{
	const struct pokeys_one_shot shot = { .operation = operation };

	const uint32_t id = world_one_shot(&world, &shot);

	if (operation == POKEYS_ONE_SHOT_THREAD_PREPARE)
		prepared_head = id + 1;
	return id;
}

/* One ms further on its way. */
static void move(void)
{
	moved_ms += moved_ms < THREAD_MS;
	go(0, moved_ms * FEED);
	go(1, -moved_ms * FEED / 2);
	world_cycle(&world);
}

static void cancel(struct world *w)
{
	(void)w;
	queue(POKEYS_ONE_SHOT_THREAD_CANCEL);
}

static void axis_off(struct world *w)
{
	w->command.axis[1].enable = 0;
}

static const struct {
	const char *name;
	void (*abort)(struct world *world);
	uint64_t settle_ns;
} aborts[] = {
	{ "cancel", cancel, 300 * MS },
	{ "axis off", axis_off, 300 * MS },
	{ "machine off", world_machine_off, 300 * MS },
	{ "commander dies", world_commander_dies, 400 * MS },
	{ "emergency", world_emergency, 300 * MS },
	{ "link breaks", world_link_breaks, 900 * MS },
	{ "daemon ends", world_daemon_ends, 300 * MS },
};

static void check_stands(const char *what, const char *way)
{
	int64_t before[2];

	sim_rig_run(&world.rig, world.now);
	for (unsigned int i = 0; i < 2; i++)
		before[i] = world.rig.device.engine.axis[i].pulses;
	world_run(&world, 100 * MS);
	sim_rig_run(&world.rig, world.now);
	for (unsigned int i = 0; i < 2; i++) {
		if (world.rig.device.engine.axis[i].pulses != before[i])
			fail_msg("%s, %s: an axis moves, lost %d %d", what, way, lose_request,
				 lose_reply);
	}
	if (world.rig.device.engine.thread.state != SIM_THREAD_OFF)
		fail_msg("%s, %s: still threading, lost %d %d", what, way, lose_request,
			 lose_reply);
	if (world.state.link == POKEYS_LINK_RUNNING)
		assert_int_equal(world.state.engine.task_phase, POKEYS_TASK_IDLE);
}

/* Each way to abort x each packet lost, from the picture. */
static void abort_here(const char *what)
{
	lose_keep(&world);
	for (unsigned int way = 0; way < sizeof(aborts) / sizeof(aborts[0]); way++) {
		for (int k = 0; k < 2 * PACKETS; k += WORLD_STRIDE) {
			lose_put_back(&world);
			lose_one(k, PACKETS);
			aborts[way].abort(&world);
			world_run(&world, aborts[way].settle_ns);
			check_stands(what, aborts[way].name);
		}
	}
	lose_put_back(&world);
}

static bool in_step(unsigned int step)
{
	const struct pokeys_threading *threading = &world.state.threading;
	const struct pokeys_engine *engine = &world.state.engine;
	const bool at[] = {
		engine->task_phase == POKEYS_TASK_STARTING,
		threading->preparing,
		threading->prepared && !moved_ms,
		threading->prepared && moved_ms,
		threading->waiting,
		threading->active,
		engine->task_phase == POKEYS_TASK_FINISHING,
	};

	return at[step];
}

static const char *const steps[] = {
	"starting", "preparing", "prepared",  "with slots before it",
	"waiting",  "active",    "releasing",
};

enum { STEPS_OF_IT = sizeof(steps) / sizeof(steps[0]) };

/* What the operator does next in this step. */
static void lead_on(void)
{
	const struct pokeys_threading *threading = &world.state.threading;

	if (threading->prepared && moved_ms >= 20 && world.command.one_shot_head == prepared_head)
		queue(POKEYS_ONE_SHOT_THREAD_ARM);
	if (threading->active && moved_ms >= THREAD_MS - 1 &&
	    world.command.one_shot_head == prepared_head + 1)
		queue(POKEYS_ONE_SHOT_THREAD_RELEASE);
	if (threading->prepared || threading->waiting || threading->active)
		move();
	else
		world_cycle(&world);
}

static void it_ends_standing_from_any_step_with_any_packet_lost(void **state)
{
	unsigned int step = 0;

	(void)state;
	begin();
	there_and_back();
	for (unsigned int left = 100; left && !world.state.engine.task_count; left--) {
		if (world.state.engine.task_phase != POKEYS_TASK_IDLE)
			break;
		queue(POKEYS_ONE_SHOT_THREAD_PREPARE);
		world_run(&world, 2 * MS);
	}
	for (unsigned int left = 2000; left && step < STEPS_OF_IT; left--) {
		while (step < STEPS_OF_IT && in_step(step)) {
			printf("%s\n", steps[step]);
			abort_here(steps[step++]);
		}
		lead_on();
	}
	assert_int_equal(step, STEPS_OF_IT);
}

static uint8_t late[64], keep;

static void keep_back(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0x85 && packet[2] == keep && !late[1];
	if (w->swallow)
		memcpy(late, packet, sizeof(late));
}

/* The network kept it back and delivers it so many ms after the abort. */
static void request_that_arrives_late_leaves_nothing(void **state)
{
	(void)state;
	for (uint64_t delay = 0; delay < 60; delay += 3) {
		for (keep = 0x30; keep <= 0x32; keep = (uint8_t)(keep + 2)) {
			begin();
			memset(late, 0, sizeof(late));
			world.watch = keep_back;
			queue(POKEYS_ONE_SHOT_THREAD_PREPARE);
			for (unsigned int left = 2000; left && !late[1]; left--)
				lead_on();
			assert_int_equal(late[1], 0x85);
			world_machine_off(&world);
			world_run(&world, delay * MS);
			sim_rig_send_from(&world.rig, world.now, 77, late, sizeof(late));
			world_run(&world, 400 * MS);
			check_stands("late request", "machine off");
		}
	}
}

/* No abort, each packet lost once. */
static void single_lost_packet_does_not_spoil_a_thread(void **state)
{
	(void)state;
	begin();
	there_and_back();
	world_run(&world, 100 * MS);
	lose_keep(&world);
	for (int k = 0; k < 2 * 700; k += WORLD_STRIDE) {
		uint32_t id;

		lose_put_back(&world);
		moved_ms = 0;
		lose_one(k, 700);
		id = queue(POKEYS_ONE_SHOT_THREAD_PREPARE);
		for (unsigned int left = 3000; left && !world.state.engine.task_count; left--)
			lead_on();
		if (world.state.engine.task_result != POKEYS_TASK_DONE)
			fail_msg("result %u, lost %d", world.state.engine.task_result, k);
		assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_DONE);
		world_run(&world, 300 * MS);
		sim_rig_run(&world.rig, world.now);
		assert_int_equal(world.rig.device.engine.axis[0].pulses, moved_ms * FEED);
		assert_int_equal(world.rig.device.engine.axis[1].pulses, -moved_ms * FEED / 2);
		assert_int_equal(world.rig.device.bench.machine.axis[0].steps,
				 (uint64_t)(moved_ms * FEED) +
					 lose_kept()->rig.device.bench.machine.axis[0].steps);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(it_ends_standing_from_any_step_with_any_packet_lost),
		cmocka_unit_test(request_that_arrives_late_leaves_nothing),
		cmocka_unit_test(single_lost_packet_does_not_spoil_a_thread),
	};
	const int failed = cmocka_run_group_tests(tests, NULL, NULL);

	lose_end();
	free(world.device);
	return failed;
}
