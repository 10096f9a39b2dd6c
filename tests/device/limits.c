/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every counter and time runs over its limit while a machine is at work, and nothing
 * happens: no loss, no restart, no refusal, and no position that is another one.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/device/internal.h"
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/io.h"

enum { RELAY = 0, ENCODER = 5, NEAR = 1000 };

#define LEAD (10 * SECOND)	/* until the clocks are at their limit */

static struct world world;
static struct sim_device *const sim = &world.rig.device;

/* What the daemon counts in 32 bits or fewer. */
static void preset(struct device *device)
{
	struct pokeys_state *image = &device->image;

	image->fault_count = UINT32_MAX;
	image->engine.task_count = image->engine.buffer_underruns = UINT32_MAX;
	image->engine.buffer_resyncs = UINT32_MAX;
	image->engine.stops = UINT8_MAX;
	device->wishes.count = UINT32_MAX - 1;
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		image->encoder_resync[i] = UINT32_MAX;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		image->engine.axis[i].position_epoch = UINT8_MAX - 1;
	for (unsigned int i = 0; i < SLOW_GROUPS; i++)
		device->plan.slow[i].count = UINT32_MAX - 2;
	device->mailbox.next_id = UINT8_MAX - 1;
	device->ponet.readings = device->ponet.since_keys = UINT32_MAX - 10;
}

static void start(uint64_t limit_ns)
{
	world_init_at(&world, NULL, limit_ns - LEAD);
	world_axes(&world);
	world_pin(&world, RELAY, WIRE_PIN_OUTPUT);
	world_encoder(&world, ENCODER, WIRE_ENC_ENABLE | WIRE_ENC_4X, 40, 41);
	sim_device_advance(sim, world.now);
	sim->run.boot_ns = 0;
	sim->encoders.raw[ENCODER] = INT32_MAX - 100000;
	world_start(&world);
	preset(world.device);
	atomic_store(&world.events.head, UINT32_MAX - 2);
	atomic_store(&world.events.tail, UINT32_MAX - 2);
	world_commander(&world, UINT32_MAX);
	world.command.heartbeat = UINT32_MAX - NEAR;
	world.command.one_shot_head = UINT32_MAX - 3;
	world_until(&world, world_is_running, 1 * SECOND);
}

/* Each is a new count, and the epoch has eight bits. */
static void positions_are_set(void)
{
	struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 2,
	};

	for (int32_t i = 1; i <= 6; i++) {
		const uint8_t before = world.state.engine.axis[1].position_epoch;

		set.value[1] = 1000 * i;
		assert_int_equal(world_do(&world, &set, 1 * SECOND), POKEYS_OUTCOME_DONE);
		world_run(&world, 10 * MS);
		assert_int_not_equal(world.state.engine.axis[1].position_epoch, before);
		assert_int_equal(world.state.engine.axis[1].position_epoch & 1, 1);
		assert_int_equal(world.state.engine.axis[1].position, set.value[1]);
	}
}

static void wishes_are_applied(struct pokeys_wish *wish)
{
	wish->generation++;
	wish->settings.axis[2].set |= POKEYS_AXIS_SET_HOMING_SPEED;
	wish->settings.axis[2].homing_speed = (uint8_t)(10 + wish->generation % 50);
	device_wish(world.device, wish);
	world_run(&world, 500 * MS);
	assert_int_equal(world.state.config_generation, wish->generation);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(sim->config.engine.axis[2][13 - 8], wish->settings.axis[2].homing_speed);
}

static void is_well(void)
{
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_false(world.state.flags & (POKEYS_STATE_STALE | POKEYS_STATE_SAFE));
	assert_true(world_latch(&world, RELAY));
}

static void a_machine_works_beyond(uint64_t limit_ns)
{
	struct pokeys_wish wish = { .session = UINT32_MAX, .generation = UINT32_MAX - 2 };
	const struct pokeys_one_shot nop = { .operation = POKEYS_ONE_SHOT_NOP };

	start(limit_ns);
	positions_are_set();
	for (unsigned int i = 0; i < 5; i++)
		wishes_are_applied(&wish);
	world_output(&world, RELAY, true);
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	sim->bench.shaft[ENCODER].rate = 20000;
	for (unsigned int i = 0; world.now < limit_ns + LEAD; i++) {
		if (i % 500 == 0)
			world_go(&world, 0, i % 1000 ? 0 : 20000, 0);
		if (i % 100 == 0)
			assert_int_equal(world_do(&world, &nop, 1 * SECOND), POKEYS_OUTCOME_DONE);
		world_cycle(&world);
		is_well();
	}
	sim->bench.shaft[ENCODER].rate = 0;
	world_go(&world, 0, 12345, 0);
	world_run(&world, 5 * SECOND);
	is_well();
	assert_int_equal(world_pulses(&world, 0), 12345);
	assert_int_equal(world.state.engine.axis[0].position, 12345);
	assert_int_equal(world.state.encoder[ENCODER], (int32_t)sim->encoders.raw[ENCODER]);
	assert_true(world.state.encoder[ENCODER] < 0);
	assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
	assert_int_equal(world.event_count[EVENT_IDENTIFIED], 1);
}

static void thirty_two_bits_of_milliseconds(void **state)
{
	(void)state;
	a_machine_works_beyond((UINT64_C(1) << 32) * MS);
	/* the device's clock wraps there, ours does not */
	assert_true(world.state.device_tick_ms < 60000);
}

static void the_nanoseconds_that_a_double_holds(void **state)
{
	(void)state;
	a_machine_works_beyond(UINT64_C(1) << 53);
}

static void half_of_all_nanoseconds(void **state)
{
	(void)state;
	a_machine_works_beyond(UINT64_C(1) << 63);
}

/* The device was not heard while its clock wrapped. */
static void a_silence_over_the_wrap_of_its_clock_is_no_restart(void **state)
{
	const uint64_t limit_ns = (UINT64_C(1) << 32) * MS;

	(void)state;
	start(limit_ns);
	world_run(&world, 5 * SECOND);
	sim_rig_silence(&world.rig, world.now, 10 * SECOND);
	world_until(&world, world_is_lost, 1 * SECOND);
	world_until(&world, world_is_running, 15 * SECOND);
	world_run(&world, 1 * SECOND);
	assert_true(world.now > limit_ns && world.state.device_tick_ms < 60000);
	assert_int_equal(world.event_count[EVENT_REBOOTED], 0);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(thirty_two_bits_of_milliseconds),
		cmocka_unit_test(the_nanoseconds_that_a_double_holds),
		cmocka_unit_test(half_of_all_nanoseconds),
		cmocka_unit_test(a_silence_over_the_wrap_of_its_clock_is_no_restart),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
