/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs beside the digital ones: PWM, PoExtBus, external outputs and relays, PoNET with
 * its keyboard. They follow the commander, are off in the safe state, and come back to
 * what is wanted whoever changed them.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/bus_rig.h"
#include "wire/encoder.h"

static void outputs_follow_the_commander(void **state)
{
	(void)state;
	for (unsigned int n = 1; n < 60; n++) {
		command_all(n);
		world_run(&world, 30 * MS);
		all_are(n);
		assert_int_equal(world.state.pwm_duty[1], n);
		assert_int_equal(world.state.poextbus[4], n + 4);
		assert_int_equal(world.state.engine.outputs & 0x0F, n & 0x0F);
	}
	assert_false(world.state.flags & POKEYS_STATE_BAD_COMMAND);
}

static void bits_that_nobody_commands_stay(void **state)
{
	(void)state;
	sim->bus.poext[2] = 0xA0;
	sim->engine.outputs = 0x80;
	sim->engine.relays = 0x40;
	world_run(&world, 500 * MS);
	world.command.poextbus_mask[2] = 0x0F;
	world.command.poextbus[2] = 0xF5;
	world.command.external_outputs_mask = 0x01;
	world.command.external_outputs = 0xFF;
	world_run(&world, 50 * MS);
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->bus.poext[2], 0xA5);
	assert_int_equal(sim->engine.outputs, 0x81);
	assert_int_equal(sim->engine.relays, 0x40);
}

/* Settings that travel with outputs are read again, and replies overtake one another. */
static void a_setting_that_is_read_shows_no_output_of_before(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { .kind = SIM_DELAY_UNIFORM, .high_ns = 2 * MS },
		.reorder = 0.3,
		.reorder_ns = 6 * MS,
	};
	uint32_t duty = 0;
	uint8_t bus = 0;

	(void)state;
	command_all(1);
	world_run(&world, 100 * MS);
	sim_link_set_faults(&world.rig.link, SIM_LINK_REPLY, &faults);
	world.command.pwm_period = 100000;
	for (unsigned int i = 0; i < 24000; i++) {
		/* so seldom that a write has ended before the next one */
		world.command.pwm_duty[1] = 1 + i / 7;
		world.command.poextbus[4] = (uint8_t)(10 + i / 100);
		if (i % 200 == 0)
			(void)device_order(world.device, DEVICE_ORDER_APPLY);
		world_cycle(&world);
		assert_true(world.state.pwm_duty[1] >= duty);
		assert_true(world.state.poextbus[4] >= bus);
		duty = world.state.pwm_duty[1];
		bus = world.state.poextbus[4];
	}
	assert_true(duty > 3400 && bus > 240);
}

static void they_are_off_in_the_safe_state(void **state)
{
	(void)state;
	command_all(7);
	world_run(&world, 100 * MS);
	world.commanding = false;
	world_until(&world, world_is_safe, 300 * MS);
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->config.pwm.enabled, 0);
	assert_int_equal(sim->config.pwm.duty[5], 0);
	assert_int_equal(sim->config.pwm.period, 2500);
	for (unsigned int i = 0; i < POKEYS_POEXTBUS; i++)
		assert_int_equal(sim->bus.poext[i], 0);
	assert_int_equal(sim->engine.outputs, 0);
	assert_int_equal(sim->engine.relays, 0);
	assert_int_equal(sim->bus.modules.out[PLAIN][2], 0);
	for (unsigned int i = 0; i < 48; i++)
		assert_false(sim_module_led(sim, KEYBOARD, i / 4, i % 4));
	/* and back with the commander when it has switched the machine on */
	world.commanding = true;
	world_run(&world, 100 * MS);
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->bus.modules.out[PLAIN][2], 0);
	assert_int_equal(sim->engine.relays, 0);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	all_are(7);
}

/* The daemon before was killed; no commander is there any more. */
static void what_a_killed_daemon_left_on_is_switched_off(void **state)
{
	(void)state;
	command_all(7);
	world_run(&world, 100 * MS);
	world.commanding = false;
	memset(&world.command, 0, sizeof(world.command));
	modules_written = 0;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_until(&world, world_is_safe, 1 * SECOND);
	world_run(&world, 1 * SECOND);
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->config.pwm.enabled, 0);
	assert_int_equal(sim->bus.poext[3], 0);
	assert_int_equal(sim->engine.outputs, 0);
	assert_int_equal(sim->engine.relays, 0);
	for (unsigned int i = 0; i < 48; i++)
		assert_false(sim_module_led(sim, KEYBOARD, i / 4, i % 4));
	assert_int_equal(sim->bus.modules.out[PLAIN][2], 0);
	/* and once is enough */
	world_run(&world, 3 * SECOND);
	assert_int_equal(modules_written, 2);
}

static void spindle(uint32_t duty, uint8_t relay)
{
	world.command.pwm_enable = 2;
	world.command.pwm_duty[1] = duty;
	world.command.poextbus_mask[0] = 0xff;
	world.command.poextbus[0] = relay;
}

/* A setting that waits for the machine to be off is written with what its outputs are then. */
static void a_late_setting_switches_nothing_on_again(void **state)
{
	static struct pokeys_wish wish;

	(void)state;
	memset(&wish, 0, sizeof(wish));
	spindle(1500, 0x10);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	wish.session = 5;
	wish.generation = 1;
	wish.settings.set = POKEYS_SET_PWM_PERIOD | POKEYS_SET_POEXTBUS;
	wish.settings.pwm_period = 3000;
	wish.settings.poextbus_connector = 1;
	device_wish(world.device, &wish);
	world_run(&world, 100 * MS);
	assert_int_equal(sim->config.pwm.duty[1], 1500);
	spindle(0, 0);
	world_run(&world, 50 * MS);
	assert_int_equal(sim->config.pwm.duty[1], 0);
	assert_int_equal(sim->bus.poext[0], 0);
	world.command.flags = 0;
	for (unsigned int i = 0; i < 1000; i++) {
		world_cycle(&world);
		assert_int_equal(sim->config.pwm.duty[1], 0);
		assert_int_equal(sim->bus.poext[0], 0);
	}
	assert_int_equal(sim->config.pwm.period, 3000);
}

/* The device's own failsafe has acted, or somebody else has written. */
static void what_was_changed_from_elsewhere_is_written_again(void **state)
{
	(void)state;
	command_all(9);
	world_run(&world, 100 * MS);
	sim->config.pwm.duty[1] = 0;
	sim->bus.poext[5] = 0;
	sim->engine.outputs = 0;
	world_run(&world, 700 * MS);
	all_are(9);
	sim_rig_reboot(&world.rig, world.now, false);
	world_run(&world, 2 * SECOND);
	world_until(&world, world_is_running, 2 * SECOND);
	world_machine_on(&world);
	world_run(&world, 1 * SECOND);
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->bus.modules.out[PLAIN][2], 9);
	assert_int_equal(sim->bus.poext[5], 14);
}

static void they_arrive_under_loss_duplication_and_reordering(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 3 * MS, 0 },
		.loss = 0.1,
		.duplicate = 0.1,
		.copies = 1,
		.reorder = 0.1,
		.reorder_ns = 2 * MS,
	};
	const uint64_t seed = world_seed();

	(void)state;
	sim_prng_init(&world.rig.link.way[0].prng, seed);
	sim_prng_init(&world.rig.link.way[1].prng, ~seed);
	for (unsigned int n = 1; n < 40; n++) {
		world_faults(&world, &faults);
		for (unsigned int i = 0; i < 20; i++) {
			command_all(n + i);
			world_run(&world, 7 * MS);
		}
		command_all(n);
		world_run(&world, 20 * MS);
		world_loss(&world, 0);
		world_run(&world, 1500 * MS);
		all_are(n);
	}
}

/* All at once: motion, PWM in every cycle, encoders, keyboard. */
static void fast_requests_keep_their_rate_with_everything_enabled(void **state)
{
	uint64_t io;

	(void)state;
	world_encoder(&world, 5, WIRE_ENC_ENABLE | WIRE_ENC_4X, 10, 11);
	world_encoder(&world, 20, WIRE_ENC_ENABLE | WIRE_ENC_4X, 14, 15);
	world.config.encoder_hz = 100;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 500 * MS);
	for (unsigned int i = 0; i < 3; i++)
		world_go(&world, i, 0, 0);
	world_machine_on(&world);
	memset(&world.sent, 0, sizeof(world.sent));
	io = world.state.statistics.cycles_late;
	for (unsigned int n = 0; n < 2000; n++) {
		command_all(n);
		for (unsigned int i = 0; i < 3; i++)
			world_go(&world, i, (int32_t)n, 0);
		world_cycle(&world);
		assert_true(world.state.t_publish_ns - world.state.t_digital_ns < 1 * MS);
		assert_true(world.state.t_publish_ns - world.state.t_motion_ns < 1 * MS);
	}
	assert_int_equal(world.sent.operation[0xCC], 2000);
	assert_int_equal(world.state.statistics.cycles_late, io);
	assert_true(world.sent.pulse[0x25] >= 1900);
	/* it is how the engine's settings are read, too, now and then */
	assert_in_range(world.sent.pulse[0x00], 2000, 2002);
	assert_in_range(world.fresh_high, 4, 4);
	/* those that change all the time do not starve those that poll, nor the other way */
	assert_true(world.sent.operation[0xCB] > 30);
	assert_true(world.sent.operation[0xCD] > 200);
	assert_true(world.state.slow_millihertz[POKEYS_SLOW_ENCODERS_LOW] > 30000);
}

static void standing_outputs_cost_nothing(void **state)
{
	(void)state;
	command_all(3);
	world_run(&world, 1 * SECOND);
	memset(&world.sent, 0, sizeof(world.sent));
	world_run(&world, 1 * SECOND);
	assert_in_range(world.sent.operation[0xCB], 4, 6); /* reads */
	assert_in_range(world.sent.operation[0xDA], 18, 22);
	assert_in_range(world.sent.pulse[0x04], 4, 6);
	assert_int_equal(world.sent.operation[0xCC], 1000);
	assert_in_range(world.sent.pulse[0x00], 1000, 1001);
}

/* The daemon ends: the last word switches everything off. */
static void they_are_off_when_the_daemon_ends(void **state)
{
	(void)state;
	command_all(7);
	world_run(&world, 100 * MS);
	device_stop(world.device, world.now);
	world_until(&world, world_is_stopped, 200 * MS);
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->config.pwm.enabled, 0);
	assert_int_equal(sim->bus.poext[3], 0);
	assert_int_equal(sim->engine.outputs, 0);
	assert_int_equal(sim->bus.modules.out[PLAIN][2], 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(outputs_follow_the_commander, begin),
		cmocka_unit_test_setup(bits_that_nobody_commands_stay, begin),
		cmocka_unit_test_setup(a_setting_that_is_read_shows_no_output_of_before, begin),
		cmocka_unit_test_setup(they_are_off_in_the_safe_state, begin),
		cmocka_unit_test_setup(what_a_killed_daemon_left_on_is_switched_off, begin),
		cmocka_unit_test_setup(a_late_setting_switches_nothing_on_again, begin),
		cmocka_unit_test_setup(what_was_changed_from_elsewhere_is_written_again, begin),
		cmocka_unit_test_setup(they_arrive_under_loss_duplication_and_reordering, begin),
		cmocka_unit_test_setup(fast_requests_keep_their_rate_with_everything_enabled,
				       begin),
		cmocka_unit_test_setup(standing_outputs_cost_nothing, begin),
		cmocka_unit_test_setup(they_are_off_when_the_daemon_ends, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
