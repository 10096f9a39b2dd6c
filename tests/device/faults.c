/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The network at its worst (fault catalogue, rows 1 to 5, 7 to 9, 18): what is
 * published is true and has its right age, what is commanded arrives, and all
 * is well again soon after.
 *
 * The inputs count milliseconds in binary, so that each published sample
 * tells by itself when it was taken.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"

enum { FIRST = 22, BITS = 16, RELAY = 0 }; /* inputs that count, an output that follows */

static struct world world;
static uint64_t began;

static void pin(unsigned int i, uint8_t function)
{
	world_pin(&world, i, function);
}

static void begin(const struct sim_rig_options *options, uint64_t seed)
{
	world_init(&world, options);
	for (unsigned int i = 0; i < BITS; i++)
		pin(FIRST + i, 2);
	pin(RELAY, 4);
	world_axes(&world);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 1 * SECOND);
	sim_prng_init(&world.rig.link.way[0].prng, seed);
	sim_prng_init(&world.rig.link.way[1].prng, ~seed);
	began = world.tick;
}

static void show_time(void)
{
	const uint64_t ms = (world.tick - began) / MS;
	struct sim_device *sim = &world.rig.device;

	sim_rig_run(&world.rig, world.now);
	sim->bench.pins.level &= ~(UINT64_C(0xffff) << FIRST);
	sim->bench.pins.level |= (ms & 0xffff) << FIRST;
	sim_pins_settle(sim);
}

/* When the published inputs were sampled, in ms since the beginning. */
static uint64_t sampled_ms(void)
{
	uint64_t bits = 0;

	memcpy(&bits, world.state.digital_in, sizeof(world.state.digital_in));
	return bits >> FIRST & 0xffff;
}

/*
 * A network that swaps requests and also their replies may bring an older sample after a
 * newer one: by the time for which it keeps a packet and the next one.
 */
static uint64_t swapped_ms;

/*
 * I1 and I2: the sample is one that was really there, not after its stamp, not
 * before one that was published earlier, and not older than a request can be.
 */
static void check_sample(uint64_t last_ms, uint64_t oldest_ms)
{
	const uint64_t ms = sampled_ms();
	const uint64_t stamp_ms = (world.state.t_digital_ns - began) / MS;

	if (world.state.t_digital_ns < began + 2 * MS)
		return;
	assert_true(ms <= stamp_ms);
	assert_true(ms + swapped_ms >= last_ms);
	assert_true(stamp_ms - ms <= oldest_ms);
}

static unsigned int stale_cycles;

static void run(uint64_t for_ns, uint64_t oldest_ms)
{
	const uint64_t end = world.tick + for_ns;
	uint64_t last = world.state.t_digital_ns < began + 2 * MS ? 0 : sampled_ms();

	while (world.tick < end) {
		show_time();
		world_output(&world, RELAY, (world.tick - began) / (50 * MS) & 1);
		world_cycle(&world);
		check_sample(last, oldest_ms);
		if (world.state.t_digital_ns >= began + 2 * MS)
			last = sampled_ms();
		stale_cycles += !!(world.state.flags & POKEYS_STATE_STALE);
	}
}

static void all_is_well_again(uint64_t within_ns)
{
	world_loss(&world, 0);
	run(within_ns, 1000);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_false(world.state.flags & POKEYS_STATE_STALE);
	world_output(&world, RELAY, true);
	world_machine_on(&world);
	world_run(&world, 60 * MS);
	assert_true(world_latch(&world, RELAY));
}

static void survive_losses(uint64_t seed)
{
	static const double losses[] = { 0.0001, 0.001, 0.01, 0.05, 0.1, 0.33 };

	for (unsigned int i = 0; i < 6; i++) {
		begin(NULL, seed + i);
		world_loss(&world, losses[i]);
		stale_cycles = 0;
		run(20 * SECOND, 250);
		if (losses[i] <= 0.01) {
			/* no latched fault, no loss of the link, next to no staleness */
			assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
			assert_int_equal(world.state.statistics.reconnects, 0);
			assert_true(stale_cycles < 100);
		}
		/* a bad cable fills no journal */
		assert_true(world.event_count[EVENT_STALE] <= 2 * 22);
		all_is_well_again(300 * MS);
	}
}

static void losses_are_survived(void **state)
{
	(void)state;
	survive_losses(world_seed());
}

/*
 * A device's identity that had no answer three times was asked for far too late, and
 * outputs waited.
 */
static void identity_is_asked_for_however_often_it_had_no_answer(void **state)
{
	(void)state;
	survive_losses(UINT64_C(15611442124592));
}

static void bursts_are_survived(void **state)
{
	const uint64_t seed = world_seed();

	(void)state;
	for (unsigned int i = 0; i < 12; i++) {
		const struct sim_link_faults faults = {
			.delay = { .low_ns = 25 * US },
			.burst_every_ns = 300 * MS,
			.burst_length_ns = (1 + 17 * i) * MS,
			.burst_loss = 1,
		};

		begin(NULL, seed + i);
		world_faults(&world, &faults);
		run(10 * SECOND, 250);
		/* some in a row may be a lost link, that has just been left to its failsafe */
		all_is_well_again(3 * SECOND);
	}
}

/* Fresh again within 100 ms after a burst that is too short for a loss of the link. */
static void fresh_soon_after_a_burst(void **state)
{
	(void)state;
	begin(NULL, 1);
	for (unsigned int ms = 1; ms < 190; ms += 3) {
		sim_rig_silence(&world.rig, world.now, ms * MS);
		run(ms * MS, 250);
		if (ms < 9 || ms > 11)
			assert_int_equal(!!(world.state.flags & POKEYS_STATE_STALE), ms > 11);
		run(100 * MS, 250);
		assert_false(world.state.flags & POKEYS_STATE_STALE);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
		run(20 * MS, 250);
	}
}

static void one_way_losses_are_survived(void **state)
{
	(void)state;
	for (unsigned int way = 0; way < SIM_LINK_DIRS; way++) {
		begin(NULL, way);
		for (unsigned int i = 0; i < 20; i++) {
			sim_link_silence(&world.rig.link, (enum sim_link_dir)way, world.now,
					 world.now + (20 + i * 30) * MS);
			run((20 + i * 30) * MS, 1000);
			all_is_well_again(400 * MS);
		}
	}
}

static void reordered_late_and_doubled_packets_publish_nothing_wrong(void **state)
{
	const uint64_t seed = world_seed();

	(void)state;
	for (unsigned int i = 0; i < 8; i++) {
		const struct sim_link_faults faults = {
			/* no packet is under way for longer than its id rests, 500 ms */
			.delay = { SIM_DELAY_HEAVY_TAIL, 50 * US, (10 + 15 * i) * MS, 1.1 },
			.reorder = 0.2,
			.reorder_ns = (1 + 5 * i) * MS,
			.duplicate = 0.3,
			.copies = 1 + 3 * i,
			.copy_gap_ns = 3 * MS,
			.loss = 0.02,
		};

		begin(NULL, seed + i);
		world_faults(&world, &faults);
		swapped_ms = (faults.delay.high_ns + faults.reorder_ns) / MS;
		run(10 * SECOND, 1000);
		all_is_well_again(1 * SECOND);
		swapped_ms = 0;
		assert_true(world.state.statistics.duplicate + world.state.statistics.stray > 100);
	}
}

static void wrong_answers_are_dropped(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { .low_ns = 25 * US },
		.wrong_id = 0.1,
		.wrong_op = 0.1,
		.truncate = 0.1,
	};

	(void)state;
	begin(NULL, 7);
	sim_link_set_faults(&world.rig.link, SIM_LINK_REPLY, &faults);
	run(10 * SECOND, 250);
	assert_true(world.state.statistics.stray > 100);
	assert_true(world.state.statistics.corrupt > 100);
	all_is_well_again(300 * MS);
}

/* 200 stray replies cost nothing: no lost request, no further traffic. */
static void stray_replies_cost_nothing(void **state)
{
	uint64_t sent, resent;

	(void)state;
	begin(NULL, 3);
	run(500 * MS, 10);
	sent = world.sent.operation[0xCC];
	resent = world.state.statistics.resent;
	for (unsigned int i = 0; i < 200; i++) {
		for (unsigned int n = 0; n < 5; n++)
			sim_rig_stray(&world.rig, world.now);
		run(1 * MS, 10);
	}
	assert_int_equal(world.sent.operation[0xCC] - sent, 200);
	assert_int_equal(world.state.statistics.resent, resent);
	assert_true(world.state.statistics.duplicate + world.state.statistics.stray >= 500);
}

static void jitter_makes_no_storm(void **state)
{
	const struct sim_rig_options options = {
		.service_ns = 380 * US,
		.jitter_ns = 600 * US,
		.hiccup = 0.01,
		.hiccup_ns = 5 * MS,
	};

	(void)state;
	begin(&options, world_seed());
	run(30 * SECOND, 60);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_true(world.state.statistics.resent * 50 < world.state.statistics.sent);
}

/* Cable out for 10 ms to 60 s, a hundred times. */
static void silences_of_any_length_are_survived(void **state)
{
	const uint64_t seed = world_seed();
	struct sim_prng prng;
	uint64_t limit;

	(void)state;
	sim_prng_init(&prng, seed);
	begin(NULL, seed);
	for (unsigned int i = 0; i < 100; i++) {
		const uint64_t length = i == 99 ? 60 * SECOND :
						  (10 + sim_prng_below(&prng, i * 40 + 1)) * MS;

		sim_rig_silence(&world.rig, world.now, length);
		world_run(&world, length);
		assert_true(length < 210 * MS || world.state.link != POKEYS_LINK_RUNNING);
		/* for a while of each loss its failsafe has its turn */
		limit = length < 1600 * MS || length > 3 * SECOND ? 300 * MS : 1500 * MS;
		assert_true(world_until(&world, world_is_running, 2 * SECOND) <= limit);
		world_run(&world, 100 * MS);
	}
}

static void reboots_at_any_moment_are_survived(void **state)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US,
		.device.boot_ms = 700,
	};
	const uint64_t seed = world_seed();
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, seed);
	begin(&options, seed);
	for (unsigned int i = 0; i < 60; i++) {
		world_run(&world, (300 + sim_prng_below(&prng, 600)) * MS);
		sim_rig_reboot(&world.rig, world.now + sim_prng_below(&prng, 1 * MS), i & 1);
		world_run(&world, 800 * MS);
		assert_true(world_until(&world, world_is_running, 2 * SECOND) <= 300 * MS);
		assert_int_equal(world.rig.device.config.pins.function[RELAY], 4);
		assert_int_equal(world.rig.device.config.engine.axes, 3);
	}
}

/* In the midst of finding, identifying and configuring. */
static void reboots_and_losses_while_it_is_being_found(void **state)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US,
		.device.boot_ms = 20,
	};
	const uint64_t seed = world_seed();
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, seed);
	for (unsigned int i = 0; i < 300; i++) {
		begin(&options, seed + i);
		world_start(&world);
		world_loss(&world, (double)(i % 4) / 10);
		world_run(&world, sim_prng_below(&prng, 30) * MS);
		sim_rig_reboot(&world.rig, world.now, true);
		world_run(&world, sim_prng_below(&prng, 60) * MS);
		sim_rig_reboot(&world.rig, world.now, true);
		world_loss(&world, 0);
		world_run(&world, 1 * SECOND);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
		assert_int_equal(world.rig.device.config.pins.function[RELAY], 4);
		assert_int_equal(world.rig.device.config.engine.axis[2][0], 0x0D);
	}
}

static void stalls_of_the_daemon_are_survived(void **state)
{
	const uint64_t seed = world_seed();
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, seed);
	begin(NULL, seed);
	for (unsigned int i = 0; i < 100; i++) {
		const uint64_t sent = world.sent.all;

		world_stall(&world, sim_prng_below(&prng, i == 50 ? 5000 : 300) * MS);
		world_run(&world, 20 * MS);
		assert_true(world.sent.all - sent <= 3 * 20 + 10);
		world_until(&world, world_is_running, 500 * MS);
		world_run(&world, 50 * MS);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(losses_are_survived),
		cmocka_unit_test(identity_is_asked_for_however_often_it_had_no_answer),
		cmocka_unit_test(bursts_are_survived),
		cmocka_unit_test(fresh_soon_after_a_burst),
		cmocka_unit_test(one_way_losses_are_survived),
		cmocka_unit_test(reordered_late_and_doubled_packets_publish_nothing_wrong),
		cmocka_unit_test(wrong_answers_are_dropped),
		cmocka_unit_test(stray_replies_cost_nothing),
		cmocka_unit_test(jitter_makes_no_storm),
		cmocka_unit_test(silences_of_any_length_are_survived),
		cmocka_unit_test(reboots_at_any_moment_are_survived),
		cmocka_unit_test(reboots_and_losses_while_it_is_being_found),
		cmocka_unit_test(stalls_of_the_daemon_are_survived),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
