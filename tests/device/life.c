/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The life cycle: every order of starting, every way of losing a device and
 * finding it again, without restart of anything.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"

static struct world world;

static void device_is_found_and_runs(void **state)
{
	(void)state;
	world_init(&world, NULL);
	assert_true(world_until(&world, world_is_running, 200 * MS) < 60 * MS);
	assert_int_equal(world.state.identity.serial, 65432);
	assert_int_equal(world.state.identity.hardware, 32);
	assert_int_equal(world.state.identity.firmware_major, 4);
	assert_int_equal(world.state.identity.firmware_minor, 7);
	assert_int_equal(world.state.identity.firmware_revision, 15);
	assert_string_equal(world.state.identity.type, "PoKeys57CNC");
	assert_int_equal(world.state.capability.pins, 55);
	assert_int_equal(world.state.capability.axes, 8);
	assert_int_equal(world.event_count[EVENT_IDENTIFIED], 1);
}

static void device_that_appears_later_is_found_at_once(void **state)
{
	(void)state;
	world_init(&world, NULL);
	sim_rig_silence(&world.rig, world.now, 3 * SECOND);
	world_run(&world, 3 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_SEARCHING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_NO_ANSWER);
	assert_true(world_until(&world, world_is_running, 1 * SECOND) < 300 * MS);
}

static void nothing_is_sent_without_an_address(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world.config.address = 0;
	world.config.serial = 65432;
	world_start(&world);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.sent.all, 0);
	assert_int_equal(world.state.fault, POKEYS_FAULT_NO_ADDRESS);
	assert_true(device_wants_address(world.device));
	device_set_address(world.device, 0x7f000001, 20055, world.now);
	world_until(&world, world_is_running, 200 * MS);
	assert_false(device_wants_address(world.device));
	assert_int_equal(world.state.identity.address, 0x7f000001);
}

static void device_of_somebody_else_is_left_alone(void **state)
{
	(void)state;
	world_init(&world, NULL);
	device_set_address(world.device, 0, 0, world.now);
	device_set_in_use(world.device, true);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.sent.all, 0);
	assert_int_equal(world.state.fault, POKEYS_FAULT_IN_USE);
	assert_int_equal(world.state.fault_count, 1);
	assert_false(device_wants_address(world.device));
	device_set_in_use(world.device, false);
	device_set_address(world.device, world.config.address, 20055, world.now);
	world_until(&world, world_is_running, 200 * MS);
}

static void address_is_wanted_again_when_nobody_answers_there(void **state)
{
	nothing_is_sent_without_an_address(state);
	sim_rig_silence(&world.rig, world.now, 100 * SECOND);
	world_until(&world, world_is_lost, 1 * SECOND);
	assert_false(device_wants_address(world.device));
	world_run(&world, 1100 * MS);
	assert_true(device_wants_address(world.device));
}

static void configured_address_is_never_given_up(void **state)
{
	(void)state;
	world_init(&world, NULL);
	sim_rig_silence(&world.rig, world.now, 100 * SECOND);
	world_run(&world, 5 * SECOND);
	assert_false(device_wants_address(world.device));
}

static void search_is_modest(void **state)
{
	(void)state;
	world_init(&world, NULL);
	sim_rig_silence(&world.rig, world.now, 100 * SECOND);
	world_run(&world, 1 * SECOND);
	world.sent.all = 0;
	world_run(&world, 10 * SECOND);
	assert_in_range(world.sent.all, 50, 400);
}

/* A watch that allows nothing but "who are you". */
static void only_identification(struct world *w, const uint8_t *packet)
{
	(void)w;
	assert_int_equal(packet[1], 0x00);
}

static void foreign_device_is_asked_nothing_else(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world.config.serial = 12345;
	world_start(&world);
	world.watch = only_identification;
	world_commander(&world, 7);
	world_output(&world, 0, true);
	world_run(&world, 20 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_SEARCHING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_WRONG_SERIAL);
	assert_int_equal(world.event_count[EVENT_WRONG_SERIAL], 1);
	assert_int_equal(world.last_event[EVENT_WRONG_SERIAL].a, 65432);
	assert_int_equal(world.last_event[EVENT_WRONG_SERIAL].b, 12345);
	assert_in_range(world.sent.all, 10, 60);
}

static void right_device_in_the_place_of_the_foreign_one_is_taken(void **state)
{
	foreign_device_is_asked_nothing_else(state);
	world.watch = NULL;
	world.rig.device.options.serial = 12345;
	assert_true(world_until(&world, world_is_running, 2 * SECOND) < 700 * MS);
	assert_int_equal(world.state.identity.serial, 12345);
}

static void device_replaced_by_a_foreign_one_is_refused(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world.config.serial = 65432;
	world_start(&world);
	world_until(&world, world_is_running, 1 * SECOND);
	sim_rig_silence(&world.rig, world.now, 300 * MS);
	world.rig.device.options.serial = 777;
	world_until(&world, world_is_lost, 1 * SECOND);
	world.watch = only_identification;
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_SEARCHING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_WRONG_SERIAL);
}

static void unknown_type_is_refused(void **state)
{
	const struct sim_rig_options options = {
		.device.hardware = 45,
		.service_ns = 100 * US,
	};

	(void)state;
	world_init(&world, &options);
	world.watch = only_identification;
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_SEARCHING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_UNSUPPORTED);
}

static void silence_makes_it_lost_and_an_answer_brings_it_back(void **state)
{
	uint64_t took;

	(void)state;
	world_init(&world, NULL);
	world_until(&world, world_is_running, 1 * SECOND);
	sim_rig_silence(&world.rig, world.now, 3 * SECOND);
	took = world_until(&world, world_is_lost, 1 * SECOND);
	assert_in_range(took / MS, 190, 230);
	assert_int_equal(world.state.fault, POKEYS_FAULT_NO_ANSWER);
	world_run(&world, 3 * SECOND - took);
	assert_true(world_until(&world, world_is_running, 1 * SECOND) < 300 * MS);
	assert_int_equal(world.state.statistics.reconnects, 1);
}

static void short_silence_is_no_loss(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_until(&world, world_is_running, 1 * SECOND);
	for (unsigned int i = 0; i < 20; i++) {
		sim_rig_silence(&world.rig, world.now, 100 * MS);
		world_run(&world, 200 * MS);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	}
	assert_int_equal(world.state.statistics.reconnects, 0);
}

static void reboot_is_noticed_and_fresh_soon(void **state)
{
	const struct sim_rig_options options = {
		.device.boot_ms = 1500,
		.service_ns = 100 * US,
	};

	(void)state;
	world_init(&world, &options);
	world_run(&world, 1 * SECOND);
	for (unsigned int i = 0; i < 10; i++) {
		sim_rig_reboot(&world.rig, world.now, i % 2);
		world_run(&world, 1500 * MS);
		assert_int_equal(world.state.link, POKEYS_LINK_LOST);
		assert_true(world_until(&world, world_is_running, 2 * SECOND) < 300 * MS);
	}
	assert_int_equal(world.event_count[EVENT_REBOOTED], 10);
}

static void reboot_within_the_silence_that_is_no_loss_is_noticed(void **state)
{
	const struct sim_rig_options options = {
		.device.boot_ms = 60,
		.service_ns = 100 * US,
	};

	(void)state;
	world_init(&world, &options);
	world_pin(&world, 0, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_run(&world, 2 * SECOND);
	sim_rig_reboot(&world.rig, world.now, true);
	world_run(&world, 400 * MS);
	assert_int_equal(world.event_count[EVENT_REBOOTED], 1);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_REBOOTED);
	/* and its lost configuration was written again */
	assert_int_equal(world.rig.device.config.pins.function[0], 4);
}

/* An address conflict: the other device has been on for longer, so its clock tells nothing. */
static void another_device_in_its_place_is_noticed_while_running(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world.config.serial = 65432;
	world_start(&world);
	world_run(&world, 2 * SECOND);
	world.rig.device.options.serial = 777;
	world_run(&world, 1500 * MS);
	assert_int_equal(world.state.link, POKEYS_LINK_SEARCHING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_WRONG_SERIAL);
}

/* The clock of another start, or of another device, is ahead as easily as behind. */
static void clock_that_jumps_ahead_is_another_one(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_until(&world, world_is_running, 1 * SECOND);
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
	world.rig.device.run.boot_ns -= 3600 * SECOND;
	world_run(&world, 400 * MS);
	assert_int_equal(world.event_count[EVENT_REBOOTED], 1);
	assert_int_equal(world.state.fault, POKEYS_FAULT_REBOOTED);
	/* at any time, under any loss, an honest clock is believed */
	world_loss(&world, 0.33);
	world_run(&world, 60 * SECOND);
	assert_int_equal(world.event_count[EVENT_REBOOTED], 1);
}

/* Until the device has said who it is: nothing that would change it. */
static void only_questions(struct world *w, const uint8_t *p)
{
	if (w->rig.device.options.serial != 777)
		return;
	assert_false(p[1] == 0xCC && p[2] && (~p[20] & 0xFF));
	assert_false(p[1] == 0x85 && p[2] != 0x00 && p[2] != 0x08);
	assert_false(p[1] == 0xCB && p[2]);
	assert_int_not_equal(p[1], 0x50);
	assert_false(p[1] == 0xC0 && p[2]);
}

static void device_swapped_while_a_patient_lost_after_waits_gets_nothing_of_ours(void **state)
{
	static const uint64_t uptimes[] = { 0, 3600 * SECOND };

	(void)state;
	for (unsigned int i = 0; i < 20; i++) {
		world_init(&world, NULL);
		world.config.serial = 65432;
		world.config.lost_after_ns = 60 * SECOND;
		world_pin(&world, 0, WIRE_PIN_OUTPUT);
		world_axes(&world);
		world_start(&world);
		world_commander(&world, 5);
		world_until(&world, world_is_running, 1 * SECOND);
		world_output(&world, 0, true);
		world.command.pwm_enable = 1;
		world_go(&world, 0, 100000, 0);
		world_machine_on(&world);
		world_run(&world, (100 + i) * MS);
		sim_rig_silence(&world.rig, world.now, 20 * MS + i * 100 * US);
		world_run(&world, 19 * MS);
		world.rig.device.options.serial = 777;
		world.rig.device.run.boot_ns -= uptimes[i % 2];
		world.watch = only_questions;
		world.command.pwm_duty[0] = 5;
		world_run(&world, 1 * SECOND);
		assert_int_equal(world.state.link, POKEYS_LINK_SEARCHING);
		assert_int_equal(world.state.fault, POKEYS_FAULT_WRONG_SERIAL);
	}
}

static void outputs_follow_again_soon_after_a_gap(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_pin(&world, 0, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 1 * SECOND);
	for (unsigned int i = 0; i < 20; i++) {
		sim_rig_silence(&world.rig, world.now, 100 * MS);
		world_run(&world, 100 * MS);
		world_output(&world, 0, i & 1);
		world_run(&world, 60 * MS); /* a resend may be due so late */
		assert_int_equal(world_latch(&world, 0), i & 1);
	}
}

static void kernel_that_cannot_send_is_told_apart(void **state)
{
	uint64_t told;

	(void)state;
	world_init(&world, NULL);
	world_until(&world, world_is_running, 1 * SECOND);
	world.unplugged = true;
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_LOST);
	assert_int_equal(world.state.fault, POKEYS_FAULT_NETWORK);
	/* which is told once, and not each ten seconds how many packets it was */
	told = world.event_count[EVENT_PACKETS];
	world_run(&world, 30 * SECOND);
	assert_int_equal(world.event_count[EVENT_PACKETS], told);
	world.unplugged = false;
	world_until(&world, world_is_running, 500 * MS);
}

static void stall_of_the_daemon_makes_no_burst(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_run(&world, 1 * SECOND);
	world_stall(&world, 5 * SECOND);
	world.sent.all = 0;
	world_run(&world, 50 * MS);
	assert_true(world.sent.all <= 3 * 50);
	world_until(&world, world_is_running, 500 * MS);
	world.sent.all = 0;
	world_run(&world, 100 * MS);
	assert_true(world.sent.all <= 3 * 100);
}

static void slow_device_is_never_flooded(void **state)
{
	const struct sim_rig_options options = { .service_ns = 5 * MS };

	(void)state;
	world_init(&world, &options);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	world.rig.stats.high_water = 0;
	world_run(&world, 5 * SECOND);
	/* now and then, with one more 0xCC, it is tried if it has become faster */
	assert_in_range(world.rig.stats.high_water, 1, 6);
	assert_int_equal(world.rig.stats.overflow, 0);
	assert_true(world.state.statistics.cycles_late > 100);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(device_is_found_and_runs),
		cmocka_unit_test(device_that_appears_later_is_found_at_once),
		cmocka_unit_test(nothing_is_sent_without_an_address),
		cmocka_unit_test(device_of_somebody_else_is_left_alone),
		cmocka_unit_test(address_is_wanted_again_when_nobody_answers_there),
		cmocka_unit_test(configured_address_is_never_given_up),
		cmocka_unit_test(search_is_modest),
		cmocka_unit_test(foreign_device_is_asked_nothing_else),
		cmocka_unit_test(right_device_in_the_place_of_the_foreign_one_is_taken),
		cmocka_unit_test(device_replaced_by_a_foreign_one_is_refused),
		cmocka_unit_test(unknown_type_is_refused),
		cmocka_unit_test(silence_makes_it_lost_and_an_answer_brings_it_back),
		cmocka_unit_test(short_silence_is_no_loss),
		cmocka_unit_test(reboot_is_noticed_and_fresh_soon),
		cmocka_unit_test(reboot_within_the_silence_that_is_no_loss_is_noticed),
		cmocka_unit_test(another_device_in_its_place_is_noticed_while_running),
		cmocka_unit_test(clock_that_jumps_ahead_is_another_one),
		cmocka_unit_test(
			device_swapped_while_a_patient_lost_after_waits_gets_nothing_of_ours),
		cmocka_unit_test(outputs_follow_again_soon_after_a_gap),
		cmocka_unit_test(kernel_that_cannot_send_is_told_apart),
		cmocka_unit_test(stall_of_the_daemon_makes_no_burst),
		cmocka_unit_test(slow_device_is_never_flooded),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
