/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The simulated device of the tests of buses, and what their commander wants of it.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/bus_rig.h"
#include "wire/bus.h"

struct world world;
struct sim_device *sim;
uint64_t searched;
uint64_t modules_written;

void count_bus(struct world *w, const uint8_t *p)
{
	(void)w;
	searched += p[1] == 0xDD && p[2] == 0x10;
	modules_written += p[1] == 0xDD && p[2] == 0x55;
}

void module(unsigned int i, uint8_t type, uint8_t size)
{
	sim->bench.bus.module[i] = (struct sim_module){
		.present = true,
		.type = type,
		.address = (uint8_t)(0x20 + i),
		.size = size,
		.version = 7,
		.light = 99,
	};
}

int begin(void **state)
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

void command_all(unsigned int n)
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

void all_are(unsigned int n)
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
