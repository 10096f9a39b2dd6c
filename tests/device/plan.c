/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The polling plan: two fast requests, at most one more a cycle, rates by the
 * clock; a slow device, a deaf operation or another device cost nobody else.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/io.h"

static struct world world, other;

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 100 * MS);
	memset(&world.sent, 0, sizeof(world.sent));
	return 0;
}

static void fast_requests_go_out_every_cycle(void **state)
{
	(void)state;
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.sent.operation[0xCC], 1000);
	assert_int_equal(world.sent.pulse[0x00], 1000);
	assert_int_equal(world.fresh_high, 3);
	assert_int_equal(world.state.statistics.cycles_late, 0);
	assert_int_equal(world.state.statistics.packet_error_level, 0);
}

static void fast_requests_may_be_divided(void **state)
{
	(void)state;
	world.config.fast_divider = 4;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	memset(&world.sent, 0, sizeof(world.sent));
	world_run(&world, 1 * SECOND);
	assert_in_range(world.sent.operation[0xCC], 249, 251);
	assert_in_range(world.sent.pulse[0x00], 249, 251);
	assert_false(world.state.flags & POKEYS_STATE_STALE);
}

static void slow_groups_keep_their_rates(void **state)
{
	(void)state;
	world.config.slow_hz = 5;
	world.config.encoder_hz = 100;
	world.config.analog_hz = 40;
	world_encoder(&world, 3, WIRE_ENC_ENABLE | WIRE_ENC_4X, 255, 255);
	world_encoder(&world, 20, WIRE_ENC_ENABLE | WIRE_ENC_4X, 255, 255);
	world_pin(&world, 40, WIRE_PIN_ANALOG_IN);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 100 * MS);
	memset(&world.sent, 0, sizeof(world.sent));
	world_run(&world, 10 * SECOND);
	assert_in_range(world.sent.operation[0xCF], 48, 52);
	assert_in_range(world.sent.operation[0x83], 48, 52);
	assert_in_range(world.sent.operation[0x05], 48, 52);
	assert_in_range(world.sent.operation[0xCB], 48, 52);
	assert_in_range(world.sent.pulse[0x04], 48, 52);
	assert_in_range(world.sent.operation[0x00], 9, 11);
	assert_in_range(world.sent.operation[0xDA], 190, 205);
	assert_in_range(world.sent.operation[0x3A], 380, 405);
	assert_in_range(world.sent.operation[0xCD], 1900, 2010);
	assert_int_equal(world.sent.operation[0xCC], 10000);
}

static void short_stall_is_not_caught_up(void **state)
{
	(void)state;
	world.config.encoder_hz = 200;
	world_encoder(&world, 3, WIRE_ENC_ENABLE | WIRE_ENC_4X, 255, 255);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 100 * MS);
	for (unsigned int i = 0; i < 10; i++) {
		world_stall(&world, 150 * MS);
		memset(&world.sent, 0, sizeof(world.sent));
		world_run(&world, 50 * MS);
		assert_in_range(world.sent.operation[0xCD], 8, 15);
		assert_in_range(world.sent.operation[0xCC], 49, 51);
	}
}

static void slow_values_arrive(void **state)
{
	struct sim_device *sim = &world.rig.device;

	(void)state;
	sim->bench.load_percent = 42;
	sim->config.pins.function[40] = WIRE_PIN_ANALOG_IN;
	sim->config.pins.function[2] = WIRE_PIN_COUNTER;
	sim->config.pins.function[4] = WIRE_PIN_COUNTER;
	sim->bench.analog[0].low = 1234;
	sim->pins.counter[2] = 22;
	sim->pins.counter[4] = 44;
	sim->config.pwm.period = 2500;
	sim->config.pwm.duty[1] = 100;
	sim->bus.poext[3] = 0x5a;
	sim->engine.relays = 0x03;
	sim->engine.outputs = 0x78;
	world_start(&world);
	world_commander(&world, 5); /* or the safe state would switch them off */
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.identity.load, 42);
	assert_int_equal(world.state.analog[0], 1234);
	assert_int_equal(world.state.counter[2], 22);
	assert_int_equal(world.state.counter[4], 44);
	assert_int_equal(world.state.pwm_period, 2500);
	assert_int_equal(world.state.pwm_duty[1], 100);
	assert_int_equal(world.state.poextbus[3], 0x5a);
	assert_int_equal(world.state.engine.relays, 0x03);
	assert_int_equal(world.state.engine.outputs, 0x78);
	assert_in_range(world.state.device_tick_ms, 900, 1500);
	assert_true(world.state.t_publish_ns - world.state.t_slow_ns < 60 * MS);
}

static void lost_packet_costs_its_deadline_and_a_round_trip(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < 100; i++) {
		uint64_t worst = 0;

		world_run(&world, 20 * MS);
		/* one packet of the next cycle does not arrive */
		sim_link_silence(&world.rig.link, i & 1 ? SIM_LINK_REQUEST : SIM_LINK_REPLY,
				 world.now, world.now + (i & 1 ? 1 : 200 * US));
		for (unsigned int n = 0; n < 10; n++) {
			world_cycle(&world);
			if (world.state.t_publish_ns - world.state.t_digital_ns > worst)
				worst = world.state.t_publish_ns - world.state.t_digital_ns;
		}
		assert_true(worst <= 2 * MS);
	}
	assert_int_equal(world.state.statistics.timed_out, 0);
}

static uint8_t deaf_to;

static void deaf(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == deaf_to;
}

/* Firmware that does not know an operation and drops it. */
static void never_answered_operation_is_asked_less_and_less(void **state)
{
	static const uint8_t operations[] = { 0xDA, 0x8F, 0x06, 0xCF };

	for (size_t i = 0; i < sizeof(operations); i++) {
		begin(state);
		deaf_to = operations[i];
		world.watch = deaf;
		world_start(&world);
		world_until(&world, world_is_running, 2 * SECOND);
		world_run(&world, 10 * SECOND);
		memset(&world.sent, 0, sizeof(world.sent));
		world_run(&world, 10 * SECOND);
		assert_in_range(world.sent.operation[deaf_to], 0, 60);
		assert_int_equal(world.sent.operation[0xCC], 10000);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	}
}

static void deaf_to_all_but_the_fast_ones(struct world *w, const uint8_t *p)
{
	w->swallow = p[1] != 0xCC && !(p[1] == 0x85 && (p[2] == 0x00 || p[2] == 0x25));
}

/* All others fill the window up to the places that are kept. */
static void window_always_has_room_for_the_fast_requests(void **state)
{
	unsigned int in_flight = 0;

	(void)state;
	world.config.mailbox.deadline_floor_ns = 40 * MS;
	world.config.mailbox.retries = 20;
	world_axes(&world);
	world_encoder(&world, 3, WIRE_ENC_ENABLE | WIRE_ENC_4X, 255, 255);
	world_encoder(&world, 20, WIRE_ENC_ENABLE | WIRE_ENC_4X, 255, 255);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 500 * MS);
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	world.watch = deaf_to_all_but_the_fast_ones;
	memset(&world.sent, 0, sizeof(world.sent));
	for (unsigned int i = 0; i < 150; i++) {
		world.command.pwm_enable = 3;
		world.command.pwm_duty[0] = i;
		memset(world.command.poextbus_mask, 0xff, 10);
		world.command.poextbus[0] = (uint8_t)i;
		world.command.relays_mask = 0xff;
		world.command.relays = (uint8_t)i;
		world.command.ponet_mask = 0xffff;
		world.command.ponet_data[0][0] = (uint8_t)i;
		world_go(&world, 0, (int32_t)i, 0);
		world_cycle(&world);
		if (world.state.statistics.in_flight > in_flight)
			in_flight = world.state.statistics.in_flight;
	}
	assert_int_equal(world.sent.operation[0xCC], 150);
	assert_true(world.sent.pulse[0x00] >= 149);
	assert_true(world.sent.pulse[0x25] >= 140);
	assert_in_range(in_flight, 3, 8);
}

static void measured_times_are_those_of_the_link(void **state)
{
	static struct pokeys_diag diag;

	(void)state;
	world_run(&world, 1 * SECOND);
	device_diag(world.device, &diag);
	assert_in_range(diag.round_trip.min_ns, 149 * US, 151 * US);
	assert_true(diag.fast_round_trip.count >= 2000);
	assert_in_range(diag.fast_round_trip.max_ns, 249 * US, 351 * US);
	assert_in_range(diag.fresh.min_ns, 249 * US, 351 * US);
	assert_true(diag.receive.count >= 2000 && diag.receive.max_ns == 0);
}

static void each_class_of_requests_has_its_round_trips(void **state)
{
	const struct pokeys_one_shot zero = {
		.operation = POKEYS_ONE_SHOT_SET_ENCODER,
		.index = 1,
	};
	static struct pokeys_diag diag;

	(void)state;
	world_pin(&world, 3, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 10 * MS);
	assert_int_equal(world_do(&world, &zero, SECOND), POKEYS_OUTCOME_DONE);
	world_output(&world, 3, true);
	world_run(&world, SECOND);
	device_diag(world.device, &diag);
	assert_true(diag.read_round_trip.count >= 1000);
	assert_true(diag.write_round_trip.count >= 1);
	assert_int_equal(diag.read_round_trip.count + diag.write_round_trip.count +
				 diag.one_shot_round_trip.count,
			 diag.round_trip.count);
	assert_int_equal(diag.read_round_trip.sum_ns + diag.write_round_trip.sum_ns +
				 diag.one_shot_round_trip.sum_ns,
			 diag.round_trip.sum_ns);
}

/* A commander that writes `writes` times before the daemon looks; ages 1 us, 2 us ... */
static void write_ages(uint64_t writes)
{
	struct pokeys_command *command = &world.command;

	for (uint64_t i = 1; i <= writes; i++)
		command->read_age_ns[(command->heartbeat + i) % POKEYS_READ_AGES] = (uint32_t)(i *
											       US);
	command->heartbeat += writes - 1; /* and one more in world_cycle() */
	world_cycle(&world);
}

static void ages_at_read_are_counted_once_each(void **state)
{
	static struct pokeys_diag diag;

	(void)state;
	world_commander(&world, 5);
	world_run(&world, 10 * MS);
	device_diag(world.device, &diag);
	assert_int_equal(diag.age_at_read.count, 0); /* all 0: not known */
	write_ages(3);
	device_diag(world.device, &diag);
	assert_int_equal(diag.age_at_read.count, 3);
	assert_int_equal(diag.age_at_read.sum_ns, 6 * US);
	world.commanding = false; /* the same image again */
	world_run(&world, 5 * MS);
	device_diag(world.device, &diag);
	assert_int_equal(diag.age_at_read.count, 3);
	/* more than the image holds: the newest of them */
	world.commanding = true;
	write_ages(POKEYS_READ_AGES + 5);
	device_diag(world.device, &diag);
	assert_int_equal(diag.age_at_read.count, 3 + POKEYS_READ_AGES);
	assert_int_equal(diag.age_at_read.max_ns, (POKEYS_READ_AGES + 5) * US);
}

/* Two devices of one daemon: one is dead, then slow; the other does not notice. */
static void one_device_does_not_disturb_another(void **state)
{
	const struct sim_rig_options slow = { .service_ns = 20 * MS };

	(void)state;
	world_init(&other, &slow);
	memset(&world.sent, 0, sizeof(world.sent));
	for (unsigned int i = 0; i < 5000; i++) {
		if (i == 2000)
			sim_rig_silence(&other.rig, other.now, 2 * SECOND);
		world_cycle(&world);
		world_cycle(&other);
		assert_true(world.state.t_publish_ns - world.state.t_digital_ns < 1 * MS);
	}
	assert_int_equal(world.sent.operation[0xCC], 5000);
	assert_true(other.sent.all < 2000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(fast_requests_go_out_every_cycle, begin),
		cmocka_unit_test_setup(fast_requests_may_be_divided, begin),
		cmocka_unit_test_setup(slow_groups_keep_their_rates, begin),
		cmocka_unit_test_setup(short_stall_is_not_caught_up, begin),
		cmocka_unit_test_setup(slow_values_arrive, begin),
		cmocka_unit_test_setup(lost_packet_costs_its_deadline_and_a_round_trip, begin),
		cmocka_unit_test_setup(never_answered_operation_is_asked_less_and_less, begin),
		cmocka_unit_test_setup(window_always_has_room_for_the_fast_requests, begin),
		cmocka_unit_test_setup(measured_times_are_those_of_the_link, begin),
		cmocka_unit_test_setup(each_class_of_requests_has_its_round_trips, begin),
		cmocka_unit_test_setup(ages_at_read_are_counted_once_each, begin),
		cmocka_unit_test_setup(one_device_does_not_disturb_another, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
