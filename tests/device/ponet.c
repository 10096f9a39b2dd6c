/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoNET: its modules are found, and read without ever showing a key that was not pressed.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/bus_rig.h"
#include "wire/bus.h"

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
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 2 * MS, 0 },
		.loss = 0.1,
		.duplicate = 0.1,
		.copies = 1,
		.reorder = 0.1,
		.reorder_ns = 2 * MS,
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
		.delay = { SIM_DELAY_HEAVY_TAIL, 25 * US, 60 * MS, 1.2 },
		.loss = 0.05,
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

int main(void)
{
	const struct CMUnitTest tests[] = {
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
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
