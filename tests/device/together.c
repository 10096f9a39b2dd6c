/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * slow = together: everything slow is asked in one cycle, beside the two fast
 * requests, at one rate, and a group that was asked in between is back in step.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/io.h"

/* What a default device with an encoder and an analog input has to be asked. */
static const uint8_t asked[] = { 0xCD, 0x3A, 0xDA, 0xCF, 0xCB, 0x05, 0x83, 0x00 };
enum { OPERATIONS = sizeof(asked), PULSE = 2 }; /* and external outputs, dedicated inputs */

static struct world world;

static int begin(void **state)
{
	/* one that takes twelve requests in less than a cycle */
	static const struct sim_rig_options quick = {
		.service_ns = 10 * US,
		.link.faults = {
			{ .delay = { .low_ns = 25 * US } }, { .delay = { .low_ns = 25 * US } },
		},
	};

	(void)state;
	world_init(&world, &quick);
	world.config.slow_together = true;
	world.config.slow_hz = 10;
	world.config.mailbox.window = 20;
	world_encoder(&world, 3, WIRE_ENC_ENABLE | WIRE_ENC_4X, 255, 255);
	world_pin(&world, 40, WIRE_PIN_ANALOG_IN);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 100 * MS);
	memset(&world.sent, 0, sizeof(world.sent));
	return 0;
}

/* Of the slow ones, but PoNET's. */
static uint64_t slow_sent(void)
{
	uint64_t sum = world.sent.pulse[0x04] + world.sent.pulse[0x08];

	for (unsigned int i = 0; i < OPERATIONS; i++)
		sum += world.sent.operation[asked[i]];
	return sum;
}

/* Runs through a second: how many cycles had slow requests, and how many those were. */
static void count(unsigned int *cycles, uint64_t *least, uint64_t *most)
{
	*cycles = 0;
	*least = UINT64_MAX;
	*most = 0;
	for (int i = 0; i < 1000; i++) {
		const uint64_t before = slow_sent();
		uint64_t now;

		world_cycle(&world);
		now = slow_sent() - before;
		if (!now)
			continue;
		(*cycles)++;
		*least = now < *least ? now : *least;
		*most = now > *most ? now : *most;
	}
}

static void all_slow_groups_go_in_one_cycle(void **state)
{
	unsigned int cycles;
	uint64_t least, most;

	(void)state;
	count(&cycles, &least, &most);
	assert_in_range(cycles, 9, 11);
	assert_int_equal(least, OPERATIONS + PULSE);
	assert_int_equal(most, OPERATIONS + PULSE);
	assert_int_equal(world.sent.operation[0xCC], 1000);
	assert_int_equal(world.sent.pulse[0x00], 1000);
	for (unsigned int i = 0; i < OPERATIONS; i++)
		assert_in_range(world.sent.operation[asked[i]], 9, 11);
	assert_int_equal(world.state.statistics.cycles_late, 0);
}

static void group_asked_in_between_is_back_in_step(void **state)
{
	unsigned int cycles;
	uint64_t least, most;

	(void)state;
	world_stall(&world, 30 * MS); /* then it is asked who it is, at once */
	world_run(&world, 200 * MS);
	count(&cycles, &least, &most);
	assert_in_range(cycles, 9, 11);
	assert_int_equal(least, OPERATIONS + PULSE);
	assert_int_equal(most, OPERATIONS + PULSE);
}

static void small_window_spreads_them_and_keeps_the_fast_ones(void **state)
{
	(void)state;
	world.config.mailbox.window = 8;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 100 * MS);
	memset(&world.sent, 0, sizeof(world.sent));
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.sent.operation[0xCC], 1000);
	assert_int_equal(world.sent.pulse[0x00], 1000);
	for (unsigned int i = 0; i < OPERATIONS; i++)
		assert_in_range(world.sent.operation[asked[i]], 9, 11);
	assert_int_equal(world.state.statistics.cycles_late, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(all_slow_groups_go_in_one_cycle, begin),
		cmocka_unit_test_setup(group_asked_in_between_is_back_in_step, begin),
		cmocka_unit_test_setup(small_window_spreads_them_and_keeps_the_fast_ones, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
