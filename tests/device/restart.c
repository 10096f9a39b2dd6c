/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A restart is told when there was one, and only then: it stops a machine. Late,
 * doubled, overtaken and damaged answers tell the clock and the serial number of
 * another moment, or of nothing; they are not evidence enough.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/packet.h"

static struct world world;

static void begin(uint64_t seed)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US,
		.device.boot_ms = 30,
	};

	world_init(&world, &options);
	world.config.serial = 65432;
	world_axes(&world);
	world_start(&world);
	sim_prng_init(&world.rig.link.way[0].prng, seed);
	sim_prng_init(&world.rig.link.way[1].prng, ~seed);
}

static void be_bad(unsigned int i)
{
	struct sim_link_faults faults = {
		/* no packet is under way for longer than its id rests, 500 ms */
		.delay = { SIM_DELAY_HEAVY_TAIL, 50 * US, (1 + 10 * (i % 10)) * MS, 1.1 },
		.reorder = 0.2,
		.reorder_ns = (1 + i % 7 * 5) * MS,
		.duplicate = 0.3,
		.copies = 1 + i % 5,
		.copy_gap_ns = 3 * MS,
		.loss = 0.02 * (double)(i % 8),
	};

	sim_link_set_faults(&world.rig.link, SIM_LINK_REQUEST, &faults);
	faults.corrupt = i & 1 ? 0.3 : 0;
	sim_link_set_faults(&world.rig.link, SIM_LINK_REPLY, &faults);
}

static void no_restart_is_told_where_there_was_none(void **state)
{
	const uint64_t seed = world_seed();

	(void)state;
	for (unsigned int i = 0; i < 40; i += WORLD_STRIDE) {
		begin(seed + i);
		be_bad(i);
		for (unsigned int n = 0; n < 10; n++) {
			world_run(&world, 2 * SECOND);
			sim_rig_silence(&world.rig, world.now, 400 * MS);
		}
		assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
		assert_int_equal(world.event_count[EVENT_WRONG_SERIAL], 0);
		assert_int_not_equal(world.state.fault, POKEYS_FAULT_REBOOTED);
	}
}

static bool stays_running(struct world *w)
{
	return w->state.link == POKEYS_LINK_RUNNING;
}

static void each_restart_is_told_however_bad_the_cable_is(void **state)
{
	const uint64_t seed = world_seed();

	(void)state;
	for (unsigned int i = 0; i < 40; i += WORLD_STRIDE) {
		begin(seed + i);
		be_bad(i);
		for (unsigned int n = 0; n < 4; n++) {
			world_until(&world, stays_running, 5 * SECOND);
			world_run(&world, 500 * MS);
			sim_rig_reboot(&world.rig, world.now, n & 1);
			world_run(&world, 5 * SECOND);
			assert_int_equal(world.event_count[EVENT_REBOOTED], n + 1);
		}
	}
}

/* The clock begins at byte 2 of its answer; the others are in the device data. */
enum { CLOCK_AT = 4, SERIAL_AT = 15, LOCK_AT = 58, BOOTLOADER_AT = 61 };

/* How many answers of an operation are replaced by ones that tell something else. */
static unsigned int to_damage;
static uint8_t damaged, damaged_at;
static bool was_locked, was_refused; /* in any state image */

static bool damage(struct world *w, const uint8_t *packet)
{
	uint8_t other[WIRE_PK];

	was_locked = was_locked || w->state.identity.locked;
	was_refused = was_refused || w->state.fault == POKEYS_FAULT_UNSUPPORTED;
	if (!to_damage || packet[WIRE_AT_OP] != damaged)
		return false;
	to_damage--;
	memcpy(other, packet, sizeof(other));
	other[damaged_at] ^= 0x10;
	wire_finish(other, packet[WIRE_AT_ID]);
	device_deliver(w->device, other, sizeof(other), NULL, w->now);
	return true;
}

static void one_odd_answer_is_asked_again(void **state)
{
	static const uint8_t operations[] = { 0xCF, 0x00, 0x00 };
	static const uint8_t at[] = { CLOCK_AT, SERIAL_AT, LOCK_AT };

	(void)state;
	was_locked = false;
	for (unsigned int i = 0; i < sizeof(at); i++) {
		begin(i);
		world_until(&world, world_is_running, 1 * SECOND);
		world.lose_reply = damage;
		for (unsigned int n = 1; n <= 10; n++) {
			damaged = operations[i];
			damaged_at = at[i];
			to_damage = 1;
			world_run(&world, 1500 * MS);
			assert_int_equal(to_damage, 0);
			assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
			assert_int_equal(world.state.statistics.corrupt, n);
			assert_int_equal(world.state.identity.serial, 65432);
		}
		assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
		assert_int_not_equal(world.state.fault, POKEYS_FAULT_REBOOTED);
		assert_false(was_locked);
	}
}

static unsigned int said_locked;

static bool count_locked(struct world *w, const uint8_t *packet)
{
	(void)w;
	said_locked += packet[WIRE_AT_OP] == 0x00 && packet[LOCK_AT];
	return false;
}

static bool is_locked(struct world *w)
{
	return w->state.identity.locked;
}

static void lock_is_believed_when_it_was_said_twice(void **state)
{
	(void)state;
	begin(0);
	world_until(&world, world_is_running, 1 * SECOND);
	said_locked = 0;
	world.lose_reply = count_locked;
	world.rig.device.config.identity.locked = 1;
	world_until(&world, is_locked, 5 * SECOND);
	assert_int_equal(said_locked, 2);
	assert_int_equal(world.state.statistics.corrupt, 0);
	assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
}

/* One bit of many, and the same one at the next answer: it happens, and would stop a machine. */
static void two_that_are_damaged_alike_are_no_other_device(void **state)
{
	(void)state;
	for (unsigned int clock = 0; clock < 2; clock++) {
		begin(0);
		world_until(&world, world_is_running, 1 * SECOND);
		world.lose_reply = damage;
		damaged = clock ? 0xCF : 0x00;
		damaged_at = clock ? CLOCK_AT : SERIAL_AT;
		to_damage = 2;
		world_run(&world, 1500 * MS);
		assert_int_equal(to_damage, 0);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
		assert_int_equal(world.state.statistics.corrupt, 2);
		assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
		assert_int_not_equal(world.state.fault, POKEYS_FAULT_REBOOTED);
	}
}

/* Nor when it comes back, or is found; nor one that cannot be used, or needs no serial. */
static void two_that_are_damaged_alike_do_not_refuse_ours(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < 8; i++) {
		const bool ran = i & 1;

		was_refused = false;
		begin(0);
		if (i & 2)
			world.config.serial = 0;
		if (i & 2)
			world_start(&world);
		if (ran) {
			world_until(&world, world_is_running, 1 * SECOND);
			sim_rig_silence(&world.rig, world.now, 400 * MS);
			world_run(&world, 300 * MS);
			assert_int_not_equal(world.state.link, POKEYS_LINK_RUNNING);
		}
		world.lose_reply = damage;
		damaged = 0x00;
		damaged_at = i & 4 ? BOOTLOADER_AT : SERIAL_AT;
		to_damage = 2;
		world_until(&world, world_is_running, 2 * SECOND);
		assert_int_equal(to_damage, 0);
		assert_int_equal(world.state.identity.serial, 65432);
		assert_int_equal(world.event_count[EVENT_WRONG_SERIAL], 0);
		assert_false(was_refused);
	}
}

/* A device is taken for what it says twice, also when it says it for the first time. */
static void damaged_serial_number_is_not_believed_when_it_is_found(void **state)
{
	(void)state;
	begin(0);
	world.config.serial = 0;
	world_start(&world);
	world.lose_reply = damage;
	damaged = 0x00;
	damaged_at = SERIAL_AT;
	to_damage = 1;
	world_until(&world, world_is_running, 1 * SECOND);
	assert_int_equal(to_damage, 0);
	assert_int_equal(world.state.identity.serial, 65432);
	assert_int_equal(world.event_count[EVENT_IDENTIFIED], 1);
}

static bool odd_was_seen;

static bool see_odd(struct world *w, const uint8_t *packet)
{
	(void)w;
	odd_was_seen = odd_was_seen || packet[WIRE_AT_OP] == 0x00;
	return false;
}

static void only_questions(struct world *w, const uint8_t *p)
{
	(void)w;
	if (!odd_was_seen)
		return;
	assert_false(p[1] == 0xCC && p[2] && (~p[20] & 0xFF));
	assert_false(p[1] == 0x85 && p[2] != 0x00 && p[2] != 0x08);
}

/* From the first answer that does not fit on, before it is sure. */
static void in_doubt_there_are_only_questions(void **state)
{
	(void)state;
	begin(0);
	world_pin(&world, 0, 4);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 1 * SECOND);
	world_go(&world, 0, 100000, 0);
	world_machine_on(&world);
	odd_was_seen = false;
	world.rig.device.options.serial = 777;
	world.lose_reply = see_odd;
	world.watch = only_questions;
	for (unsigned int i = 0; i < 1500; i++) {
		world_output(&world, 0, i & 1);
		world_cycle(&world);
	}
	assert_true(odd_was_seen);
	assert_int_equal(world.state.fault, POKEYS_FAULT_WRONG_SERIAL);
}

/* No two readings fit each other: this is no clock, and not our device's. */
static bool babble(struct world *w, const uint8_t *packet)
{
	static uint8_t value;
	uint8_t other[WIRE_PK];

	if (packet[WIRE_AT_OP] != 0xCF)
		return false;
	memcpy(other, packet, sizeof(other));
	other[4] = (uint8_t)((value += 17) | 1);
	wire_finish(other, packet[WIRE_AT_ID]);
	device_deliver(w->device, other, sizeof(other), NULL, w->now);
	return true;
}

static void clock_that_never_fits_is_no_doubt_for_ever(void **state)
{
	(void)state;
	begin(0);
	world_until(&world, world_is_running, 1 * SECOND);
	world.lose_reply = babble;
	world_run(&world, 2 * SECOND);
	assert_true(world.event_count[EVENT_REBOOTED] > 0);
	world.lose_reply = NULL;
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
}

/* The clock's number begins anew after 49 days; so long it may also have been away. */
static void clock_that_wraps_is_the_same_one(void **state)
{
	static const uint64_t days[] = { 0, 20, 30, 60, 200 };

	(void)state;
	for (unsigned int i = 0; i < 5; i++) {
		begin(0);
		world.rig.device.run.boot_ns -= ((UINT64_C(1) << 32) - 3000) * MS;
		world_until(&world, world_is_running, 1 * SECOND);
		if (days[i])
			world_stall(&world, days[i] * 24 * 3600 * SECOND);
		world_run(&world, 10 * SECOND);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
		assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(no_restart_is_told_where_there_was_none),
		cmocka_unit_test(each_restart_is_told_however_bad_the_cable_is),
		cmocka_unit_test(one_odd_answer_is_asked_again),
		cmocka_unit_test(lock_is_believed_when_it_was_said_twice),
		cmocka_unit_test(two_that_are_damaged_alike_are_no_other_device),
		cmocka_unit_test(two_that_are_damaged_alike_do_not_refuse_ours),
		cmocka_unit_test(damaged_serial_number_is_not_believed_when_it_is_found),
		cmocka_unit_test(in_doubt_there_are_only_questions),
		cmocka_unit_test(clock_that_never_fits_is_no_doubt_for_ever),
		cmocka_unit_test(clock_that_wraps_is_the_same_one),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
