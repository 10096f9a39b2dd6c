/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One-shots: each executed at most once, in order, with an outcome that is
 * true (invariant I4).
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/pulse.h"

static struct world world;

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	world_encoder(&world, 5, WIRE_ENC_ENABLE | WIRE_ENC_4X, 40, 41);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 10 * MS);
	return 0;
}

static enum pokeys_outcome act(uint8_t operation, uint8_t mask, int32_t value)
{
	const struct pokeys_one_shot shot = {
		.operation = operation,
		.mask = mask,
		.value = { value, value, value },
	};

	return world_do(&world, &shot, 4 * SECOND);
}

static void refuses(uint8_t operation, uint8_t mask, int32_t value, unsigned int reason,
		    unsigned int part)
{
	const struct pokeys_one_shot shot = {
		.operation = operation,
		.mask = mask,
		.value = { value, value, value },
	};

	world_refuses(&world, &shot, reason, part);
}

static uint64_t executed(uint8_t operation)
{
	return world.rig.device.stats.executed[operation];
}

static uint64_t positions_set(void)
{
	return world.rig.device.stats.executed_pe[0x03];
}

static void nop_comes_back_at_once(void **state)
{
	(void)state;
	assert_int_equal(act(POKEYS_ONE_SHOT_NOP, 0, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.one_shot_ack, 1);
	assert_int_equal(world.state.one_shot_session, 5);
}

static void many_are_taken_in_order(void **state)
{
	const struct pokeys_one_shot nop = { .operation = POKEYS_ONE_SHOT_NOP };

	(void)state;
	for (unsigned int i = 0; i < 1000; i++) {
		const uint32_t id = world_one_shot(&world, &nop);

		assert_int_equal(id, i);
		if (i % 64 == 63) {
			world_cycle(&world);
			assert_int_equal(world.state.one_shot_ack, i + 1);
		}
	}
	world_run(&world, 2 * MS);
	for (unsigned int i = 1000 - 16; i < 1000; i++)
		assert_int_equal(world_outcome(&world, i), POKEYS_OUTCOME_DONE);
}

static void ids_may_wrap(void **state)
{
	(void)state;
	world_commander(&world, 9);
	world.command.one_shot_head = UINT32_MAX - 3;
	world_run(&world, 5 * MS);
	for (unsigned int i = 0; i < 10; i++)
		assert_int_equal(act(POKEYS_ONE_SHOT_NOP, 0, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.one_shot_ack, 6);
}

static void queue_of_before_us_is_not_executed(void **state)
{
	struct pokeys_one_shot reboot = { .operation = POKEYS_ONE_SHOT_REBOOT };

	(void)state;
	world_start(&world); /* another daemon begins; the commander's ring is full */
	for (unsigned int i = 0; i < 20; i++)
		world_one_shot(&world, &reboot);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 500 * MS);
	assert_int_equal(executed(0xF3), 0);
	assert_int_equal(world.state.one_shot_ack, 20);
	assert_int_equal(world_outcome(&world, 19), POKEYS_OUTCOME_UNKNOWN);
	assert_int_equal(act(POKEYS_ONE_SHOT_NOP, 0, 0), POKEYS_OUTCOME_DONE);
}

static void ring_that_claims_too_much_is_refused_as_a_whole(void **state)
{
	(void)state;
	world.command.one_shot_head += 65;
	world_run(&world, 5 * MS);
	assert_int_equal(world.state.one_shot_ack, 65);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_ONE_SHOT_RING);
	assert_true(world.state.statistics.one_shot_refused >= 1);
	assert_int_equal(act(POKEYS_ONE_SHOT_NOP, 0, 0), POKEYS_OUTCOME_DONE);
}

static void slot_with_another_id_is_refused(void **state)
{
	const struct pokeys_one_shot reboot = { .operation = POKEYS_ONE_SHOT_REBOOT };
	const uint32_t id = world_one_shot(&world, &reboot);

	(void)state;
	world.command.one_shot[id % POKEYS_ONE_SHOTS].id = id + 1;
	world_run(&world, 20 * MS);
	assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(executed(0xF3), 0);
}

static void operations_that_do_not_exist_are_refused(void **state)
{
	(void)state;
	refuses(POKEYS_ONE_SHOT_SERVO_TUNE + 1, 1, 0, REFUSAL_NOT_OFFERED, 0);
	refuses(255, 1, 0, REFUSAL_NOT_OFFERED, 0);
	/* of heaters and servo motors that are not there */
	for (unsigned int none = POKEYS_ONE_SHOT_THREAD_CANCEL + 1; none < 256; none++)
		assert_int_equal(act((uint8_t)none, 1, 0), POKEYS_OUTCOME_REFUSED);
}

static void position_is_set_while_the_axis_stands(void **state)
{
	(void)state;
	assert_int_equal(act(POKEYS_ONE_SHOT_SET_POSITION, 0x5, 4711), POKEYS_OUTCOME_DONE);
	world_run(&world, 5 * MS);
	assert_int_equal(world.state.engine.axis[0].position, 4711);
	assert_int_equal(world.state.engine.axis[1].position, 0);
	assert_int_equal(world.state.engine.axis[2].position, 4711);
	refuses(POKEYS_ONE_SHOT_SET_POSITION, 0, 1, REFUSAL_NO_AXIS, 0);
	refuses(POKEYS_ONE_SHOT_SET_POSITION, 1, 1 << 25, REFUSAL_POSITION, 0);
}

static void position_of_a_driven_axis_is_not_set(void **state)
{
	(void)state;
	world.command.axis[0].mode = POKEYS_AXIS_POSITION;
	world.command.axis[0].enable = 1;
	world_machine_on(&world);
	world_run(&world, 20 * MS);
	refuses(POKEYS_ONE_SHOT_SET_POSITION, 1, 500, REFUSAL_AXIS_DRIVEN, 0);
	assert_int_equal(act(POKEYS_ONE_SHOT_SET_POSITION, 2, 500), POKEYS_OUTCOME_DONE);
	world_run(&world, 200 * MS);
	assert_int_equal(world.state.engine.axis[0].position, 0);
	assert_int_equal(world.state.engine.axis[1].position, 500);
	/* enabled now, it stays where it is */
	world.command.axis[1].mode = POKEYS_AXIS_POSITION;
	world.command.axis[1].enable = 1;
	world.command.axis[1].position = 500;
	world_run(&world, 200 * MS);
	assert_int_equal(world.rig.device.bench.machine.axis[1].steps, 0);
}

static void everything_is_refused_while_the_link_is_down(void **state)
{
	(void)state;
	sim_rig_silence(&world.rig, world.now, 2 * SECOND);
	world_until(&world, world_is_lost, 1 * SECOND);
	refuses(POKEYS_ONE_SHOT_SET_POSITION, 1, 99, REFUSAL_NOT_RUNNING, 0);
	refuses(POKEYS_ONE_SHOT_REBOOT, 0, 0, REFUSAL_NOT_RUNNING, 0);
	assert_int_equal(act(POKEYS_ONE_SHOT_NOP, 0, 0), POKEYS_OUTCOME_DONE);
	world_run(&world, 3 * SECOND);
	assert_int_equal(positions_set(), 0);
	assert_int_equal(executed(0xF3), 0);
}

static void flash_and_reboot_only_while_motion_is_not_permitted(void **state)
{
	(void)state;
	world_machine_on(&world);
	refuses(POKEYS_ONE_SHOT_SAVE_CONFIG, 0, 0, REFUSAL_MACHINE_ON, 0);
	refuses(POKEYS_ONE_SHOT_REBOOT, 0, 0, REFUSAL_MACHINE_ON, 0);
	world.command.flags = 0;
	world_run(&world, 20 * MS);
	assert_int_equal(act(POKEYS_ONE_SHOT_SAVE_CONFIG, 0, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.rig.device.stats.saves, 1);
	refuses(POKEYS_ONE_SHOT_SAVE_CONFIG, 0, 0, REFUSAL_SAVED_JUST_NOW, 0);
	assert_int_equal(act(POKEYS_ONE_SHOT_REBOOT, 0, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.rig.device.stats.reboots, 1);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_REBOOTED);
	assert_int_equal(world.event_count[EVENT_IDENTIFIED], 2);
}

/* Both in one image: the save was allowed when it was taken. */
static void flash_is_not_written_when_the_machine_was_just_switched_on(void **state)
{
	static const uint8_t operations[] = { POKEYS_ONE_SHOT_SAVE_CONFIG, POKEYS_ONE_SHOT_REBOOT };

	(void)state;
	for (unsigned int i = 0; i < 2; i++) {
		const struct pokeys_one_shot shot = { .operation = operations[i] };
		uint32_t id;

		world.command.flags = 0;
		world_run(&world, 20 * MS);
		world.command.flags = POKEYS_COMMAND_MACHINE_ON;
		id = world_one_shot(&world, &shot);
		world_until(&world, world_is_machine_on, 1 * SECOND);
		world_run(&world, 20 * MS);
		assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_REFUSED);
		assert_true(world_is_machine_on(&world));
	}
	assert_int_equal(world.rig.device.stats.saves, 0);
	assert_int_equal(world.rig.device.stats.reboots, 0);
}

static void deaf_while_saving(struct world *w, const uint8_t *packet)
{
	if (packet[1] == 0x50)
		sim_link_silence(&w->rig.link, SIM_LINK_REPLY, w->now, w->now + 900 * MS);
}

/* Writing flash may keep a device from answering for longer than "lost" allows. */
static void silence_while_flash_is_written_is_no_loss(void **state)
{
	const struct pokeys_one_shot save = { .operation = POKEYS_ONE_SHOT_SAVE_CONFIG };

	(void)state;
	world.watch = deaf_while_saving;
	assert_int_equal(world_do(&world, &save, 4 * SECOND), POKEYS_OUTCOME_UNKNOWN);
	assert_int_equal(world.rig.device.stats.saves, 1);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_int_equal(world.state.statistics.reconnects, 0);
	/* the patience is over with it */
	sim_rig_silence(&world.rig, world.now, 2 * SECOND);
	world_until(&world, world_is_lost, 300 * MS);
}

static void clock_is_set_and_read(void **state)
{
	struct pokeys_one_shot clock = {
		.operation = POKEYS_ONE_SHOT_SET_RTC,
		.value = { 2026, 2, 3, 4, 5, 6, 2, 34 },
	};

	(void)state;
	assert_int_equal(world_do(&world, &clock, 500 * MS), POKEYS_OUTCOME_DONE);
	world_run(&world, 500 * MS);
	assert_int_equal(world.state.rtc.year, 2026);
	assert_int_equal(world.state.rtc.month, 2);
	assert_int_equal(world.state.rtc.day, 3);
	assert_int_equal(world.state.rtc.hour, 4);
	assert_int_equal(world.state.rtc.minute, 5);
	clock.value[1] = 13;
	assert_int_equal(world_do(&world, &clock, 500 * MS), POKEYS_OUTCOME_REFUSED);
}

static void counters_are_reset(void **state)
{
	(void)state;
	world.rig.device.pins.counter[0] = 77;
	assert_int_equal(act(POKEYS_ONE_SHOT_RESET_COUNTERS, 0, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.rig.device.pins.counter[0], 0);
}

/* Request or reply of exactly this packet is lost. */
static struct {
	uint8_t operation, sub;
	bool reply;
} victim;

static void lose(struct world *w, const uint8_t *packet)
{
	const enum sim_link_dir way = victim.reply ? SIM_LINK_REPLY : SIM_LINK_REQUEST;

	if (packet[1] != victim.operation || packet[2] != victim.sub)
		return;
	/* what is on the wire from now until just before the next request's time */
	if (victim.reply)
		sim_link_silence(&w->rig.link, way, w->now + 100 * US, w->now + 400 * US);
	else
		sim_link_silence(&w->rig.link, way, w->now, w->now + 1);
}

static enum pokeys_outcome with_loss(uint8_t operation, uint8_t sub, bool reply,
				     const struct pokeys_one_shot *shot)
{
	enum pokeys_outcome outcome;

	victim.operation = operation;
	victim.sub = sub;
	victim.reply = reply;
	world.watch = lose;
	outcome = world_do(&world, shot, 4 * SECOND);
	world.watch = NULL;
	return outcome;
}

static void lost_one_shot_is_read_back_and_never_repeated(void **state)
{
	const struct pokeys_one_shot position = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { 321 },
	};
	const struct pokeys_one_shot encoder = {
		.operation = POKEYS_ONE_SHOT_SET_ENCODER,
		.index = 5,
		.value = { 9999 },
	};

	(void)state;
	/* the request is lost: it did not happen */
	assert_int_equal(with_loss(0x85, 0x03, false, &position), POKEYS_OUTCOME_FAILED);
	assert_int_equal(positions_set(), 0);
	/* the reply is lost: it did */
	assert_int_equal(with_loss(0x85, 0x03, true, &position), POKEYS_OUTCOME_DONE);
	assert_int_equal(positions_set(), 1);
	assert_int_equal(with_loss(0xCD, 10, false, &encoder), POKEYS_OUTCOME_FAILED);
	assert_int_equal((int32_t)world.rig.device.encoders.raw[5], 0);
	assert_int_equal(with_loss(0xCD, 10, true, &encoder), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.rig.device.encoders.raw[5], 9999);
	world_run(&world, 50 * MS);
	assert_int_equal(world.state.encoder[5], 9999);
}

static void what_cannot_be_read_back_is_unknown(void **state)
{
	const struct pokeys_one_shot reset = { .operation = POKEYS_ONE_SHOT_RESET_COUNTERS };

	(void)state;
	assert_int_equal(with_loss(0x1D, 0, false, &reset), POKEYS_OUTCOME_UNKNOWN);
	assert_int_equal(executed(0x1D), 0);
	assert_int_equal(with_loss(0x1D, 0, true, &reset), POKEYS_OUTCOME_UNKNOWN);
	assert_int_equal(executed(0x1D), 1);
}

static void link_lost_in_the_middle_ends_it(void **state)
{
	const struct pokeys_one_shot save = { .operation = POKEYS_ONE_SHOT_SAVE_CONFIG };
	const uint32_t id = world_one_shot(&world, &save);

	(void)state;
	sim_rig_silence(&world.rig, world.now, 10 * SECOND);
	world_run(&world, 6 * SECOND);
	assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_UNKNOWN);
	assert_int_equal(world.rig.device.stats.saves, 0);
}

/* Every outcome is compared with what the device really did. */
static void outcomes_are_true_under_any_loss(void **state)
{
	const uint64_t seed = world_seed();
	unsigned int done = 0, not_done = 0;
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, seed);
	sim_prng_init(&world.rig.link.way[0].prng, seed + 1);
	sim_prng_init(&world.rig.link.way[1].prng, seed + 2);
	for (unsigned int i = 1; i < 300; i++) {
		const uint64_t before = positions_set();
		enum pokeys_outcome outcome;

		world_loss(&world, (double)sim_prng_below(&prng, 34) / 100);
		outcome = act(POKEYS_ONE_SHOT_SET_POSITION, 1, (int32_t)i);
		world_loss(&world, 0);
		world_run(&world, 600 * MS); /* so that nothing is under way any more */
		assert_in_range(positions_set() - before, 0, 1);
		if (outcome == POKEYS_OUTCOME_DONE)
			assert_int_equal(positions_set() - before, 1);
		if (outcome == POKEYS_OUTCOME_FAILED || outcome == POKEYS_OUTCOME_REFUSED)
			assert_int_equal(positions_set() - before, 0);
		done += outcome == POKEYS_OUTCOME_DONE;
		not_done += outcome == POKEYS_OUTCOME_FAILED;
	}
	assert_true(done > 100 && not_done > 5);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(nop_comes_back_at_once, begin),
		cmocka_unit_test_setup(many_are_taken_in_order, begin),
		cmocka_unit_test_setup(ids_may_wrap, begin),
		cmocka_unit_test_setup(queue_of_before_us_is_not_executed, begin),
		cmocka_unit_test_setup(ring_that_claims_too_much_is_refused_as_a_whole, begin),
		cmocka_unit_test_setup(slot_with_another_id_is_refused, begin),
		cmocka_unit_test_setup(operations_that_do_not_exist_are_refused, begin),
		cmocka_unit_test_setup(position_is_set_while_the_axis_stands, begin),
		cmocka_unit_test_setup(position_of_a_driven_axis_is_not_set, begin),
		cmocka_unit_test_setup(everything_is_refused_while_the_link_is_down, begin),
		cmocka_unit_test_setup(flash_and_reboot_only_while_motion_is_not_permitted, begin),
		cmocka_unit_test_setup(flash_is_not_written_when_the_machine_was_just_switched_on,
				       begin),
		cmocka_unit_test_setup(silence_while_flash_is_written_is_no_loss, begin),
		cmocka_unit_test_setup(clock_is_set_and_read, begin),
		cmocka_unit_test_setup(counters_are_reset, begin),
		cmocka_unit_test_setup(lost_one_shot_is_read_back_and_never_repeated, begin),
		cmocka_unit_test_setup(what_cannot_be_read_back_is_unknown, begin),
		cmocka_unit_test_setup(link_lost_in_the_middle_ends_it, begin),
		cmocka_unit_test_setup(outcomes_are_true_under_any_loss, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
