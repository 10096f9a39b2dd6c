/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A million cycles of everything at once: faults come and go, the device
 * reboots, commanders die and return, axes and encoders move, one-shots are
 * queued. Every invariant is checked in every tick; at the end all is exact.
 */

#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"
#include "wire/encoder.h"

enum { RELAY = 0, ENCODER = 5, CYCLES = 1000000 };

static struct world world;
static struct sim_prng prng;
static uint64_t runs_seen, reboots_asked;
static struct pokeys_wish wish;

static uint64_t below(uint64_t bound)
{
	return sim_prng_below(&prng, bound);
}

static void count_runs(struct world *w, const uint8_t *packet)
{
	(void)w;
	runs_seen += packet[1] == 0x85 && packet[2] == 0x02 && packet[3] == 3;
}

static void new_faults(void)
{
	struct sim_link_faults faults = {
		.delay = { SIM_DELAY_HEAVY_TAIL, 25 * US, below(20) * MS + 100 * US, 1.5 },
		.loss = below(3) ? 0 : (double)below(30) / 100,
		.duplicate = below(3) ? 0 : 0.2,
		.copies = 1 + (unsigned int)below(5),
		.reorder = below(3) ? 0 : 0.1,
		.reorder_ns = below(5) * MS,
		.wrong_id = below(5) ? 0 : 0.05,
		.wrong_op = below(5) ? 0 : 0.05,
		.truncate = below(5) ? 0 : 0.05,
	};

	sim_link_set_faults(&world.rig.link, SIM_LINK_REPLY, &faults);
	/* a request that became another one would really be executed */
	faults.wrong_op = 0;
	sim_link_set_faults(&world.rig.link, SIM_LINK_REQUEST, &faults);
}

static void new_wishes(void)
{
	world_output(&world, RELAY, below(2));
	for (unsigned int i = 0; i < 3; i++) {
		world.command.axis[i] = (struct pokeys_axis_command){
			.position = (int32_t)below(3000),
			.velocity = (float)below(20000),
			.mode = POKEYS_AXIS_POSITION,
			.enable = below(4) != 0,
		};
	}
}

/* Outputs of every kind, and settings; what is wanted last has to be there in the end. */
static void new_outputs(void)
{
	world.command.pwm_enable = (uint32_t)below(64);
	world.command.pwm_period = 2500;
	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		world.command.pwm_duty[i] = (uint32_t)below(2501);
	for (unsigned int i = 0; i < POKEYS_POEXTBUS; i++) {
		world.command.poextbus_mask[i] = 0xff;
		world.command.poextbus[i] = (uint8_t)below(256);
	}
	world.command.relays_mask = world.command.external_outputs_mask = 0xff;
	world.command.relays = (uint8_t)below(256);
	world.command.external_outputs = (uint8_t)below(256);
	world.command.kbd48_flags = POKEYS_KBD48_LEDS;
	world.command.kbd48_leds = UINT64_C(1) << below(48);
}

static void new_settings(void)
{
	struct pokeys_axis_settings *axis = &wish.settings.axis[below(3)];
	const struct pokeys_capability *can = &world.state.capability;
	const unsigned int pin = 20 + (unsigned int)below(10);

	wish.session = world.command.session;
	wish.generation++;
	axis->set |= POKEYS_AXIS_SET_HOMING_SPEED;
	axis->homing_speed = (uint8_t)(1 + below(99));
	if ((can->digital_in & can->digital_out) >> pin & 1)
		wish.settings.pin_set[pin / 8] |= (uint8_t)(1u << pin % 8);
	wish.settings.pin_function[pin] = below(2) ? WIRE_PIN_INPUT : WIRE_PIN_OUTPUT;
	device_wish(world.device, &wish);
	if (below(4) == 0)
		device_order(world.device, DEVICE_ORDER_APPLY);
}

static void all_is_as_wished(void)
{
	const struct sim_device *sim = &world.rig.device;

	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(world.state.config_generation, wish.generation);
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_ARMED);
	for (unsigned int i = 20; i < 30; i++) {
		if (wish.settings.pin_set[i / 8] >> i % 8 & 1)
			assert_int_equal(sim->config.pins.function[i],
					 wish.settings.pin_function[i]);
	}
	for (unsigned int i = 0; i < 3; i++) {
		if (wish.settings.axis[i].set)
			assert_int_equal(sim->config.engine.axis[i][13 - 8],
					 wish.settings.axis[i].homing_speed);
	}
	assert_int_equal(sim->config.pwm.enabled, world.command.pwm_enable);
	assert_memory_equal(sim->config.pwm.duty, world.command.pwm_duty,
			    sizeof(world.command.pwm_duty));
	assert_memory_equal(sim->bus.poext, world.command.poextbus, POKEYS_POEXTBUS);
	assert_int_equal(sim->engine.relays, world.command.relays);
	assert_int_equal(sim->engine.outputs, world.command.external_outputs);
}

static void new_one_shot(void)
{
	static const uint8_t operations[] = {
		POKEYS_ONE_SHOT_NOP,         POKEYS_ONE_SHOT_SET_POSITION,
		POKEYS_ONE_SHOT_CLEAR_FAULT, POKEYS_ONE_SHOT_SET_ENCODER,
		POKEYS_ONE_SHOT_SET_RTC,     POKEYS_ONE_SHOT_REBOOT,
	};
	const struct pokeys_one_shot shot = {
		.operation = operations[below(sizeof(operations))],
		.index = ENCODER,
		.mask = (uint8_t)below(8),
		.value = { (int32_t)below(3000) },
	};

	reboots_asked += shot.operation == POKEYS_ONE_SHOT_REBOOT;
	world_one_shot(&world, &shot);
}

static void something_happens(void)
{
	switch (below(20)) {
	case 0:
		new_faults();
		break;
	case 1:
		sim_rig_silence(&world.rig, world.now, below(500) * MS);
		break;
	case 2:
		if (below(4) == 0)
			sim_rig_reboot(&world.rig, world.now, below(2));
		break;
	case 3:
		world.commanding = below(4) != 0;
		break;
	case 4:
		world.command.flags ^= POKEYS_COMMAND_MACHINE_ON;
		break;
	case 5:
		sim_bench_emergency(&world.rig.device, below(4) == 0);
		break;
	case 6:
		if (below(8) == 0)
			world_stall(&world, below(400) * MS);
		break;
	case 7:
		world.rig.device.bench.shaft[ENCODER].rate = (int64_t)below(200000) - 100000;
		break;
	case 8:
	case 9:
		if (world.command.one_shot_head - world.state.one_shot_ack < 60)
			new_one_shot();
		break;
	case 10:
		new_settings();
		break;
	case 11:
	case 12:
		new_outputs();
		break;
	default:
		new_wishes();
	}
}

/* Nobody may be told that something moves which we did not permit. */
static void check_engine(void)
{
	if (world.state.flags & POKEYS_STATE_SAFE)
		assert_int_not_equal(world.state.engine.state, SIM_PE_RUNNING);
}

static void begin(void)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US,
		.jitter_ns = 100 * US,
		.device.boot_ms = 40,
	};

	world_init(&world, &options);
	world_axes(&world);
	world_pin(&world, RELAY, WIRE_PIN_OUTPUT);
	world_encoder(&world, ENCODER, WIRE_ENC_ENABLE | WIRE_ENC_4X, 40, 41);
	world_start(&world);
	world_commander(&world, 5);
	world.watch = count_runs;
	world_until(&world, world_is_running, 1 * SECOND);
}

/* A trip of the emergency input outlasts it; nothing is permitted before it is cleared. */
static void calm_down(void)
{
	const struct pokeys_one_shot clear = { .operation = POKEYS_ONE_SHOT_CLEAR_FAULT };

	world_loss(&world, 0);
	sim_bench_emergency(&world.rig.device, false);
	world.rig.device.bench.shaft[ENCODER].rate = 0;
	world.commanding = true;
	world.command.flags = 0;
	world_output(&world, RELAY, true);
	world_run(&world, 3 * SECOND);
	assert_int_equal(world_do(&world, &clear, 1 * SECOND), POKEYS_OUTCOME_DONE);
	world_machine_on(&world);
	world.command.flags = 0;
	world_run(&world, 1 * SECOND);
}

static void a_million_cycles_leave_everything_exact(void **state)
{
	uint64_t start;

	(void)state;
	sim_prng_init(&prng, world_seed());
	begin();
	for (start = world.cycle; world.cycle - start < CYCLES;) {
		something_happens();
		for (uint64_t n = below(60); n > 0; n--) {
			world_cycle(&world);
			check_engine();
		}
	}
	calm_down();
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_false(world.state.flags & POKEYS_STATE_STALE);
	assert_true(world_latch(&world, RELAY));
	assert_int_equal(world.state.encoder[ENCODER],
			 (int32_t)world.rig.device.encoders.raw[ENCODER]);
	for (unsigned int i = 0; i < 3; i++)
		assert_int_equal(world.state.engine.axis[i].position,
				 world.rig.device.engine.axis[i].pulses);
	all_is_as_wished();
	assert_true(runs_seen > 100 && world.event_count[EVENT_IDENTIFIED] > 100);
	assert_int_equal(world.rig.device.stats.saves, 0);
	printf("%" PRIu64 " starts of the engine, %" PRIu64 " identifications, %" PRIu64
	       " safe states, %" PRIu64 " reboots asked for\n",
	       runs_seen, world.event_count[EVENT_IDENTIFIED], world.event_count[EVENT_SAFE],
	       reboots_asked);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_million_cycles_leave_everything_exact),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
