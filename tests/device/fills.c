/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Buffered mode by every kind of fill: bytes, 16-bit steps, eight parts in a
 * datagram. Whatever the network loses, repeats, holds back or delays, and
 * whatever the device makes of parts: when all has come to rest the axes stand
 * at the commanded pulse, not one step more or less.
 *
 * POKEYS_SEED shifts the seeds; each failure names its own.
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

enum { SEEDS = 25, RUN_MS = 1500 };

static struct world world;

struct kind {
	const char *name;
	unsigned int axes;
	int32_t speed; /* pulses in a millisecond, of the fastest axis */
	uint8_t khz;   /* of the device; 0: its own */
	bool count_free;
	/* what becomes of parts on their way */
	void (*watch)(struct world *world, const uint8_t *packet);
	bool (*lose_reply)(struct world *world, const uint8_t *packet);
	uint8_t used; /* this operation or sub-command must have gone */
};

static bool is_running(struct world *w)
{
	return w->state.engine.state == WIRE_ENGINE_RUNNING && w->state.engine.axis[0].in_position;
}

static void go(unsigned int axis, int32_t position)
{
	world.command.axis[axis] = (struct pokeys_axis_command){
		.position = position,
		.mode = POKEYS_AXIS_BUFFERED,
		.enable = 1,
	};
}

static void begin(const struct kind *kind, uint64_t seed)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US, .seed = seed,
		.device.choices = { .count_free = kind->count_free, .axis_khz = kind->khz },
		.link.faults = {
			{ .delay = { .low_ns = 25 * US } }, { .delay = { .low_ns = 25 * US } },
		},
	};
	struct pokeys_settings *settings;

	world_init(&world, &options);
	world_axes(&world);
	settings = &world.config.settings;
	settings->axes = (uint8_t)kind->axes;
	for (unsigned int i = 0; i < kind->axes; i++) {
		settings->axis[i] = settings->axis[0];
		settings->axis[i].options = WIRE_AXIS_ENABLED;
		settings->axis[i].options_mask = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER |
						 WIRE_AXIS_POSITION_MODE;
		settings->axis[i].max_speed = (float)kind->speed * 1.5e3f;
		settings->axis[i].max_acceleration = 2e7f;
	}
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	for (unsigned int i = 0; i < kind->axes; i++)
		go(i, 0);
	world_machine_on(&world);
	world_until(&world, is_running, 500 * MS);
	world.watch = kind->watch;
	world.lose_reply = kind->lose_reply;
}

/* To and fro, each axis another part of the way. */
static void move(const struct kind *kind, unsigned int ms)
{
	const double turn = 6.283185307 * ms / RUN_MS;
	const double way = kind->speed * (RUN_MS / 6.283185307) * (1 - cos(turn)) +
			   30.0 * sin(17 * turn);

	for (unsigned int i = 0; i < kind->axes; i++)
		go(i, (int32_t)(i & 1 ? -way / (i + 1) : way / (i + 1)));
}

static uint64_t count_sent(uint8_t used)
{
	return used == 0xB0 ? world.sent.operation[0xB0] : world.sent.pulse[used];
}

static void ends_exactly(const struct kind *kind, uint64_t seed)
{
	static const int32_t end[POKEYS_AXES] = { 12345, -6789, 1, 0, -1, 32768, 777, -32769 };

	for (unsigned int i = 0; i < kind->axes; i++)
		go(i, end[i]);
	world_loss(&world, 0);
	world_run(&world, 4 * SECOND);
	for (unsigned int i = 0; i < kind->axes; i++) {
		const struct pokeys_axis *axis = &world.state.engine.axis[i];
		const int64_t at = world_pulses(&world, i);

		if (at != end[i] || axis->position != end[i] || axis->following_error)
			fail_msg("%s, seed %llu: axis %u is at %lld (seen at %d), should be at %d",
				 kind->name, (unsigned long long)seed, i, (long long)at,
				 axis->position, end[i]);
		assert_int_equal(world.rig.device.engine.axis[i].clamped, 0);
	}
}

static void exact_under_all_of_it(const struct kind *kind)
{
	static const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 2 * MS, 0 },
		.loss = 0.02,
		.duplicate = 0.01,
		.reorder = 0.02,
		.reorder_ns = 3 * MS,
	};
	const uint64_t first = getenv("POKEYS_SEED") ? world_seed() : 1;
	uint64_t used = 0;
	unsigned int underruns = 0, resyncs = 0;

	for (uint64_t seed = first; seed < first + SEEDS; seed += WORLD_STRIDE) {
		begin(kind, seed);
		sim_prng_init(&world.rig.link.way[0].prng, seed * 2);
		sim_prng_init(&world.rig.link.way[1].prng, seed * 2 + 1);
		world_faults(&world, &faults);
		for (unsigned int ms = 0; ms < RUN_MS; ms++) {
			move(kind, ms);
			world_cycle(&world);
		}
		ends_exactly(kind, seed);
		used += count_sent(kind->used);
		underruns += world.state.engine.buffer_underruns;
		resyncs += world.state.engine.buffer_resyncs;
	}
	printf("%s: %llu such fills, %u underruns, %u resyncs in %d runs\n", kind->name,
	       (unsigned long long)used, underruns, resyncs, SEEDS);
	assert_true(used > 0);
}

static void bytes_one_packet(void **state)
{
	static const struct kind kinds[] = {
		{ .name = "bytes, free slots told",
		  .axes = 3,
		  .speed = 40,
		  .count_free = true,
		  .used = 0xFF },
		{ .name = "bytes, not told", .axes = 3, .speed = 40, .used = 0xFF },
	};

	(void)state;
	exact_under_all_of_it(&kinds[0]);
	exact_under_all_of_it(&kinds[1]);
}

static void wide_steps(void **state)
{
	static const struct kind kinds[] = {
		{ .name = "16 bits, free slots told",
		  .axes = 3,
		  .speed = 160,
		  .khz = 250,
		  .count_free = true,
		  .used = 0xFE },
		{ .name = "16 bits, not told", .axes = 3, .speed = 160, .khz = 250, .used = 0xFE },
	};

	(void)state;
	exact_under_all_of_it(&kinds[0]);
	exact_under_all_of_it(&kinds[1]);
}

static void eight_parts(void **state)
{
	static const struct kind kinds[] = {
		{ .name = "parts, free slots told",
		  .axes = 8,
		  .speed = 80,
		  .count_free = true,
		  .used = 0xB0 },
		{ .name = "parts, not told", .axes = 8, .speed = 80, .used = 0xB0 },
		{ .name = "wide parts, free slots told",
		  .axes = 8,
		  .speed = 160,
		  .khz = 250,
		  .count_free = true,
		  .used = 0xB0 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(kinds) / sizeof(kinds[0]); i++)
		exact_under_all_of_it(&kinds[i]);
}

/* ---- devices that do not take parts */

static void swallow_parts(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xB0;
}

static bool lose_answers_to_parts(struct world *w, const uint8_t *packet)
{
	(void)w;
	return packet[1] == 0xB0;
}

static void parts_that_nobody_answers_are_given_up(void **state)
{
	static const struct kind kinds[] = {
		{ .name = "parts swallowed",
		  .axes = 8,
		  .speed = 80,
		  .count_free = true,
		  .watch = swallow_parts,
		  .used = 0xFF },
		{ .name = "parts swallowed, not told",
		  .axes = 8,
		  .speed = 80,
		  .watch = swallow_parts,
		  .used = 0xFF },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(kinds) / sizeof(kinds[0]); i++) {
		exact_under_all_of_it(&kinds[i]);
		assert_int_equal(world.sent.operation[0xB0], 2);
	}
}

/* Executed each time, and never known from an answer. */
static void parts_whose_answers_are_lost_move_once(void **state)
{
	static const struct kind kind = {
		.name = "answers to parts lost",
		.axes = 8,
		.speed = 80,
		.count_free = true,
		.lose_reply = lose_answers_to_parts,
		.used = 0xB0,
	};

	(void)state;
	exact_under_all_of_it(&kind);
}

/* A step above what the generator makes would be cut short by the device. */
static void no_slot_asks_for_more_than_the_generator_makes(void **state)
{
	static const struct kind kind = { .axes = 3, .speed = 140, .count_free = true };

	(void)state;
	begin(&kind, 1);
	for (int32_t ms = 0; ms < 2000; ms++) {
		go(0, ms * 140);
		world_cycle(&world);
	}
	assert_int_equal(world.rig.device.engine.axis[0].clamped, 0);
	assert_int_equal(world.state.engine.buffer_resyncs, 0);
	ends_exactly(&kind, 1);
}

static const struct kind both_kinds[] = {
	{ .name = "free slots told", .axes = 2, .speed = 40, .count_free = true },
	{ .name = "free slots not told", .axes = 2, .speed = 40 },
};

static void assert_never_dry(const struct kind *kind, const char *what)
{
	const struct pokeys_engine *engine = &world.state.engine;
	const uint64_t dry = world.rig.device.engine.ring.underruns;

	if (dry || engine->buffer_underruns || engine->buffer_resyncs)
		fail_msg("%s, %s: ran dry %llu times, seen %u times, %u resyncs", kind->name, what,
			 (unsigned long long)dry, engine->buffer_underruns, engine->buffer_resyncs);
}

/* A cycle; every hundredth is late, as on a busy computer. */
static void go_on_a_busy_computer(uint64_t *cycle)
{
	world.length_ns = ++*cycle % 100 ? 0 : 9 * MS;
	world_cycle(&world);
}

static void a_busy_computer_does_not_let_it_run_dry(void **state)
{
	(void)state;
	for (size_t k = 0; k < 2; k++) {
		const struct kind *kind = &both_kinds[k];
		uint64_t cycle = 0;

		begin(kind, 1);
		/* its silences are learnt */
		while (cycle < 1000)
			go_on_a_busy_computer(&cycle);
		for (unsigned int ms = 0; ms < 20 * RUN_MS;
		     ms += (unsigned int)(world.length_ns ? 9 : 1)) {
			move(kind, ms);
			go_on_a_busy_computer(&cycle);
		}
		world.length_ns = 0;
		assert_never_dry(kind, "late cycles");
		ends_exactly(kind, 1);
	}
}

/* A device that does not tell its level has to play all before a fill is known to be lost. */
static void late_replies_do_not_let_it_run_dry(void **state)
{
	const struct sim_link_faults late = {
		.delay = { SIM_DELAY_HEAVY_TAIL, 25 * US, 8 * MS, 1.2 },
	};

	(void)state;
	for (size_t k = 0; k < 2; k++) {
		const struct kind *kind = &both_kinds[k];

		begin(kind, 1);
		sim_link_set_faults(&world.rig.link, SIM_LINK_REPLY, &late);
		world_run(&world, 2 * SECOND);
		for (unsigned int ms = 0; ms < 20 * RUN_MS; ms++) {
			move(kind, ms);
			world_cycle(&world);
		}
		assert_never_dry(kind, "late replies");
		ends_exactly(kind, 1);
	}
}

/*
 * Slow axes, as in homing, are at the same position after many slots, so the position alone does
 * not tell how far the device is. Each pulse may be a motion from rest.
 */
static void slow_motion(const struct kind *kind, int32_t speed, uint64_t *cycle)
{
	const int32_t from = (int32_t)world_pulses(&world, 0);
	const uint64_t begun = world.tick;

	while (world.tick - begun < 5 * SECOND) {
		int32_t level, used;

		go(0, from + (int32_t)((world.tick - begun) * (uint64_t)speed / SECOND));
		go_on_a_busy_computer(cycle);
		level = world.state.engine.buffer_level;
		used = (int32_t)world.rig.device.engine.ring.used;
		/* what is not acknowledged yet is not known to be in it */
		if (level > used + 12 || level < used - 30 || used > 40)
			fail_msg("%s, %d pulses/s: %d slots known, %d there", kind->name, speed,
				 level, used);
	}
	world.length_ns = 0;
	world_run(&world, 200 * MS);
	assert_never_dry(kind, "slow motion");
}

static void the_level_is_known_in_slow_motion(void **state)
{
	static const int32_t speeds[] = { 24, 150, 700, 5000 }; /* pulses/s */

	(void)state;
	for (size_t k = 0; k < 2; k++) {
		const struct kind *kind = &both_kinds[k];
		uint64_t cycle = 0;

		begin(kind, 1);
		while (cycle < 1000)
			go_on_a_busy_computer(&cycle);
		for (size_t i = 0; i < sizeof(speeds) / sizeof(speeds[0]); i++)
			slow_motion(kind, speeds[i], &cycle);
		ends_exactly(kind, 1);
	}
}

/* Motion from rest far ahead of a slow wire: the lead goes in one datagram. */
static void the_lead_is_sent_at_once(void **state)
{
	static const struct kind kind = { .axes = 8, .speed = 80, .count_free = true };
	const struct sim_link_faults slow = { .delay = { .low_ns = 1500 * US } };
	uint64_t before;

	(void)state;
	begin(&kind, 1);
	world_faults(&world, &slow);
	world_run(&world, 1 * SECOND);
	before = world.sent.operation[0xB0];
	go(0, 100);
	world_run(&world, 2 * MS);
	assert_int_equal(world.sent.operation[0xB0], before + 1);
	ends_exactly(&kind, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bytes_one_packet),
		cmocka_unit_test(wide_steps),
		cmocka_unit_test(eight_parts),
		cmocka_unit_test(parts_that_nobody_answers_are_given_up),
		cmocka_unit_test(parts_whose_answers_are_lost_move_once),
		cmocka_unit_test(no_slot_asks_for_more_than_the_generator_makes),
		cmocka_unit_test(a_busy_computer_does_not_let_it_run_dry),
		cmocka_unit_test(late_replies_do_not_let_it_run_dry),
		cmocka_unit_test(the_level_is_known_in_slow_motion),
		cmocka_unit_test(the_lead_is_sent_at_once),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
