/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The loop with a real network, a real device model and real shared memory.
 *
 * How long something takes here is the machine's affair, and is shown but not
 * judged; the exact times are judged in virtual time (test_cycle.c). Judged
 * here is what must hold on any machine: that it runs, recovers, counts, and
 * neither allocates nor touches a page for the first time.
 *
 * POKEYS_SECONDS lengthens the watch for page faults and allocations (3).
 */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "tests/rt/allocations.h"
#include "tests/rt/rig.h"

static struct rig_options options = { .period_ns = 1000000, .realtime = true };

static int begin(void **state)
{
	static struct rig rig;

	*state = &rig;
	if (rig_start(&rig, &options) < 0 || rig_run(&rig) < 0) {
		rig_stop(&rig);
		return -1;
	}
	return 0;
}

/* A machine that is held for a while has not lost its device. */
static int begin_patient(void **state)
{
	int rc;

	options.lost_after_ns = RIG_PATIENCE_MS * UINT64_C(1000000);
	rc = begin(state);
	options.lost_after_ns = 0;
	return rc;
}

static int begin_spinning(void **state)
{
	int rc;

	options.mode = LOOP_SPIN;
	rc = begin(state);
	options.mode = LOOP_SLEEP;
	return rc;
}

static int end(void **state)
{
	rig_stop(*state);
	return 0;
}

/* Until this is so of the newest state. */
#define AWAIT(rig, s, condition) do {							\
	unsigned int waited_ = 0;							\
	for (rig_state(rig, s); !(condition); rig_state(rig, s)) {			\
		if ((waited_ += 5) > RIG_PATIENCE_MS)					\
			fail_msg("not within %d ms: " #condition, RIG_PATIENCE_MS);	\
		rig_sleep_ms(5);							\
	}										\
} while (0)

static unsigned int seconds(void)
{
	const char *given = getenv("POKEYS_SECONDS");

	return given ? (unsigned int)atoi(given) : 3;
}

static void show(struct rig *rig)
{
	struct pokeys_state s;
	struct pokeys_diag d;

	rig_state(rig, &s);
	rig_diag(rig, &d);
	printf("cycles %llu skipped %llu lost %llu stray %llu | us, median/p99: wake-up %.1f/%.1f "
	       "round trip %.1f/%.1f work %.1f/%.1f publish %.1f | calls a cycle %.2f\n",
	       (unsigned long long)d.cycle, (unsigned long long)d.cycles_skipped,
	       (unsigned long long)s.statistics.lost, (unsigned long long)s.statistics.stray,
	       (double)pokeys_histogram_percentile(&d.wakeup, 0.5) / 1e3,
	       (double)pokeys_histogram_percentile(&d.wakeup, 0.99) / 1e3,
	       (double)pokeys_histogram_percentile(&d.fast_round_trip, 0.5) / 1e3,
	       (double)pokeys_histogram_percentile(&d.fast_round_trip, 0.99) / 1e3,
	       (double)pokeys_histogram_percentile(&d.cycle_work, 0.5) / 1e3,
	       (double)pokeys_histogram_percentile(&d.cycle_work, 0.99) / 1e3,
	       (double)pokeys_histogram_percentile(&d.publish, 0.5) / 1e3,
	       d.cycle ? (double)d.transport_system_calls / (double)d.cycle : 0.0);
}

static void device_is_found_and_polled(void **state)
{
	struct pokeys_state first, second;
	struct rig *rig = *state;

	assert_true(rig_await_link(rig, POKEYS_LINK_RUNNING));
	rig_state(rig, &first);
	rig_sleep_ms(500);
	AWAIT(rig, &second,
	      second.cycle > first.cycle &&
		      second.statistics.accepted > first.statistics.accepted &&
		      second.t_digital_ns > first.t_digital_ns);
	assert_int_equal(second.identity.address, rig->address);
	show(rig);
}

static void every_image_is_whole_and_newer(void **state)
{
	struct rig *rig = *state;
	struct pokeys_state s;
	uint64_t cycle = 0, published = 0;

	assert_true(rig_await_link(rig, POKEYS_LINK_RUNNING));
	for (int i = 0; i < 300; i++) {
		rig_state(rig, &s);
		assert_int_equal(s.magic, POKEYS_STATE_MAGIC);
		assert_true(s.cycle >= cycle && s.t_publish_ns >= published);
		assert_true(s.t_digital_ns <= s.t_publish_ns);
		cycle = s.cycle;
		published = s.t_publish_ns;
		rig_sleep_ms(1);
	}
}

static void lost_packets_are_recovered(void **state)
{
	struct rig *rig = *state;
	struct pokeys_state before, after;

	assert_true(rig_await_link(rig, POKEYS_LINK_RUNNING));
	rig_state(rig, &before);
	assert_int_equal(rig_simulator(rig, "fault", "both", "loss", "0.05", NULL), 0);
	AWAIT(rig, &after,
	      after.statistics.resent > before.statistics.resent + 10 &&
		      after.statistics.accepted > before.statistics.accepted + 1000);
	assert_int_equal(after.link, POKEYS_LINK_RUNNING);
	assert_int_equal(after.statistics.reconnects, before.statistics.reconnects);
	show(rig);
}

static uint64_t strays(const struct pokeys_state *s)
{
	return s->statistics.stray + s->statistics.duplicate + s->statistics.stale;
}

static void strays_are_counted_and_disturb_nothing(void **state)
{
	struct rig *rig = *state;
	struct pokeys_state before, after;

	assert_true(rig_await_link(rig, POKEYS_LINK_RUNNING));
	rig_state(rig, &before);
	/* a few at a time: what a socket has no room for while the thread is held is no stray */
	for (unsigned int i = 1; i <= 10; i++) {
		assert_int_equal(rig_simulator(rig, "stray", "20", NULL), 0);
		AWAIT(rig, &after, strays(&after) >= strays(&before) + 20 * i);
	}
	AWAIT(rig, &after, after.statistics.accepted > before.statistics.accepted);
	assert_int_equal(after.link, POKEYS_LINK_RUNNING);
	assert_int_equal(after.statistics.reconnects, before.statistics.reconnects);
	show(rig);
}

static void silent_device_is_lost_and_found_again(void **state)
{
	struct pokeys_state before, after;
	struct rig *rig = *state;

	assert_true(rig_await_link(rig, POKEYS_LINK_RUNNING));
	rig_state(rig, &before);
	assert_int_equal(rig_simulator(rig, "silence", "1000", NULL), 0);
	/* lost and there again may both be over when we look */
	AWAIT(rig, &after, after.fault_count > before.fault_count);
	AWAIT(rig, &after, after.statistics.reconnects > before.statistics.reconnects);
	assert_true(rig_await_link(rig, POKEYS_LINK_RUNNING));
}

static void loop_neither_allocates_nor_faults(void **state)
{
	struct rig *rig = *state;
	uint64_t minor, major;

	if (!rig->is_realtime || !allocations_are_counted) {
		fprintf(stderr, "skipped: no right to lock memory or to SCHED_FIFO here, or a "
				"sanitizer's allocator\n");
		skip();
	}
	assert_true(rig_await_link(rig, POKEYS_LINK_RUNNING));
	rig_sleep_ms(300);
	atomic_store(&allocations_count, 0);
	atomic_store(&allocations_thread, atomic_load(&rig->loop.shared.thread));
	assert_int_equal(loop_sample_faults(&rig->loop), 0);
	minor = atomic_load(&rig->loop.shared.minor_faults);
	major = atomic_load(&rig->loop.shared.major_faults);
	for (unsigned int i = 0; i < seconds(); i++) {
		/* not only the quiet life */
		assert_int_equal(rig_simulator(rig, "fault", "both", "loss", i % 2 ? "0.1" : "0",
					       NULL),
				 0);
		assert_int_equal(rig_simulator(rig, "stray", "200", NULL), 0);
		rig_sleep_ms(1000);
	}
	assert_int_equal(rig_simulator(rig, "silence", "600", NULL), 0);
	rig_sleep_ms(1000);
	assert_int_equal(loop_sample_faults(&rig->loop), 0);
	assert_int_equal(atomic_load(&rig->loop.shared.minor_faults), minor);
	assert_int_equal(atomic_load(&rig->loop.shared.major_faults), major);
	atomic_store(&allocations_thread, 0); /* a thread that ends frees what is its own */
	assert_int_equal(atomic_load(&allocations_count), 0);
}

/* The counter itself counts, or the test above says nothing. */
static void allocations_of_the_watched_thread_are_counted(void **state)
{
	void *volatile memory;

	(void)state;
	if (!allocations_are_counted)
		skip();
	atomic_store(&allocations_count, 0);
	atomic_store(&allocations_thread, gettid());
	memory = malloc(100);
	free(memory);
	atomic_store(&allocations_thread, 0);
	memory = malloc(100);
	free(memory);
	assert_int_equal(atomic_load(&allocations_count), 2);
}

static void end_is_orderly_and_told(void **state)
{
	struct rig *rig = *state;
	struct pokeys_state s;

	assert_true(rig_await_link(rig, POKEYS_LINK_RUNNING));
	rig_halt(rig);
	assert_int_equal(rig->result, 0);
	assert_true(atomic_load(&rig->loop.shared.ended));
	rig_state(rig, &s);
	assert_int_equal(s.flags & POKEYS_STATE_STOPPING, POKEYS_STATE_STOPPING);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, begin, end)
#define PATIENT(f) cmocka_unit_test_setup_teardown(f, begin_patient, end)
#define SPIN(f) cmocka_unit_test_setup_teardown(f, begin_spinning, end)

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		TEST(device_is_found_and_polled),
		SPIN(device_is_found_and_polled),
		TEST(every_image_is_whole_and_newer),
		PATIENT(lost_packets_are_recovered),
		PATIENT(strays_are_counted_and_disturb_nothing),
		TEST(silent_device_is_lost_and_found_again),
		TEST(loop_neither_allocates_nor_faults),
		SPIN(loop_neither_allocates_nor_faults),
		cmocka_unit_test(allocations_of_the_watched_thread_are_counted),
		TEST(end_is_orderly_and_told),
	};
	const struct transport_options none = { 0 };
	struct transport *t;
	const char *why;

	if (argc < 3)
		return 2;
	options.simulator = argv[1];
	options.transport = argv[2];
	if (transport_open(&t, options.transport, &none, &why) < 0) {
		fprintf(stderr, "skipped: %s: %s\n", options.transport, why);
		return 77;
	}
	transport_close(t);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
