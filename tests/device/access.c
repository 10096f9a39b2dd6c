/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device behind a password, and what becomes of outputs and axes when a device
 * is found again that may not run.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"
#include "wire/packet.h"

enum { RELAY = 12, LAMP = 13 };

static struct world world;
static struct sim_device *sim;

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	sim = &world.rig.device;
	world_axes(&world);
	world_pin(&world, RELAY, WIRE_PIN_OUTPUT);
	world_commander(&world, 5);
	return 0;
}

static int begin_locked(void **state)
{
	begin(state);
	sim->options.choices.enforce_security = true;
	memcpy(sim->config.security.password, "open sesame", 11);
	sim->config.security.level = 255;
	sim_device_save(sim);
	sim->run.security_level = 255;
	return 0;
}

static void password(const char *text)
{
	world.config.have_password = true;
	strcpy(world.config.password, text);
	world_start(&world);
}

static void right_password_opens(void **state)
{
	(void)state;
	password("open sesame");
	world_until(&world, world_is_running, 1 * SECOND);
	assert_int_equal(world.state.access, 0);
	assert_int_equal(world.sent.operation[0xE2], 1);
	assert_int_equal(world.event_count[EVENT_LOCKED], 0);
	assert_int_equal(sim->config.pins.function[RELAY], WIRE_PIN_OUTPUT);
	assert_string_equal(world.state.identity.type, "PoKeys57CNC");
	/* each new start of the device wants it again */
	sim_rig_reboot(&world.rig, world.now, false);
	world_run(&world, 1 * SECOND);
	world_until(&world, world_is_running, 3 * SECOND);
	assert_int_equal(world.sent.operation[0xE2], 2);
}

static void right_password_opens_under_any_loss(void **state)
{
	const uint64_t seed = world_seed();

	(void)state;
	for (unsigned int i = 0; i < 10; i++) {
		begin_locked(state);
		sim_prng_init(&world.rig.link.way[0].prng, seed + i);
		sim_prng_init(&world.rig.link.way[1].prng, ~seed - i);
		world_loss(&world, 0.2);
		password("open sesame");
		world_until(&world, world_is_running, 60 * SECOND);
		assert_int_equal(world.state.access, 0);
	}
}

static void without_password_it_does_not_run_and_is_asked_rarely(void **state)
{
	(void)state;
	world_start(&world);
	world_run(&world, 35 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_LOCKED);
	assert_int_equal(world.state.access, 255);
	assert_int_equal(world.event_count[EVENT_LOCKED], 1);
	assert_int_equal(world.last_event[EVENT_LOCKED].a, LOCK_NO_PASSWORD);
	assert_in_range(world.sent.operation[0xE1], 4, 6);
	assert_int_equal(world.sent.operation[0xE2], 0);
	assert_int_equal(world.sent.operation[0xC0], 0);
	assert_int_equal(world.state.t_digital_ns, 0);
	assert_false(world.state.flags & POKEYS_STATE_SAFE);
	/* somebody opens it */
	sim->run.security_level = 0;
	world_until(&world, world_is_running, 12 * SECOND);
}

static void wrong_password_is_tried_rarely(void **state)
{
	(void)state;
	password("sesame open");
	world_run(&world, 35 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	assert_int_equal(world.state.fault, POKEYS_FAULT_LOCKED);
	assert_int_equal(world.event_count[EVENT_LOCKED], 1);
	assert_int_equal(world.last_event[EVENT_LOCKED].a, LOCK_WRONG_PASSWORD);
	assert_in_range(world.sent.operation[0xE2], 3, 5);
}

/* Which answers of an operation come damaged, from which one on (0 the first), in which byte. */
static struct {
	uint8_t operation, at;
	int number, count;
} damaged;

static bool damage(struct world *w, const uint8_t *packet)
{
	uint8_t other[WIRE_PK];

	if (packet[WIRE_AT_OP] != damaged.operation || damaged.number-- > 0 || !damaged.count)
		return false;
	damaged.count--;
	memcpy(other, packet, sizeof(other));
	other[damaged.at] ^= 0x20;
	wire_finish(other, packet[WIRE_AT_ID]);
	device_deliver(w->device, other, sizeof(other), NULL, w->now);
	return true;
}

static void runs_in_spite_of(uint8_t operation, uint8_t at, int number, int count)
{
	damaged.operation = operation;
	damaged.at = at;
	damaged.number = number;
	damaged.count = count;
	world.lose_reply = damage;
	world_start(&world);
	world_until(&world, world_is_running, 1 * SECOND);
	assert_int_equal(damaged.count, 0);
	assert_int_equal(world.state.access, 0);
	assert_int_equal(world.event_count[EVENT_LOCKED], 0);
}

/* The level is at byte 8; a device that is not locked refuses every password. */
static void call_no_device_locked(void **state, int count)
{
	for (int number = 0; number < 2; number++) {
		begin(state);
		runs_in_spite_of(0xE1, 8, number, count);
		begin(state);
		password("open sesame");
		runs_in_spite_of(0xE1, 8, number, count);
		assert_int_equal(world.sent.operation[0xE2], 0);
	}
}

static void one_damaged_answer_does_not_call_a_device_locked(void **state)
{
	call_no_device_locked(state, 1);
}

static void two_that_are_damaged_alike_do_not_either(void **state)
{
	call_no_device_locked(state, 2);
}

/* The level, the seed behind it, and what became of the password. */
static void one_damaged_answer_does_not_make_a_password_wrong(void **state)
{
	for (int number = 0; number < 4; number++) {
		for (uint8_t at = 8; at < 10; at++) {
			begin_locked(state);
			password("open sesame");
			runs_in_spite_of(0xE1, at, number, 1);
		}
	}
	begin_locked(state);
	password("open sesame");
	runs_in_spite_of(0xE2, 8, 0, 1);
}

static bool is_told(struct world *w)
{
	return w->event_count[EVENT_LOCKED] != 0;
}

static void a_locked_device_is_told_after_three_answers_and_two_refusals(void **state)
{
	(void)state;
	world_start(&world);
	world_until(&world, is_told, 1 * SECOND);
	assert_int_equal(world.sent.operation[0xE1], 3);
	begin_locked(state);
	password("sesame open");
	world_until(&world, is_told, 1 * SECOND);
	assert_int_equal(world.sent.operation[0xE2], 2);
}

static void deaf(struct world *w, const uint8_t *p)
{
	w->swallow = p[1] == 0xE1;
}

static void firmware_that_knows_no_password_runs(void **state)
{
	(void)state;
	world.watch = deaf;
	world_start(&world);
	world_until(&world, world_is_running, 3 * SECOND);
	assert_int_equal(world.state.access, 0);
}

/* It runs, the cable is out, it comes back as somebody else has set it up. */
static void comes_back(void (*changed)(void))
{
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_output(&world, RELAY, true);
	world.command.pwm_enable = 2;
	world.command.pwm_period = 2500;
	world.command.pwm_duty[1] = 700;
	world_go(&world, 0, 1000000, 0);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	assert_true(world_latch(&world, RELAY));
	assert_int_equal(sim->config.pwm.enabled, 2);
	sim_rig_silence(&world.rig, world.now, 500 * MS);
	changed();
	world_until(&world, world_is_lost, 1 * SECOND);
	world_run(&world, 2 * SECOND);
}

static void set_up_otherwise_and_locked(void)
{
	sim->config.engine.axes = 2;
	sim->config.identity.locked = 1;
}

static void stands_safe(void)
{
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	assert_true(world.state.flags & POKEYS_STATE_COMMANDER);
	assert_true(world.state.flags & POKEYS_STATE_SAFE);
	assert_false(world_latch(&world, RELAY));
	assert_int_equal(sim->config.pwm.enabled, 0);
	assert_int_equal(sim->engine.state, SIM_PE_STOPPED);
}

static void device_that_is_locked_when_it_is_found_again_is_made_safe(void **state)
{
	(void)state;
	comes_back(set_up_otherwise_and_locked);
	assert_int_equal(world.state.fault, POKEYS_FAULT_LOCKED);
	for (unsigned int i = 0; i < 30; i++) {
		world_run(&world, 100 * MS);
		stands_safe();
	}
	assert_in_range(world.event_count[EVENT_SAFE], 1, 1);
	sim->config.identity.locked = 0;
	world_until(&world, world_is_running, 2 * SECOND);
	world_run(&world, 50 * MS);
	assert_false(world_latch(&world, RELAY));
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	world_machine_on(&world);
	world_run(&world, 50 * MS);
	assert_true(world_latch(&world, RELAY));
	assert_int_equal(sim->config.pwm.enabled, 2);
}

static void refuse_axes(struct world *w, const uint8_t *p)
{
	w->swallow = p[1] == 0x85 && p[2] == 0x01;
}

static void set_up_otherwise_and_stubborn(void)
{
	sim->config.engine.axes = 2;
	world.watch = refuse_axes;
}

static void device_that_refuses_a_setting_when_it_is_found_again_is_made_safe(void **state)
{
	(void)state;
	comes_back(set_up_otherwise_and_stubborn);
	world_run(&world, 3 * SECOND);
	assert_int_equal(world.state.fault, POKEYS_FAULT_CONFIG_REFUSED);
	for (unsigned int i = 0; i < 30; i++) {
		world_run(&world, 100 * MS);
		stands_safe();
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(right_password_opens, begin_locked),
		cmocka_unit_test_setup(right_password_opens_under_any_loss, begin_locked),
		cmocka_unit_test_setup(without_password_it_does_not_run_and_is_asked_rarely,
				       begin_locked),
		cmocka_unit_test_setup(wrong_password_is_tried_rarely, begin_locked),
		cmocka_unit_test(one_damaged_answer_does_not_call_a_device_locked),
		cmocka_unit_test(two_that_are_damaged_alike_do_not_either),
		cmocka_unit_test(one_damaged_answer_does_not_make_a_password_wrong),
		cmocka_unit_test_setup(a_locked_device_is_told_after_three_answers_and_two_refusals,
				       begin_locked),
		cmocka_unit_test_setup(firmware_that_knows_no_password_runs, begin),
		cmocka_unit_test_setup(device_that_is_locked_when_it_is_found_again_is_made_safe,
				       begin),
		cmocka_unit_test_setup(
			device_that_refuses_a_setting_when_it_is_found_again_is_made_safe, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
