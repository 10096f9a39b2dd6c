/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A count that begins anew is never shown as if the axis had moved there: not after a
 * restart, however fast the device is back, and not when somebody else sets it.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"

#define FAR 60000
#define FASTEST 50	/* pulses in a millisecond that an axis here can have made */

static struct world world;
static struct sim_device *const sim = &world.rig.device;

static struct pokeys_state shown; /* the last image that a reader believes */

/* No position jumps but together with its epoch. */
static void look(void)
{
	for (unsigned int i = 0; i < 3; i++) {
		const struct pokeys_axis *before = &shown.engine.axis[i];
		const struct pokeys_axis *now = &world.state.engine.axis[i];
		const uint64_t ms = (world.state.t_motion_ns - shown.t_motion_ns) / MS + 1;

		if (before->position_epoch == now->position_epoch)
			assert_in_range(abs(now->position - before->position), 0, FASTEST * ms);
	}
	shown = world.state;
}

static void run(uint64_t for_ns)
{
	const uint64_t end = world.now + for_ns;

	while (world.now < end) {
		world_cycle(&world);
		if (world.state.link == POKEYS_LINK_RUNNING)
			look();
	}
}

static uint8_t epoch(void)
{
	return world.state.engine.axis[0].position_epoch;
}

static void drive_to(int32_t position)
{
	world_go(&world, 0, position, 0);
	while (world_pulses(&world, 0) != position)
		run(50 * MS);
	run(50 * MS);
}

static int begin(void **state)
{
	(void)state;
	world_moving(&world, NULL);
	shown = world.state;
	drive_to(FAR);
	return 0;
}

static void stands_anew(uint8_t before)
{
	run(3 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_int_not_equal(epoch(), before);
	assert_int_equal(epoch() & 1, 0);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 1);
	assert_int_equal(world.state.engine.axis[0].position, world_pulses(&world, 0));
}

static void restart(bool moving)
{
	static const unsigned int boot_ms[] = { 0, 1, 15, 100, 1000 };

	for (size_t i = 0; i < sizeof(boot_ms) / sizeof(boot_ms[0]); i++) {
		uint8_t before;

		begin(NULL);
		before = epoch();
		if (moving) {
			world_go(&world, 0, 2 * FAR, 0);
			run(300 * MS);
		}
		sim->options.boot_ms = boot_ms[i];
		sim_rig_reboot(&world.rig, world.now, false);
		stands_anew(before);
		assert_int_equal(world.last_event[EVENT_POSITION_LOST].b, PLACE_RESTART);
		assert_int_equal(world_pulses(&world, 0), 0);
	}
}

static void after_a_restart_while_it_stands(void **state)
{
	(void)state;
	restart(false);
}

static void after_a_restart_while_it_moves(void **state)
{
	(void)state;
	restart(true);
}

/* In so long a time an axis could have gone all the way, and only the clock tells. */
static void after_a_restart_in_a_silence_that_is_no_loss(void **state)
{
	static const unsigned int boot_ms[] = { 100, 1400, 2500 };

	(void)state;
	for (size_t i = 0; i < sizeof(boot_ms) / sizeof(boot_ms[0]); i++) {
		uint8_t before;

		begin(NULL);
		world.config.lost_after_ns = 4 * SECOND;
		world_start(&world);
		world_commander(&world, 6);
		world_until(&world, world_is_running, 1 * SECOND);
		world_run(&world, 100 * MS);
		world_go(&world, 0, FAR, 0);
		world_machine_on(&world);
		world_run(&world, 300 * MS);
		before = epoch();
		sim->options.boot_ms = boot_ms[i];
		sim_rig_reboot(&world.rig, world.now, false);
		while (epoch() == before) {
			assert_int_equal(world.state.engine.axis[0].position, FAR);
			assert_false(world_is_lost(&world));
			world_cycle(&world);
		}
		assert_int_equal(epoch() & 1, 0);
		assert_int_equal(world.event_count[EVENT_POSITION_LOST], 1);
	}
}

static bool is_done(struct world *w)
{
	return world_outcome(w, w->command.one_shot_head - 1) != POKEYS_OUTCOME_NONE;
}

static void begin_slowly(uint32_t divider)
{
	world_init(&world, NULL);
	world.config.fast_divider = divider;
	world_axes(&world);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 1 * SECOND);
	world_run(&world, 500 * MS);
}

/* Wherever the axis could have gone in it, and whichever try of a status is answered. */
static void after_a_restart_in_any_short_silence(void **state)
{
	static const unsigned int divider[] = { 1, 3, 10 };
	static const int32_t places[] = { 100, 400, 1000 };

	(void)state;
	for (unsigned int i = 0; i < 9; i++) {
		const int32_t place = places[i % 3];

		for (unsigned int boot_ms = 1; boot_ms < 80; boot_ms += WORLD_STRIDE) {
			uint8_t before;

			begin_slowly(divider[i / 3]);
			world_go(&world, 0, place, 0);
			world_machine_on(&world);
			world_run(&world, (300 + boot_ms) * MS);
			before = epoch();
			sim->options.boot_ms = boot_ms;
			sim_rig_reboot(&world.rig, world.now, false);
			while (epoch() == before) {
				/* between two answers it may have gone so far */
				if (boot_ms > 9 * divider[i / 3])
					assert_int_equal(world.state.engine.axis[0].position,
							 place);
				world_cycle(&world);
			}
			assert_true(world.event_count[EVENT_POSITION_LOST] >= 1);
		}
	}
}

/* Each cycle another one: none fits any. */
static void a_client_that_sets_it_all_the_time_is_noticed(void **state)
{
	const uint8_t before = epoch();

	(void)state;
	world_machine_off(&world);
	for (int32_t i = 1; i < 300; i++) {
		world_set_elsewhere(&world, 1, FAR + 5000 * i);
		world_cycle(&world);
	}
	assert_int_not_equal(epoch(), before);
	world_run(&world, 100 * MS);
	assert_int_equal(epoch() & 1, 0);
	assert_int_equal(world.state.engine.axis[0].position, world_pulses(&world, 0));
	assert_true(pokeys_state_age_ns(&world.state, world.now) < 10 * MS);
}

/* A cable that was out says nothing about the count. */
static void a_silence_is_none(void **state)
{
	const uint8_t before = epoch();

	(void)state;
	for (uint64_t ms = 1; ms < 3000; ms *= 3) {
		sim_rig_silence(&world.rig, world.now, ms * MS);
		run(4 * SECOND);
	}
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_int_equal(epoch(), before);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
	assert_int_equal(world.state.engine.axis[0].position, FAR);
}

static const uint64_t asleep_s[] = { 1, 60, 36000 };

/*
 * This computer slept; the device did not, and its axis went on to where it was sent. For how
 * long is known from a clock of whole seconds.
 */
static void a_suspend_is_none(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < 9; i++) {
		const uint64_t slept = asleep_s[i / 3] * SECOND;
		uint8_t before;

		begin(NULL);
		run(60 * SECOND);
		before = epoch();
		world_go(&world, 0, 2 * FAR, 0);
		run(300 * MS);
		world_sleep(&world, slept, slept - SECOND / 2 + i % 3 * SECOND / 2);
		world_run(&world, 3 * SECOND);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
		assert_int_equal(epoch(), before);
		assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
		assert_int_equal(world.state.engine.axis[0].position, world_pulses(&world, 0));
		assert_true(world_pulses(&world, 0) > FAR);
	}
}

/* Also of a device whose clock had only just begun: it could not tell. */
static void a_restart_in_a_suspend_is_one(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < 6; i++) {
		uint8_t before;

		begin(NULL);
		if (i % 2)
			run(60 * SECOND);
		before = epoch();
		sim_rig_reboot(&world.rig, world.now, false);
		world_sleep(&world, asleep_s[i / 2] * SECOND, asleep_s[i / 2] * SECOND);
		world_run(&world, 3 * SECOND);
		assert_int_not_equal(epoch(), before);
		assert_int_equal(epoch() & 1, 0);
		assert_int_equal(world.state.engine.axis[0].position, world_pulses(&world, 0));
	}
}

static void another_client_that_sets_it_is_noticed(void **state)
{
	static const int32_t positions[] = { 0, FAR + 1, FAR - 1000, 2 * FAR };

	(void)state;
	for (size_t i = 0; i < sizeof(positions) / sizeof(positions[0]); i++) {
		uint8_t before;

		begin(NULL);
		world_machine_off(&world);
		run(500 * MS);
		before = epoch();
		world_set_elsewhere(&world, 1, positions[i]);
		stands_anew(before);
		assert_int_equal(world.last_event[EVENT_POSITION_LOST].b, PLACE_SET_ELSEWHERE);
		assert_int_equal(world.state.engine.axis[0].position, positions[i]);
	}
}

/* The machine is switched off before the axis is driven back by what it has not moved. */
static void and_while_it_is_driven(void **state)
{
	const uint8_t before = epoch();

	(void)state;
	world_set_elsewhere(&world, 1, 0);
	run(20 * MS);
	assert_int_not_equal(epoch(), before);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	run(1 * SECOND);
	assert_in_range(world_pulses(&world, 0), 0, 2000);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 1);
}

/* The commander sets the position by a one-shot and knows it from the outcome. */
static void the_commander_that_sets_it_knows(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { -500 },
	};
	uint8_t before;

	(void)state;
	world_machine_off(&world);
	run(500 * MS);
	before = epoch();
	assert_int_equal(world_do(&world, &set, 1 * SECOND), POKEYS_OUTCOME_DONE);
	run(5 * MS);
	assert_int_not_equal(epoch(), before);
	assert_int_equal(epoch() & 1, 1);
	assert_int_equal(world.state.engine.axis[0].position, -500);
	run(1 * SECOND);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
}

static bool is_set_position(struct world *w, const uint8_t *reply)
{
	if (reply[1] != 0x85 || reply[2] != 0x03)
		return false;
	w->lose_reply = NULL;
	return true;
}

/* Statuses show the new count before it is known whether that is the wanted one. */
static void and_when_its_answer_is_lost(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { -500 },
	};

	(void)state;
	world_machine_off(&world);
	run(500 * MS);
	world.lose_reply = is_set_position;
	world_one_shot(&world, &set);
	run(1 * SECOND);
	assert_null(world.lose_reply);
	assert_int_equal(epoch(), 1);
	assert_int_equal(world.state.engine.axis[0].position, -500);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
}

/* Who reads the outcome reads the position in the same image, however seldom statuses come. */
static void the_outcome_comes_with_the_position(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { -500 },
	};

	(void)state;
	begin_slowly(10);
	world_one_shot(&world, &set);
	world_until(&world, is_done, 1 * SECOND);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.axis[0].position, -500);
	assert_int_equal(epoch(), 1);
	world_run(&world, 1 * SECOND);
	assert_int_equal(epoch(), 1);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
}

static bool set_was_answered;

static bool sees_set_position(struct world *w, const uint8_t *reply)
{
	(void)w;
	set_was_answered = set_was_answered || (reply[1] == 0x85 && reply[2] == 0x03);
	return false;
}

/* Its 0 is not what was set. */
static void a_restart_after_it_is_a_loss(void **state)
{
	static const unsigned int boot_ms[] = { 0, 15, 100 };
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { -500 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(boot_ms) / sizeof(boot_ms[0]); i++) {
		begin_slowly(10);
		set_was_answered = false;
		world.lose_reply = sees_set_position;
		world_one_shot(&world, &set);
		while (!set_was_answered)
			world_cycle(&world);
		sim->options.boot_ms = boot_ms[i];
		sim_rig_reboot(&world.rig, world.now, false);
		for (unsigned int ms = 0; ms < 3000; ms++) {
			world_cycle(&world);
			assert_int_equal(epoch() & 1, 0);
			assert_in_range(world.state.engine.axis[0].position, 0, 0);
		}
		assert_int_not_equal(epoch(), 0);
		assert_int_not_equal(world_outcome(&world, 0), POKEYS_OUTCOME_DONE);
	}
}

/* The machine has just been switched on, so the setting waits until that is done. */
static void another_client_that_sets_it_meanwhile_is_noticed(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 2,
		.value = { 0, 700 },
	};

	(void)state;
	for (unsigned int cycles = 0; cycles < 12; cycles++) {
		begin(NULL);
		world_machine_off(&world);
		world.command.axis[1].enable = 0;
		run(500 * MS);
		world.command.flags |= POKEYS_COMMAND_MACHINE_ON;
		for (unsigned int i = 0; i < cycles; i++)
			world_cycle(&world);
		world_one_shot(&world, &set);
		world_cycle(&world);
		shown = world.state;
		world_set_elsewhere(&world, 2, 70000);
		run(2 * SECOND);
		assert_int_equal(world.state.engine.axis[1].position, world_pulses(&world, 1));
		assert_true(is_done(&world));
		assert_true(pokeys_state_age_ns(&world.state, world.now) < 10 * MS);
		assert_int_not_equal(world.state.engine.axis[1].position_epoch, 0);
	}
}

static uint8_t kept[64];

static bool keep_status(struct world *w, const uint8_t *reply)
{
	(void)w;
	if (reply[1] != 0x85 || reply[2] != 0x00)
		return false;
	if (!kept[0])
		memcpy(kept, reply, sizeof(kept));
	return reply[6] == kept[6];
}

/* The network keeps it for longer than the setting takes. */
static void a_status_of_before_it_is_none_of_after_it(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { -500 },
	};

	(void)state;
	begin_slowly(1);
	memset(kept, 0, sizeof(kept));
	world.lose_reply = keep_status;
	world_one_shot(&world, &set);
	world_until(&world, is_done, 1 * SECOND);
	assert_int_equal(epoch(), 1);
	world.lose_reply = NULL;
	world_deliver(&world, kept, sizeof(kept));
	for (unsigned int i = 0; i < 100; i++) {
		world_cycle(&world);
		assert_int_equal(world.state.engine.axis[0].position, -500);
	}
	assert_int_equal(epoch(), 1);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
}

/* Statuses are so seldom that none comes between the two. */
static void two_that_it_sets_are_known_both(void **state)
{
	struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { -500, 700 },
	};

	(void)state;
	world_init(&world, NULL);
	world.config.fast_divider = 20;
	world_axes(&world);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 1 * SECOND);
	world_run(&world, 500 * MS);
	assert_int_equal(world_do(&world, &set, 1 * SECOND), POKEYS_OUTCOME_DONE);
	set.mask = 2;
	assert_int_equal(world_do(&world, &set, 1 * SECOND), POKEYS_OUTCOME_DONE);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
	assert_int_equal(world.state.engine.axis[0].position, -500);
	assert_int_equal(world.state.engine.axis[1].position, 700);
	assert_int_equal(world.state.engine.axis[0].position_epoch & 1, 1);
	assert_int_equal(world.state.engine.axis[1].position_epoch & 1, 1);
}

static void a_damaged_status_is_no_position(void **state)
{
	const struct sim_link_faults faults = { .corrupt = 0.2 };
	const uint8_t before = epoch();

	(void)state;
	sim_link_set_faults(&world.rig.link, SIM_LINK_REPLY, &faults);
	for (unsigned int i = 0; i < 20; i++) {
		world_go(&world, 0, i % 2 ? FAR : FAR - 2000, 0);
		run(1 * SECOND);
	}
	assert_true(world.state.statistics.corrupt > 1000);
	assert_int_equal(epoch(), before);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
}

static void another_device_counts_otherwise(void **state)
{
	const uint8_t before = epoch();

	(void)state;
	sim_rig_silence(&world.rig, world.now, 500 * MS);
	world_until(&world, world_is_lost, 1 * SECOND);
	sim->options.serial = 777;
	stands_anew(before);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(after_a_restart_while_it_stands),
		cmocka_unit_test(after_a_restart_while_it_moves),
		cmocka_unit_test(after_a_restart_in_a_silence_that_is_no_loss),
		cmocka_unit_test(after_a_restart_in_any_short_silence),
		cmocka_unit_test_setup(a_client_that_sets_it_all_the_time_is_noticed, begin),
		cmocka_unit_test_setup(a_silence_is_none, begin),
		cmocka_unit_test(a_suspend_is_none),
		cmocka_unit_test(a_restart_in_a_suspend_is_one),
		cmocka_unit_test(another_client_that_sets_it_is_noticed),
		cmocka_unit_test_setup(and_while_it_is_driven, begin),
		cmocka_unit_test_setup(the_commander_that_sets_it_knows, begin),
		cmocka_unit_test_setup(and_when_its_answer_is_lost, begin),
		cmocka_unit_test(the_outcome_comes_with_the_position),
		cmocka_unit_test(a_restart_after_it_is_a_loss),
		cmocka_unit_test(another_client_that_sets_it_meanwhile_is_noticed),
		cmocka_unit_test(a_status_of_before_it_is_none_of_after_it),
		cmocka_unit_test(two_that_it_sets_are_known_both),
		cmocka_unit_test_setup(a_damaged_status_is_no_position, begin),
		cmocka_unit_test_setup(another_device_counts_otherwise, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
