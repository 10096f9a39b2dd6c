/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is asked in every cycle while older requests are under way: how old values become on
 * bad ways, that a slow device gets no queue, and that a late reply undoes no newer one.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"

enum { CYCLES = 5000, PIN = 3 };

static struct world world;
static uint64_t digital[CYCLES], motion[CYCLES];

/* Both ways lose this part of the packets and take from 25 us to so much more. */
static struct sim_rig_options way(double loss, uint64_t jitter_ns, uint64_t service_ns)
{
	const struct sim_link_faults faults = {
		.loss = loss,
		.delay = { .kind = SIM_DELAY_UNIFORM,
			   .low_ns = 25 * US,
			   .high_ns = 25 * US + jitter_ns },
	};

	return (struct sim_rig_options){
		.link.faults = { faults, faults },
		.service_ns = service_ns,
		.seed = 34,
	};
}

static struct sim_rig_options long_way(void)
{
	struct sim_rig_options options = way(0, 0, 100 * US);

	options.link.faults[0].delay.low_ns = options.link.faults[0].delay.high_ns = 1500 * US;
	options.link.faults[1] = options.link.faults[0];
	return options;
}

static int by_size(const void *a, const void *b)
{
	const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;

	return (x > y) - (x < y);
}

static uint64_t quantile(uint64_t *ages, double part)
{
	qsort(ages, CYCLES, sizeof(ages[0]), by_size);
	return ages[(size_t)(part * (CYCLES - 1))];
}

/* How old inputs and positions are whenever they are published, with three axes that move. */
static void measure(const struct sim_rig_options *options, unsigned int window)
{
	world_up(&world, options);
	if (window) {
		world.config.mailbox.window = window;
		world_start(&world);
		world_commander(&world, 5);
		world_until(&world, world_is_running, 5 * SECOND);
	}
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	world_run(&world, SECOND);
	memset(&world.sent, 0, sizeof(world.sent));
	for (unsigned int i = 0; i < CYCLES; i++) {
		world_go(&world, 0, (int32_t)i, 0);
		world_cycle(&world);
		digital[i] = world.state.t_publish_ns - world.state.t_digital_ns;
		motion[i] = world.state.t_publish_ns - world.state.t_motion_ns;
	}
}

/* With one request a cycle, of which a part p is not answered: so long, one time in a hundred. */
static uint64_t limit_ns(double loss)
{
	const double p = 1 - (1 - loss) * (1 - loss);

	return (uint64_t)(ceil(log(0.01) / log(p)) + 1) * MS;
}

static void a_lost_packet_costs_only_itself(void **state)
{
	static const double loss[] = { 0.01, 0.05, 0.1, 0.2 };

	(void)state;
	for (size_t i = 0; i < 2 * sizeof(loss) / sizeof(loss[0]); i++) {
		const struct sim_rig_options options = way(loss[i / 2], (i & 1) * 2 * MS, 100 * US);
		const uint64_t limit = limit_ns(loss[i / 2]) * 13 / 10;

		measure(&options, 0);
		assert_in_range(quantile(digital, 0.99), 0, limit);
		assert_in_range(quantile(motion, 0.99), 0, limit);
		/* some are sent twice */
		assert_in_range(world.sent.operation[0xCC], CYCLES - 50, CYCLES * 5 / 4);
		assert_in_range(world.sent.pulse[0x00], CYCLES - 50, CYCLES * 5 / 4);
		assert_in_range(world.sent.pulse[0x25], CYCLES - 50, CYCLES * 5 / 4);
	}
}

/* A way of 3 ms there and back: three cycles are under way, and nothing is older than that. */
static void a_long_way_makes_nothing_rarer(void **state)
{
	const struct sim_rig_options options = long_way();

	(void)state;
	measure(&options, 0);
	assert_int_equal(world.sent.operation[0xCC], CYCLES);
	assert_in_range(quantile(digital, 1), 0, 1 * MS);
	assert_int_equal(world.state.statistics.resent, 0);
}

/*
 * Packets take up to 5 ms each way and do not overtake each other: those behind a late one are
 * late as well, though the device has no queue. One at a time would make values 11 ms old.
 */
static void a_way_with_a_queue_of_its_own_is_no_slow_device(void **state)
{
	static const double loss[] = { 0, 0.01, 0.05 };

	(void)state;
	for (size_t i = 0; i < sizeof(loss) / sizeof(loss[0]); i++) {
		const struct sim_rig_options options = way(loss[i], 5 * MS, 100 * US);

		measure(&options, 0);
		assert_in_range(quantile(digital, 0.5), 0, 1500 * US);
		assert_in_range(quantile(digital, 0.99), 0, 6 * MS);
		assert_in_range(quantile(motion, 0.99), 0, 6 * MS);
		assert_in_range(world.sent.pulse[0x25], CYCLES * 2 / 3, CYCLES * 5 / 4);
	}
}

/* It works off a cycle's requests in more than a cycle: as one at a time, not older by a queue. */
static void a_slow_device_gets_no_queue(void **state)
{
	static const uint64_t service[] = { 450 * US, 700 * US, 2 * MS };
	uint64_t median, worst;

	(void)state;
	for (size_t i = 0; i < sizeof(service) / sizeof(service[0]); i++) {
		const struct sim_rig_options options = way(0, 0, service[i]);

		/* a window that has no room for more than one of each */
		measure(&options, 6);
		median = quantile(digital, 0.5);
		worst = quantile(digital, 0.99);
		measure(&options, 0);
		assert_in_range(quantile(digital, 0.5), 0, median * 11 / 10);
		assert_in_range(quantile(digital, 0.99), 0, worst * 13 / 10);
	}
}

/* What was measured in a bad moment is not the measure of all that follows. */
static void a_bad_begin_hides_no_queue(void **state)
{
	const struct sim_rig_options options = way(0, 0, 450 * US);
	struct sim_rig_options bad = way(0, 0, 450 * US);
	uint64_t median;

	(void)state;
	measure(&options, 0);
	median = quantile(digital, 0.5);
	bad.link.faults[0].delay.low_ns = bad.link.faults[0].delay.high_ns = 12 * MS;
	world_moving(&world, &bad);
	world_run(&world, 400 * MS);
	world_faults(&world, &options.link.faults[0]);
	world_run(&world, 1 * SECOND);
	for (unsigned int i = 0; i < CYCLES; i++) {
		world_go(&world, 0, (int32_t)i, 0);
		world_cycle(&world);
		digital[i] = world.state.t_publish_ns - world.state.t_digital_ns;
	}
	assert_in_range(quantile(digital, 0.5), 0, median * 11 / 10);
}

/* Nobody is there: no more than is needed to see when somebody is. */
static void silence_is_not_talked_into(void **state)
{
	(void)state;
	world_up(&world, NULL);
	world.config.lost_after_ns = 5 * SECOND;
	world_start(&world);
	world_until(&world, world_is_running, SECOND);
	world_run(&world, SECOND);
	sim_rig_silence(&world.rig, world.now, SECOND);
	memset(&world.sent, 0, sizeof(world.sent));
	world_run(&world, SECOND);
	assert_in_range(world.sent.operation[0xCC] + world.sent.pulse[0x00], 10, 150);
	world_run(&world, 100 * MS);
	assert_true(world.state.t_publish_ns - world.state.t_digital_ns < 1 * MS);
}

/* Whatever overtakes what: an output is in the end as it was commanded last, and known to be. */
static void an_output_ends_as_it_was_commanded_last(void **state)
{
	struct sim_rig_options options = way(0.05, 3 * MS, 100 * US);

	(void)state;
	for (unsigned int i = 0; i < SIM_LINK_DIRS; i++) {
		options.link.faults[i].reorder = 0.1;
		options.link.faults[i].reorder_ns = 3 * MS;
	}
	world_init(&world, &options);
	world_pin(&world, PIN, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 5 * SECOND);
	world_machine_on(&world);
	for (unsigned int i = 0; i < 300; i++) {
		const bool on = i & 1;

		world_output(&world, PIN, on);
		world_run(&world, (i % 7) * MS);
		world_output(&world, PIN, !on);
		world_run(&world, 120 * MS);
		assert_int_equal(world_latch(&world, PIN), !on);
		assert_int_equal(world.state.digital_out[PIN / 8] >> PIN % 8 & 1, !on);
	}
	assert_true(world.state.statistics.stale > 0);
}

static int swallowed;

static void swallow_outputs(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCC && swallowed-- > 0;
}

/* The relay is on, another output changes in every cycle, and the request with off is lost. */
static void safe_is_what_the_device_has_confirmed(void **state)
{
	const struct sim_rig_options options = long_way();

	(void)state;
	for (int lost = 0; lost < 8; lost++) {
		world_init(&world, &options);
		world_pin(&world, PIN, WIRE_PIN_OUTPUT);
		world_pin(&world, PIN + 1, WIRE_PIN_OUTPUT);
		world_start(&world);
		world_commander(&world, 5);
		world_until(&world, world_is_running, 5 * SECOND);
		world_machine_on(&world);
		world_run(&world, SECOND);
		for (unsigned int i = 0; i < 50 + (unsigned int)lost; i++) {
			world_output(&world, PIN, i > 2);
			world_output(&world, PIN + 1, i & 1);
			world_cycle(&world);
		}
		assert_true(world_latch(&world, PIN));
		assert_true(world.state.digital_out[PIN / 8] >> PIN % 8 & 1);
		world_daemon_ends(&world);
		swallowed = lost;
		world.watch = swallow_outputs;
		for (unsigned int i = 0; i < 40; i++) {
			world_cycle(&world);
			assert_false(world_is_safe(&world) && world_latch(&world, PIN));
		}
		assert_true(world_is_safe(&world));
	}
}

/* An axis that is told to go far and released a cycle later, before there is a reply. */
static void a_released_axis_does_not_run_on(void **state)
{
	const struct sim_rig_options options = long_way();

	(void)state;
	world_up(&world, &options);
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	world_run(&world, SECOND);
	world_go(&world, 0, 500000, 0);
	world_cycle(&world);
	world.command.axis[0].enable = 0;
	world_run(&world, 3 * SECOND);
	assert_in_range(world_pulses(&world, 0), 0, 5000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_lost_packet_costs_only_itself),
		cmocka_unit_test(a_long_way_makes_nothing_rarer),
		cmocka_unit_test(a_way_with_a_queue_of_its_own_is_no_slow_device),
		cmocka_unit_test(a_slow_device_gets_no_queue),
		cmocka_unit_test(a_bad_begin_hides_no_queue),
		cmocka_unit_test(silence_is_not_talked_into),
		cmocka_unit_test(an_output_ends_as_it_was_commanded_last),
		cmocka_unit_test(safe_is_what_the_device_has_confirmed),
		cmocka_unit_test(a_released_axis_does_not_run_on),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
