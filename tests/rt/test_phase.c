/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The phase lock in virtual time: a thread that reads, cycles that cost something,
 * and what comes of it. In every test no cycle may be more than 2 % off.
 *
 * Random ones print their seed and take it back (POKEYS_SEED).
 */
#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>
#include "daemon/rt/phase.h"

#define US	1000.0
#define MS	UINT64_C(1000000)
#define SECOND	UINT64_C(1000000000)

static struct {
	struct phase phase;
	/* the thread */
	double next_read, period;  /* true ones, ns */
	uint64_t says;             /* the period it tells */
	double jitter_ns;          /* late by up to so much, evenly */
	double late_part, late_ns; /* and now and then by so much */
	double write_ns;           /* from read to write */
	bool silent;
	uint64_t read_ns;    /* last read that was told */
	unsigned int writes; /* in the last cycle */
	/* the cycle */
	uint64_t tick;
	double cost_ns, cost_jitter_ns;
	uint64_t cost; /* of the last cycle */
	/* seen, of reads while locked */
	uint64_t reads, missed;   /* ... in which the newest data was not there yet */
	double age_sum, age_most; /* since publication */
} sim;

static uint64_t random_state;

static double even(void)
{
	random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
	return (double)(random_state >> 11) / 9007199254740992.0;
}

static int begin(void **state)
{
	const char *given = getenv("POKEYS_SEED");
	struct timespec t;

	(void)state;
	clock_gettime(CLOCK_MONOTONIC, &t);
	random_state = given ? strtoull(given, NULL, 0) :
			       (uint64_t)t.tv_sec * 1000000007u + (uint64_t)t.tv_nsec;
	printf("POKEYS_SEED=%" PRIu64 "\n", random_state);
	memset(&sim, 0, sizeof(sim));
	phase_init(&sim.phase, MS);
	sim.tick = 1000 * SECOND;
	sim.next_read = (double)sim.tick + even() * (double)MS;
	sim.period = (double)MS;
	sim.says = MS;
	sim.cost_ns = 100 * US;
	return 0;
}

static void count_age(double read_ns, uint64_t published)
{
	double age = read_ns - (double)published;

	if (!sim.phase.locked)
		return;
	sim.reads++;
	if (age < 0) {
		sim.missed++;
		return;
	}
	sim.age_sum += age;
	sim.age_most = fmax(sim.age_most, age);
}

/* Reads whose command is there at the next tick; the newest is told. */
static bool reads_until(uint64_t tick, uint64_t published)
{
	bool any = false;

	sim.writes = 0;
	while (sim.next_read + sim.write_ns < (double)tick) {
		double late = even() * sim.jitter_ns;

		if (even() < sim.late_part)
			late += sim.late_ns;
		if (!sim.silent && sim.next_read + sim.write_ns + late < (double)tick) {
			sim.writes++;
			/* only the read that a cycle is laid for */
			if (sim.period < 1.5 * (double)sim.phase.nominal_ns ||
			    sim.next_read - (double)published < (double)MS / 2)
				count_age(sim.next_read + late, published);
			sim.read_ns = (uint64_t)(sim.next_read + late);
			any = true;
		}
		sim.next_read += sim.period;
	}
	return any;
}

static void tell(uint64_t cost)
{
	const struct phase_stamp stamp = {
		.read_ns = sim.read_ns,
		.write_ns = sim.read_ns + (uint64_t)sim.write_ns,
		.period_ns = sim.says,
	};

	phase_read(&sim.phase, &stamp, sim.tick, cost);
}

static void cycle(void)
{
	uint64_t length = phase_next(&sim.phase, sim.tick), next = sim.tick + length;
	double nominal = (double)sim.phase.nominal_ns;

	assert_true(fabs((double)length - nominal) <= nominal * 0.02 + 1);
	assert_int_equal(length, sim.phase.period_ns);
	sim.cost = (uint64_t)(sim.cost_ns + even() * sim.cost_jitter_ns);
	if (reads_until(next, sim.tick + sim.cost))
		tell(sim.cost);
	sim.tick = next;
}

static void run(uint64_t cycles)
{
	while (cycles--)
		cycle();
}

/* Cycles until it is locked; fails after `most`. */
static uint64_t until_locked(uint64_t most)
{
	uint64_t cycles = 0;

	while (!sim.phase.locked) {
		assert_true(cycles++ < most);
		cycle();
	}
	return cycles;
}

static void forget_what_was_seen(void)
{
	sim.reads = sim.missed = 0;
	sim.age_sum = sim.age_most = 0;
}

/* From the tick to the next read, as far as that is before or behind the lead. */
static double distance(void)
{
	double teeth = sim.period * (sim.phase.ratio > 1 ? 1 / sim.phase.ratio : 1);
	double off = sim.next_read - (double)sim.tick - (double)phase_lead(&sim.phase);

	return off - teeth * round(off / teeth);
}

static void lock_is_reached_from_any_phase(void **state)
{
	(void)state;
	for (int i = 0; i < 100; i++) {
		begin(NULL);
		sim.next_read = (double)sim.tick + i * (double)MS / 100;
		assert_true(until_locked(300) >= 50);
		run(2000);
		assert_true(sim.phase.locked);
		assert_true(fabs(distance()) < 2 * US);
		assert_int_equal(sim.phase.losses, 0);
	}
}

/* What an axis is told must not jump because a lock is sought. */
static void each_cycle_sees_one_new_command_while_a_lock_is_sought(void **state)
{
	(void)state;
	for (int i = 0; i < 200; i++) {
		begin(NULL);
		sim.write_ns = (1 + i % 20) * 10 * US;
		/* a nanosecond's luck beside a write may cost one command, at the first tick */
		sim.next_read = (double)sim.tick + i * (double)MS / 200 + 2500;
		sim.period = (double)MS * (0.995 + 0.01 * even());
		sim.says = (uint64_t)llround(sim.period);
		run(2);
		for (int n = 0; n < 1000; n++) {
			cycle();
			assert_int_equal(sim.writes, 1);
		}
		assert_true(sim.phase.locked);
		assert_true(fabs(distance()) < 3 * US);
	}
}

static void locked_reads_find_data_that_are_as_young_as_can_be(void **state)
{
	(void)state;
	sim.jitter_ns = 20 * US;
	sim.cost_jitter_ns = 40 * US;
	until_locked(500);
	run(5000);
	forget_what_was_seen();
	run(20000);
	assert_true(sim.reads > 19900);
	/* of a thousand, five may come too early for their data, and a few by chance */
	assert_true((double)sim.missed < 0.01 * (double)sim.reads);
	/* margin, spread of cost and of reads, a bucket; free-running it is 500 us */
	assert_true(sim.age_sum / (double)sim.reads < 70 * US);
	assert_true(sim.age_most < 90 * US);
}

static void cost_that_grows_makes_the_lead_longer(void **state)
{
	uint64_t before;

	(void)state;
	until_locked(500);
	run(5000);
	before = phase_lead(&sim.phase);
	assert_in_range(before, 100 * US, 120 * US);
	sim.cost_ns = 300 * US;
	run(1000);
	assert_in_range(phase_lead(&sim.phase), 300 * US, 320 * US);
	assert_true(sim.phase.locked && sim.phase.losses == 0);
	/* and shorter again, when the dear ones are forgotten */
	sim.cost_ns = 100 * US;
	run(2 * LEAD_SAMPLES);
	assert_in_range(phase_lead(&sim.phase), 100 * US, 120 * US);
	assert_true(fabs(distance()) < 5 * US);
}

static void cycles_that_fail_do_not_make_the_lead_longer(void **state)
{
	(void)state;
	until_locked(500);
	run(5000);
	for (int i = 0; i < 1000; i++) {
		cycle();
		tell(0);
	}
	assert_in_range(phase_lead(&sim.phase), 100 * US, 120 * US);
}

static void rare_dear_cycles_do_not_set_the_lead(void **state)
{
	(void)state;
	until_locked(500);
	for (int i = 0; i < 10000; i++) {
		double usual = sim.cost_ns;

		sim.cost_ns = i % 1000 == 999 ? 800 * US : usual;
		cycle();
		sim.cost_ns = usual;
	}
	assert_in_range(phase_lead(&sim.phase), 100 * US, 120 * US);
}

static void a_period_up_to_one_percent_off_is_followed(void **state)
{
	static const double parts[] = { 0.99, 0.995, 0.9999, 1.0001, 1.005, 1.01 };

	(void)state;
	for (size_t i = 0; i < sizeof(parts) / sizeof(parts[0]); i++) {
		begin(NULL);
		sim.period = (double)MS * parts[i];
		sim.says = (uint64_t)llround(sim.period);
		until_locked(2000);
		run(3000);
		assert_true(sim.phase.locked && sim.phase.losses == 0);
		assert_true(fabs(distance()) < 3 * US);
		assert_true(fabs((double)sim.phase.period_ns - sim.period) < 100);
	}
}

static void a_period_that_is_told_wrongly_is_measured(void **state)
{
	(void)state;
	sim.period = (double)MS * 1.003; /* it says 1 ms */
	until_locked(2000);
	run(3000);
	assert_true(sim.phase.locked);
	assert_true(fabs(distance()) < 3 * US);
	assert_true(fabs(sim.phase.drift_ns - 3000) < 50);
}

static void drift_is_followed(void **state)
{
	(void)state;
	sim.jitter_ns = 10 * US;
	until_locked(500);
	run(2000);
	for (int i = 0; i < 20000; i++) { /* 400 ppm back and forth in ten seconds */
		sim.period = (double)MS * (1 + 4e-4 * sin(i * 6.283 / 10000));
		cycle();
	}
	assert_true(sim.phase.locked);
	assert_int_equal(sim.phase.losses, 0);
	assert_true(fabs(distance()) < 15 * US);
}

static void slow_thread_gets_every_nth_cycle(void **state)
{
	static const unsigned int multiples[] = { 2, 3, 4, 10 };

	(void)state;
	for (size_t i = 0; i < sizeof(multiples) / sizeof(multiples[0]); i++) {
		begin(NULL);
		sim.period = multiples[i] * (double)MS;
		sim.says = multiples[i] * MS;
		until_locked(200 * multiples[i]);
		run(3000 * multiples[i]);
		assert_true(sim.phase.locked);
		assert_true(fabs(distance()) < 3 * US);
		assert_true(fabs((double)sim.phase.period_ns - (double)MS) < 100);
	}
}

static void every_nth_read_of_a_fast_thread_lies_behind_a_cycle(void **state)
{
	static const unsigned int parts[] = { 2, 4, 10 };

	(void)state;
	for (size_t i = 0; i < sizeof(parts) / sizeof(parts[0]); i++) {
		begin(NULL);
		sim.period = (double)MS / parts[i];
		sim.says = MS / parts[i];
		until_locked(500);
		run(3000);
		assert_true(sim.phase.locked);
		assert_true(fabs(distance()) < 3 * US);
		assert_true(fabs((double)sim.phase.period_ns - (double)MS) < 100);
	}
}

static void periods_that_do_not_fit_are_known(void **state)
{
	(void)state;
	assert_true(phase_fits(&sim.phase, MS));
	assert_true(phase_fits(&sim.phase, MS * 101 / 100));
	assert_true(phase_fits(&sim.phase, 2 * MS));
	assert_true(phase_fits(&sim.phase, MS / 4));
	assert_true(phase_fits(&sim.phase, 16 * MS));
	assert_false(phase_fits(&sim.phase, 0));
	assert_false(phase_fits(&sim.phase, MS * 102 / 100));
	assert_false(phase_fits(&sim.phase, MS * 3 / 2));
	assert_false(phase_fits(&sim.phase, MS * 2 / 3));
	assert_false(phase_fits(&sim.phase, 17 * MS));
	assert_false(phase_fits(&sim.phase, MS / 17));
	assert_false(phase_fits(&sim.phase, 1));
	assert_false(phase_fits(&sim.phase, UINT64_MAX));
}

static void jump_of_the_thread_is_lost_and_found(void **state)
{
	(void)state;
	until_locked(500);
	run(1000);
	sim.next_read += 300 * US;
	for (int i = 0; i < 40 && sim.phase.locked; i++)
		cycle();
	assert_false(sim.phase.locked);
	assert_int_equal(sim.phase.losses, 1);
	until_locked(500);
	run(1000);
	assert_true(fabs(distance()) < 3 * US);
}

static void another_period_begins_anew(void **state)
{
	(void)state;
	until_locked(500);
	run(100);
	sim.period = 2 * (double)MS;
	sim.says = 2 * MS;
	run(3);
	assert_false(sim.phase.locked);
	assert_int_equal(sim.phase.losses, 1);
	until_locked(1000);
	run(2000);
	assert_true(fabs(distance()) < 3 * US);
}

static void long_silence_begins_anew(void **state)
{
	(void)state;
	until_locked(500);
	sim.silent = true;
	run(200);
	sim.silent = false;
	sim.next_read += 123 * US;
	run(2);
	assert_false(sim.phase.locked);
	until_locked(500);
}

static void free_it_runs_as_configured(void **state)
{
	(void)state;
	sim.period = 1.005 * (double)MS;
	sim.says = MS * 1005 / 1000;
	until_locked(1000);
	run(2000);
	assert_true(sim.phase.period_ns > MS + 4000);
	phase_free(&sim.phase);
	assert_int_equal(phase_next(&sim.phase, sim.tick), MS);
	assert_false(sim.phase.locked);
	assert_int_equal(sim.phase.losses, 1);
	phase_free(&sim.phase);
	assert_int_equal(sim.phase.losses, 1);
}

static void few_reads_that_are_missing_change_nothing(void **state)
{
	(void)state;
	until_locked(500);
	run(3000);
	for (int i = 0; i < 1000; i++) {
		sim.silent = even() < 0.3;
		cycle();
	}
	assert_true(sim.phase.locked);
	assert_int_equal(sim.phase.losses, 0);
	assert_true(fabs(distance()) < 3 * US);
}

static void rare_late_reads_move_nothing(void **state)
{
	uint64_t far = 0;

	(void)state;
	sim.jitter_ns = 10 * US;
	until_locked(500);
	run(3000);
	sim.late_part = 0.02;
	sim.late_ns = 400 * US;
	for (int i = 0; i < 20000; i++) {
		cycle();
		far += fabs(distance()) > 20 * US;
	}
	assert_true(sim.phase.locked);
	assert_int_equal(sim.phase.losses, 0);
	assert_int_equal(far, 0);
}

static void thread_that_reads_at_random_is_not_followed(void **state)
{
	uint64_t locked = 0;

	(void)state;
	sim.jitter_ns = 950 * US;
	for (int i = 0; i < 50000; i++) {
		cycle();
		locked += sim.phase.locked;
	}
	assert_int_equal(locked, 0);
}

/* Whatever it is given: cycles stay within their bound, and it ends up locked. */
static void noise_breaks_nothing(void **state)
{
	(void)state;
	for (int i = 0; i < 200000; i++) {
		if (even() < 0.001)
			sim.jitter_ns = even() * 900 * US;
		if (even() < 0.0005)
			sim.next_read += even() * 50 * (double)MS;
		if (even() < 0.0005) {
			sim.period = (double)MS * (0.99 + 0.02 * even());
			sim.says = even() < 0.5 ? MS : (uint64_t)sim.period;
		}
		if (even() < 0.0005)
			sim.silent = !sim.silent;
		if (even() < 0.001)
			sim.cost_ns = even() * 2 * (double)MS;
		cycle();
	}
	sim.jitter_ns = 0;
	sim.silent = false;
	sim.cost_ns = 100 * US;
	sim.period = (double)MS;
	sim.says = MS;
	run(3 * LEAD_SAMPLES);
	until_locked(5000);
	run(3 * LEAD_SAMPLES);
	assert_true(fabs(distance()) < 5 * US);
}

#define TEST(f) cmocka_unit_test_setup(f, begin)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(lock_is_reached_from_any_phase),
		TEST(each_cycle_sees_one_new_command_while_a_lock_is_sought),
		TEST(locked_reads_find_data_that_are_as_young_as_can_be),
		TEST(cost_that_grows_makes_the_lead_longer),
		TEST(cycles_that_fail_do_not_make_the_lead_longer),
		TEST(rare_dear_cycles_do_not_set_the_lead),
		TEST(a_period_up_to_one_percent_off_is_followed),
		TEST(a_period_that_is_told_wrongly_is_measured),
		TEST(drift_is_followed),
		TEST(slow_thread_gets_every_nth_cycle),
		TEST(every_nth_read_of_a_fast_thread_lies_behind_a_cycle),
		TEST(periods_that_do_not_fit_are_known),
		TEST(jump_of_the_thread_is_lost_and_found),
		TEST(another_period_begins_anew),
		TEST(long_silence_begins_anew),
		TEST(free_it_runs_as_configured),
		TEST(few_reads_that_are_missing_change_nothing),
		TEST(rare_late_reads_move_nothing),
		TEST(thread_that_reads_at_random_is_not_followed),
		TEST(noise_breaks_nothing),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
