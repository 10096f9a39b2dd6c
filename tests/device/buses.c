/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs beside the digital ones: PWM, PoExtBus, external outputs and relays,
 * PoNET with its keyboard. They follow the commander, are off in the safe state,
 * and come back to what is wanted whoever changed them. And the inputs of PoNET,
 * the dedicated inputs, the upper matrix rows and the rates.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/bus.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/system.h"

enum { KEYBOARD = 3, PLAIN = 9 };

static struct world world;
static struct sim_device *sim;
static uint64_t searched;	/* settings of modules asked for */
static uint64_t modules_written;	/* data of a module sent */

static void count_bus(struct world *w, const uint8_t *p)
{
	(void)w;
	searched += p[1] == 0xDD && p[2] == 0x10;
	modules_written += p[1] == 0xDD && p[2] == 0x55;
}

static void module(unsigned int i, uint8_t type, uint8_t size)
{
	sim->bench.bus.module[i] = (struct sim_module){
		.present = true, .type = type, .address = (uint8_t)(0x20 + i), .size = size,
		.version = 7, .light = 99,
	};
}

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	sim = &world.rig.device;
	sim->config.pwm.period = 2500;
	memset(sim->bench.bus.module, 0, sizeof(sim->bench.bus.module));
	module(KEYBOARD, WIRE_PONET_KBD48, 6);
	module(PLAIN, 0x22, 4);
	world_axes(&world);
	world.watch = count_bus;
	world_commander(&world, 5);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 1 * SECOND);
	return 0;
}

static void command_all(unsigned int n)
{
	struct pokeys_command *command = &world.command;

	command->pwm_enable = 0x22;
	command->pwm_duty[1] = n % 2500;
	command->pwm_duty[5] = 2500 - n % 2500;
	memset(command->poextbus_mask, 0xff, POKEYS_POEXTBUS);
	for (unsigned int i = 0; i < POKEYS_POEXTBUS; i++)
		command->poextbus[i] = (uint8_t)(n + i);
	command->external_outputs_mask = command->relays_mask = 0x0F;
	command->external_outputs = n & 0x0F;
	command->relays = (uint8_t)(~n & 0x0F);
	command->ponet_mask = 1u << PLAIN;
	command->ponet_data[PLAIN][2] = (uint8_t)n;
	command->ponet_brightness[PLAIN] = (uint8_t)(n * 3);
	command->kbd48_flags = POKEYS_KBD48_LEDS | POKEYS_KBD48_BRIGHTNESS;
	command->kbd48_leds = UINT64_C(1) << n % 48;
	command->kbd48_brightness = (uint8_t)(255 - n);
}

static void all_are(unsigned int n)
{
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->config.pwm.enabled, 0x22);
	assert_int_equal(sim->config.pwm.duty[1], n % 2500);
	assert_int_equal(sim->config.pwm.duty[5], 2500 - n % 2500);
	assert_int_equal(sim->config.pwm.period, 2500);
	for (unsigned int i = 0; i < POKEYS_POEXTBUS; i++)
		assert_int_equal(sim->bus.poext[i], (uint8_t)(n + i));
	assert_int_equal(sim->engine.outputs & 0x0F, n & 0x0F);
	assert_int_equal(sim->engine.relays & 0x0F, ~n & 0x0F);
	assert_int_equal(sim->bus.modules.out[PLAIN][2], (uint8_t)n);
	assert_int_equal(sim->bus.modules.pwm[PLAIN], (uint8_t)(n * 3));
	assert_int_equal(sim->bus.modules.pwm[KEYBOARD], (uint8_t)(255 - n));
	for (unsigned int i = 0; i < 48; i++)
		assert_int_equal(sim_module_led(sim, KEYBOARD, i / 4, i % 4), i == n % 48);
}

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
	/* and back with the commander */
	world.commanding = true;
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
	world_run(&world, 1 * SECOND);
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->bus.modules.out[PLAIN][2], 9);
	assert_int_equal(sim->bus.poext[5], 14);
}

static void they_arrive_under_loss_duplication_and_reordering(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 3 * MS, 0 }, .loss = 0.1, .duplicate = 0.1,
		.copies = 1, .reorder = 0.1, .reorder_ns = 2 * MS,
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
	assert_int_equal(world.sent.pulse[0x00], 2000);
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
	assert_in_range(world.sent.operation[0xCB], 4, 6);	/* reads */
	assert_in_range(world.sent.operation[0xDA], 18, 22);
	assert_in_range(world.sent.pulse[0x04], 4, 6);
	assert_int_equal(world.sent.operation[0xCC], 1000);
	assert_in_range(world.sent.pulse[0x00], 1000, 1001);
}

static void modules_are_found(void **state)
{
	const struct pokeys_ponet_module *modules = world.state.ponet;

	(void)state;
	assert_int_equal(world.state.ponet_state, WIRE_PONET_READY);
	assert_int_equal(world.state.ponet_count, 2);
	assert_int_equal(world.state.kbd48_module, KEYBOARD);
	assert_int_equal(modules[PLAIN].type, 0x22);
	assert_int_equal(modules[PLAIN].address, 0x29);
	assert_int_equal(modules[PLAIN].size, 4);
	assert_int_equal(modules[PLAIN].version, 7);
	assert_int_equal(modules[0].type, 0);
	assert_int_equal(modules[KEYBOARD].light, 99);
}

static void keys_and_module_inputs_are_read(void **state)
{
	(void)state;
	for (unsigned int key = 0; key < 48; key++) {
		sim_module_key(&sim->bench.bus.module[KEYBOARD], key / 4, key % 4, true);
		sim->bench.bus.module[PLAIN].in[3] = (uint8_t)key;
		world_run(&world, 150 * MS);
		assert_true(world.state.kbd48_keys == UINT64_C(1) << key);
		assert_int_equal(world.state.ponet[PLAIN].data[3], key);
		sim_module_key(&sim->bench.bus.module[KEYBOARD], key / 4, key % 4, false);
	}
	assert_int_equal(world.state.ponet[PLAIN].failures, 0);
}

/* I1: never a key that was not pressed at some time. */
static void keys_are_true_under_loss_duplication_and_reordering(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 2 * MS, 0 }, .loss = 0.1, .duplicate = 0.1,
		.copies = 1, .reorder = 0.1, .reorder_ns = 2 * MS,
	};
	const uint64_t seed = world_seed();
	uint64_t pressed = 0, before = 0;

	(void)state;
	memset(&sim->bench.bus.module[PLAIN], 0, sizeof(sim->bench.bus.module[PLAIN]));
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 500 * MS);
	sim_prng_init(&world.rig.link.way[0].prng, seed);
	sim_prng_init(&world.rig.link.way[1].prng, ~seed);
	world_faults(&world, &faults);
	for (unsigned int i = 0; i < 200; i++) {
		const unsigned int key = (unsigned int)(i * 29 % 48);

		before = pressed;
		pressed = UINT64_C(1) << key;
		for (unsigned int k = 0; k < 48; k++)
			sim_module_key(&sim->bench.bus.module[KEYBOARD], k / 4, k % 4, k == key);
		for (unsigned int ms = 0; ms < 400; ms++) {
			world_cycle(&world);
			assert_true(world.state.kbd48_keys == pressed ||
				    world.state.kbd48_keys == before);
		}
		assert_true(world.state.kbd48_keys == pressed);
	}
}

/* Two modules: a start that was repeated must not give one the other's data. */
static void repeated_start_does_not_mix_modules_up(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_HEAVY_TAIL, 25 * US, 60 * MS, 1.2 }, .loss = 0.05,
	};
	const uint64_t seed = world_seed();

	(void)state;
	sim_prng_init(&world.rig.link.way[0].prng, seed);
	sim_prng_init(&world.rig.link.way[1].prng, ~seed);
	memset(sim->bench.bus.module[PLAIN].in, 0xff, sizeof(sim->bench.bus.module[PLAIN].in));
	world_run(&world, 500 * MS);
	world_faults(&world, &faults);
	for (unsigned int i = 0; i < 60000; i++) {
		world_cycle(&world);
		assert_int_equal(world.state.kbd48_keys, 0);
	}
}

static unsigned int keyboard_starts;

/*
 * Somebody else reads the other module through the same device: his start comes
 * between our own one and the fetch, at one reading of the keyboard in three.
 */
static void start_from_elsewhere(struct world *w, const uint8_t *p)
{
	uint8_t request[WIRE_PK] = { WIRE_REQUEST, 0xDD, 0x50, 0x10, PLAIN };
	uint8_t reply[WIRE_PK];

	if (p[1] != 0xDD || p[2] != 0x50)
		return;
	keyboard_starts += p[3] == 0x10 && p[4] == KEYBOARD;
	if (p[3] != 0x30 || p[4] != KEYBOARD || keyboard_starts % 3)
		return;
	keyboard_starts++;
	wire_finish(request, 1);
	sim_rig_run(&w->rig, w->now);
	assert_int_equal(sim_device_request(sim, w->now, request, sizeof(request), reply),
			 sizeof(reply));
}

static void another_client_on_the_bus_presses_no_key(void **state)
{
	(void)state;
	keyboard_starts = 0;
	memset(sim->bench.bus.module[PLAIN].in, 0xff, sizeof(sim->bench.bus.module[PLAIN].in));
	world.watch = start_from_elsewhere;
	for (unsigned int i = 0; i < 10000; i++) {
		world_cycle(&world);
		assert_int_equal(world.state.kbd48_keys, 0);
	}
	assert_true(keyboard_starts > 100);
	world.watch = count_bus;
	sim_module_key(&sim->bench.bus.module[KEYBOARD], 3, 2, true);
	world_run(&world, 150 * MS);
	assert_true(world.state.kbd48_keys == UINT64_C(1) << 14);
}

static void module_that_falls_silent_is_seen(void **state)
{
	(void)state;
	sim->bench.bus.module[PLAIN].present = false;
	world_run(&world, 1 * SECOND);
	assert_true(world.state.ponet[PLAIN].failures > 3);
	assert_int_equal(world.state.ponet[KEYBOARD].failures, 0);
	sim->bench.bus.module[PLAIN].present = true;
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.ponet[PLAIN].failures, 0);
}

/* A jog key would go on for ever. */
static void key_that_cannot_be_read_any_more_is_up(void **state)
{
	(void)state;
	sim_module_key(&sim->bench.bus.module[KEYBOARD], 3, 2, true);
	world_run(&world, 300 * MS);
	assert_true(world.state.kbd48_keys == UINT64_C(1) << 14);
	sim->bench.bus.module[KEYBOARD].present = false;
	world_run(&world, 1 * SECOND);
	assert_true(world.state.kbd48_keys == 0);
	sim->bench.bus.module[KEYBOARD].present = true;
	world_run(&world, 1 * SECOND);
	assert_true(world.state.kbd48_keys == UINT64_C(1) << 14);
}

static void module_that_comes_later_is_found_when_the_bus_was_empty_or_is_ready_again(void **state)
{
	(void)state;
	memset(sim->bench.bus.module, 0, sizeof(sim->bench.bus.module));
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.state.ponet_count, 0);
	assert_int_equal(world.state.kbd48_module, 255);
	module(KEYBOARD, WIRE_PONET_KBD48, 6);
	world_run(&world, 4 * SECOND);
	assert_int_equal(world.state.kbd48_module, KEYBOARD);
	module(PLAIN, 0x22, 4);
	sim->bus.modules.state = 2;
	world_run(&world, 2 * SECOND);
	sim->bus.modules.state = WIRE_PONET_READY;
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.state.ponet_count, 2);
}

/* What the bus says of itself while it reads or writes is no reason to look for modules. */
static void bus_at_work_is_not_searched_anew(void **state)
{
	static const uint8_t states[] = { 10, 50, 55, 60, 70, 71, 80 };
	uint64_t before;

	(void)state;
	world_run(&world, 2 * SECOND);
	before = searched;
	for (unsigned int i = 0; i < 70; i++) {
		sim->bus.modules.state = states[i % sizeof(states)];
		world_run(&world, 100 * MS);
	}
	assert_int_equal(searched, before);
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

static void dedicated_inputs_upper_rows_and_new_counters_are_read(void **state)
{
	struct pokeys_settings wanted = world.config.settings;

	(void)state;
	sim->bench.machine.raw_minus = 0x05;
	sim->bench.machine.raw_plus = 0x02;
	sim->bench.machine.raw_home = 0x81;
	sim->bench.keys[2] = 0x11;
	sim->bench.keys[9] = 0x5A;
	wanted.set |= POKEYS_SET_MATRIX;
	wanted.matrix_enable = 1;
	wanted.matrix_rows = 10;
	wanted.matrix_columns = 8;
	wanted.pin_set[0] |= 1 << 5;
	wanted.pin_function[5] = WIRE_PIN_COUNTER;
	sim->pins.counter[5] = 4711;
	device_wanted(world.device, &wanted);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(world.state.engine.dedicated_limit_minus, 0x05);
	assert_int_equal(world.state.engine.dedicated_limit_plus, 0x02);
	assert_int_equal(world.state.engine.dedicated_home, 0x81);
	assert_int_equal(world.state.matrix[9], 0x5A);
	assert_int_equal(world.state.matrix[2], 0x11);
	assert_int_equal(world.state.counter[5], 4711);
}

static void emergency_input_is_shown_while_the_engine_stands(void **state)
{
	(void)state;
	for (unsigned int way = 0; way < 4; way++) {
		struct pokeys_settings wanted = world.config.settings;

		wanted.set |= POKEYS_SET_EMERGENCY_PIN | POKEYS_SET_EMERGENCY_INVERT;
		wanted.emergency_pin = 62;
		wanted.emergency_invert = way & 1;
		wanted.pin_set[51 / 8] |= 1 << 51 % 8;
		wanted.pin_function[51] = (uint8_t)(WIRE_PIN_INPUT |
						    (way & 2 ? WIRE_PIN_INVERT : 0));
		device_wanted(world.device, &wanted);
		sim_bench_emergency(sim, way & 1);
		world_run(&world, 200 * MS);
		assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
		assert_int_equal(world.state.engine.emergency, 0);
		sim_bench_emergency(sim, !(way & 1));
		world_run(&world, 20 * MS);
		assert_int_equal(world.state.engine.state, SIM_PE_STOPPED);
		assert_int_equal(world.state.engine.emergency, 1);
	}
}

static void rates_are_measured(void **state)
{
	(void)state;
	world_run(&world, 3 * SECOND);
	assert_in_range(world.state.slow_millihertz[POKEYS_SLOW_TICK], 4500, 5500);
	assert_in_range(world.state.slow_millihertz[POKEYS_SLOW_POEXTBUS], 18000, 21000);
	assert_in_range(world.state.slow_millihertz[POKEYS_SLOW_DEDICATED], 45000, 52000);
	assert_in_range(world.state.slow_millihertz[POKEYS_SLOW_PONET], 80000, 105000);
	assert_int_equal(world.state.slow_millihertz[POKEYS_SLOW_MATRIX], 0);
	sim_rig_silence(&world.rig, world.now, 2 * SECOND);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.slow_millihertz[POKEYS_SLOW_TICK], 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(outputs_follow_the_commander, begin),
		cmocka_unit_test_setup(bits_that_nobody_commands_stay, begin),
		cmocka_unit_test_setup(they_are_off_in_the_safe_state, begin),
		cmocka_unit_test_setup(a_late_setting_switches_nothing_on_again, begin),
		cmocka_unit_test_setup(what_a_killed_daemon_left_on_is_switched_off, begin),
		cmocka_unit_test_setup(what_was_changed_from_elsewhere_is_written_again, begin),
		cmocka_unit_test_setup(they_arrive_under_loss_duplication_and_reordering, begin),
		cmocka_unit_test_setup(fast_requests_keep_their_rate_with_everything_enabled,
				       begin),
		cmocka_unit_test_setup(standing_outputs_cost_nothing, begin),
		cmocka_unit_test_setup(modules_are_found, begin),
		cmocka_unit_test_setup(keys_and_module_inputs_are_read, begin),
		cmocka_unit_test_setup(keys_are_true_under_loss_duplication_and_reordering, begin),
		cmocka_unit_test_setup(repeated_start_does_not_mix_modules_up, begin),
		cmocka_unit_test_setup(another_client_on_the_bus_presses_no_key, begin),
		cmocka_unit_test_setup(module_that_falls_silent_is_seen, begin),
		cmocka_unit_test_setup(key_that_cannot_be_read_any_more_is_up, begin),
		cmocka_unit_test_setup(
			module_that_comes_later_is_found_when_the_bus_was_empty_or_is_ready_again,
			begin),
		cmocka_unit_test_setup(bus_at_work_is_not_searched_anew, begin),
		cmocka_unit_test_setup(they_are_off_when_the_daemon_ends, begin),
		cmocka_unit_test_setup(dedicated_inputs_upper_rows_and_new_counters_are_read,
				       begin),
		cmocka_unit_test_setup(emergency_input_is_shown_while_the_engine_stands, begin),
		cmocka_unit_test_setup(rates_are_measured, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
