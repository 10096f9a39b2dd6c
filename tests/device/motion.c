/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Motion: axes follow absolute references, whatever the network does; what cannot be is
 * refused and moves nothing. Whether they may move at all: permit.c.
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

static struct world world;

static int begin(void **state)
{
	(void)state;
	world_up(&world, NULL);
	return 0;
}

static int begin_moving(void **state)
{
	(void)state;
	world_moving(&world, NULL);
	return 0;
}

static int begin_old_firmware(void **state)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US,
		.device = { .firmware_major = 0x34, .firmware_revision = 6 },
	};

	(void)state;
	world_moving(&world, &options);
	return 0;
}

static void axis_goes_where_it_is_told(void **state)
{
	(void)state;
	world_go(&world, 0, 3000, 0);
	world_run(&world, 2 * MS);
	assert_int_equal(world.state.engine.axis[0].reference, 3000);
	assert_false(world.state.engine.axis[0].in_position);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 3000);
	assert_int_equal(world.state.engine.axis[0].position, 3000);
	assert_true(world.state.engine.axis[0].in_position);
	/* nobody moves this one */
	assert_true(world.state.engine.axis[1].in_position);
	world_go(&world, 0, -200, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), -200);
}

static void reference_that_changes_each_cycle_is_followed(void **state)
{
	(void)state;
	for (int32_t i = 0; i < 3000; i++) {
		world_go(&world, 0, i * 8, 0);
		world_cycle(&world);
		/* ahead by the way that the axis needs to brake: 8000^2 / 2 / 500000 */
		assert_true(world.state.engine.axis[0].reference >= i * 8 - 8);
		assert_true(world.state.engine.axis[0].reference <= i * 8 + 64);
		if (i > 20)
			assert_true(world.state.engine.axis[0].reference >= i * 8 + 64 - 8);
		if (i > 300)
			assert_in_range(i * 8 - world_pulses(&world, 0), 0, 24);
	}
	world_run(&world, 200 * MS);
	assert_int_equal(world.state.engine.axis[0].reference, 2999 * 8);
	assert_int_equal(world_pulses(&world, 0), 2999 * 8);
	/* and the slow groups had their turn all the same */
	assert_true(world.sent.operation[0xCF] > 10);
	assert_true(world.state.t_publish_ns - world.state.t_slow_ns < 100 * MS);
	assert_true(world.state.t_publish_ns - world.state.t_motion_ns < 1 * MS);
	assert_int_equal(world.fresh_high, 4);
}

static uint64_t reference_sent_ns;

static void note_reference(struct world *w, const uint8_t *packet)
{
	if (packet[1] == 0x85 && packet[2] == 0x25)
		reference_sent_ns = w->now;
}

/* From there it is half a round trip to the device. */
static void new_position_leaves_in_the_cycle_that_reads_it(void **state)
{
	(void)state;
	world.watch = note_reference;
	for (int32_t i = 1; i < 200; i++) {
		const uint64_t cycle = world.tick;

		world_go(&world, 0, i * 7, 0);
		world_cycle(&world);
		assert_int_equal(reference_sent_ns, cycle);
	}
}

static void velocity_is_a_part_of_the_highest_speed(void **state)
{
	(void)state;
	world_go(&world, 0, 100000, -5000); /* a quarter of 20000 pulses/s, whatever its sign */
	world_run(&world, 1 * SECOND);
	assert_true(fabs(world.rig.device.engine.axis[0].planner.speed - 5) < 0.01);
	world_go(&world, 0, 100000, 1e6f);
	world_run(&world, 500 * MS);
	assert_true(fabs(world.rig.device.engine.axis[0].planner.speed - 20) < 0.01);
	world_go(&world, 0, 100000, 1e-6f);
	world_run(&world, 500 * MS);
	assert_true(world.rig.device.engine.axis[0].planner.speed < 0.01);
}

static void old_firmware_is_driven_by_the_old_command(void **state)
{
	(void)state;
	world.sent.pulse[0x25] = 0;
	world_go(&world, 0, 1000, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 1000);
	assert_int_equal(world.sent.pulse[0x25], 0);
	assert_true(world.sent.pulse[0x20] > 0);
	/* axes that we do not drive stay where they are, although 0x20 has no mask */
	assert_int_equal(world_pulses(&world, 1), 0);
}

static void axis_not_driven_holds_its_place_under_the_old_command(void **state)
{
	(void)state;
	world_go(&world, 1, 700, 0);
	world_run(&world, 300 * MS);
	assert_int_equal(world_pulses(&world, 1), 700);
	world.command.axis[1].enable = 0;
	world.command.axis[1].position = 0;
	world_go(&world, 0, 1000, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 1000);
	assert_int_equal(world_pulses(&world, 1), 700);
}

static uint8_t reference[64];

static void keep_reference(struct world *w, const uint8_t *packet)
{
	(void)w;
	if (packet[1] == 0x85 && packet[2] == 0x25)
		memcpy(reference, packet, sizeof(reference));
}

/* The network kept an older reference back and delivers it now. */
static void reference_that_was_overtaken_is_corrected(void **state)
{
	(void)state;
	world.watch = keep_reference;
	world_go(&world, 0, 500, 0);
	world_run(&world, 300 * MS);
	world.watch = NULL;
	world_go(&world, 0, 1500, 0);
	world_run(&world, 300 * MS);
	sim_rig_send_from(&world.rig, world.now, 77, reference, sizeof(reference));
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 1500);
	assert_true(world.rig.device.bench.machine.axis[0].steps > 1500);
}

static void disabled_axis_stops_while_the_others_go_on(void **state)
{
	int64_t held;

	(void)state;
	world_go(&world, 0, 50000, 0);
	world_go(&world, 1, 50000, 0);
	world_run(&world, 200 * MS);
	world.command.axis[1].enable = 0;
	world_run(&world, 300 * MS);
	held = world_pulses(&world, 1);
	assert_in_range(held, 1000, 20000);
	world_run(&world, 8 * SECOND);
	assert_int_equal(world_pulses(&world, 1), held);
	assert_int_equal(world_pulses(&world, 0), 50000);
	assert_int_equal(world.state.engine.axis[1].enabled, 0);
	assert_int_equal(world.state.engine.axis[0].enabled, 1);
	world_go(&world, 1, 50000, 0);
	world_run(&world, 8 * SECOND);
	assert_int_equal(world_pulses(&world, 1), 50000);
}

static void axis_that_is_not_set_up_is_refused(void **state)
{
	(void)state;
	world_go(&world, 4, 1000, 0);
	world_run(&world, 100 * MS);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_AXIS_SETUP);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, 4);
	assert_int_equal(world_pulses(&world, 4), 0);
}

static void mode_the_axis_is_not_set_up_for_is_refused(void **state)
{
	(void)state;
	for (uint8_t mode = POKEYS_AXIS_VELOCITY; mode < 10; mode++) {
		world_go(&world, 0, 1000, 0);
		world.command.axis[0].mode = mode;
		world_run(&world, 50 * MS);
		assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
		assert_int_equal(world_pulses(&world, 0), 0);
	}
}

static void bad_value_leaves_the_last_good_one(void **state)
{
	(void)state;
	world_go(&world, 0, 1000, 0);
	world_run(&world, 2 * MS);
	world_go(&world, 0, 5000, NAN);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 1000);
	world_go(&world, 0, 1 << 25, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 1000);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
}

static void set_position(int32_t to)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { to },
	};

	world.command.axis[0].enable = 0;
	world_run(&world, 100 * MS);
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
}

/* It stands where it was sent: no reference is needed to hold it there. */
static void an_axis_that_is_switched_off_takes_a_position(void **state)
{
	(void)state;
	world_go(&world, 0, 500, 0);
	world_run(&world, 500 * MS);
	set_position(7);
	assert_int_equal(world_pulses(&world, 0), 7);
	world_go(&world, 0, 30, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 30);
	/* an axis that still moves stops first */
	world_go(&world, 0, 5000, 0);
	world_run(&world, 20 * MS);
	set_position(7);
	assert_int_equal(world_pulses(&world, 0), 7);
}

/* A rotary table that always turns the same way: back, or its count is set. */
static void an_axis_at_the_end_of_its_pulses_has_ways_back(void **state)
{
	const int32_t most = 1 << 24;

	(void)state;
	set_position(most - 50);
	world_go(&world, 0, most, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), most);
	world_go(&world, 0, most + 1, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), most);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	world_go(&world, 0, most - 20, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), most - 20);
	assert_false(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	set_position(0);
	world_go(&world, 0, 30, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 30);
}

static void limit_override_reaches_the_device(void **state)
{
	(void)state;
	world.command.flags |= POKEYS_COMMAND_LIMIT_OVERRIDE;
	world_run(&world, 50 * MS);
	assert_int_equal(world.rig.device.engine.override, 1);
	assert_int_equal(world.event_count[EVENT_LIMIT_OVERRIDE], 1);
	assert_int_equal(world.last_event[EVENT_LIMIT_OVERRIDE].a, 1);
	world.command.flags &= ~(uint32_t)POKEYS_COMMAND_LIMIT_OVERRIDE;
	world_run(&world, 50 * MS);
	assert_int_equal(world.rig.device.engine.override, 0);
	assert_int_equal(world.event_count[EVENT_LIMIT_OVERRIDE], 2);
	assert_int_equal(world.last_event[EVENT_LIMIT_OVERRIDE].a, 0);
	world_go(&world, 0, 500, 0);
	world_run(&world, 300 * MS);
	assert_int_equal(world_pulses(&world, 0), 500);
}

/* What the device says of its state, from when the switch is seen until the machine is off. */
static bool lose_status(struct world *w, const uint8_t *packet)
{
	return w->state.engine.axis[0].limit_plus && packet[1] == 0x85 &&
	       (packet[2] == 0x00 || packet[2] == 0x08);
}

/*
 * LinuxCNC sees the switch in the state and stops the machine, before the device does or just
 * afterwards, and this stop ends its state of being tripped.
 */
static void a_stop_by_a_limit_switch_counts_whatever_ends_it(void **state)
{
	const struct sim_switch limit = {
		.wired = true,
		.pin = SIM_DEDICATED,
		.from = 2000,
		.to = INT32_MAX,
	};
	unsigned int unseen = 0;

	(void)state;
	for (unsigned int cycles = 0; cycles < 12; cycles++) {
		world_init(&world, NULL);
		world_axes(&world);
		world.config.settings.axis[0].switches = WIRE_SWITCH_LIMIT_P;
		world.config.settings.axis[0].switches_mask = WIRE_SWITCH_LIMIT_P;
		sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.axis[0].plus,
				 &limit);
		world_all_moving(&world);
		world_run(&world, 50 * MS);
		assert_int_equal(world.state.engine.stops, 0);
		world_go(&world, 0, 9000, 0);
		while (!world.state.engine.axis[0].limit_plus)
			world_cycle(&world);
		unseen += world.state.engine.state == WIRE_ENGINE_RUNNING;
		world.lose_reply = cycles & 1 ? lose_status : NULL;
		world_run(&world, cycles * MS / 4);
		world_machine_off(&world);
		world_run(&world, 20 * MS);
		world.lose_reply = NULL;
		world_run(&world, 100 * MS);
		assert_int_not_equal(world.state.engine.stops, 0);
	}
	printf("%u of 12 were seen before the engine stopped\n", unseen);
}

/* Whatever is lost, late, doubled or overtaken: at the end it stands where it was told. */
static void position_is_exact_at_the_end_whatever_the_network_does(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_HEAVY_TAIL, 30 * US, 10 * MS, 1.3 },
		.reorder = 0.2,
		.reorder_ns = 3 * MS,
		.loss = 0.15,
		.duplicate = 0.2,
		.copies = 3,
	};
	struct sim_prng prng;
	uint64_t seed = world_seed();

	sim_prng_init(&prng, seed);
	for (unsigned int round = 0; round < 20; round++) {
		begin_moving(state);
		sim_prng_init(&world.rig.link.way[0].prng, seed + round);
		sim_prng_init(&world.rig.link.way[1].prng, seed - round);
		world_faults(&world, &faults);
		for (unsigned int i = 0; i < 200; i++) {
			world_go(&world, 0, (int32_t)sim_prng_below(&prng, 4000), 0);
			world_run(&world, sim_prng_below(&prng, 10) * MS);
		}
		world_go(&world, 0, 1234, 0);
		world_run(&world, 1 * SECOND);
		world_loss(&world, 0);
		if (!(world.state.flags & POKEYS_STATE_MACHINE_ON))
			continue; /* lost on the way: then it must not go on by itself */
		world_run(&world, 500 * MS);
		assert_int_equal(world_pulses(&world, 0), 1234);
		assert_true(world.state.engine.axis[0].in_position);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(axis_goes_where_it_is_told, begin_moving),
		cmocka_unit_test_setup(reference_that_changes_each_cycle_is_followed, begin_moving),
		cmocka_unit_test_setup(new_position_leaves_in_the_cycle_that_reads_it,
				       begin_moving),
		cmocka_unit_test_setup(velocity_is_a_part_of_the_highest_speed, begin_moving),
		cmocka_unit_test_setup(old_firmware_is_driven_by_the_old_command,
				       begin_old_firmware),
		cmocka_unit_test_setup(axis_not_driven_holds_its_place_under_the_old_command,
				       begin_old_firmware),
		cmocka_unit_test_setup(reference_that_was_overtaken_is_corrected, begin_moving),
		cmocka_unit_test_setup(disabled_axis_stops_while_the_others_go_on, begin_moving),
		cmocka_unit_test_setup(axis_that_is_not_set_up_is_refused, begin_moving),
		cmocka_unit_test_setup(mode_the_axis_is_not_set_up_for_is_refused, begin),
		cmocka_unit_test_setup(bad_value_leaves_the_last_good_one, begin_moving),
		cmocka_unit_test_setup(an_axis_that_is_switched_off_takes_a_position, begin_moving),
		cmocka_unit_test_setup(an_axis_at_the_end_of_its_pulses_has_ways_back,
				       begin_moving),
		cmocka_unit_test_setup(limit_override_reaches_the_device, begin_moving),
		cmocka_unit_test(a_stop_by_a_limit_switch_counts_whatever_ends_it),
		cmocka_unit_test(position_is_exact_at_the_end_whatever_the_network_does),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
