/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Made-up cycles with known answers: whose each microsecond was, that nothing is
 * forgotten or counted twice whatever comes in, and which cycles are kept.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <pokeys/async.h>
#include "tools/trace_collect.h"

#define US UINT64_C(1000)
#define TICK (100000 * US)

enum { MARKS = 64 };

static struct trace_mark mark[MARKS];
static size_t marks;
static uint32_t sents, gots;
static struct trace_cycle cycle;

/* A cycle that is awake 50 us after its tick, has asked at 60 and published at 300. */
static int begin(void **state)
{
	(void)state;
	marks = 0;
	sents = gots = 0;
	cycle = (struct trace_cycle){
		.cycle = 7,
		.tick_ns = TICK,
		.woke_ns = TICK + 50 * US,
		.asked_ns = TICK + 60 * US,
		.published_ns = TICK + 300 * US,
	};
	return 0;
}

/* At so many us from the tick; the thread sleeps at first. */
static void at(int64_t us, enum trace_event_kind kind, const char *name)
{
	struct trace_mark *m = &mark[marks++];

	*m = (struct trace_mark){ .t_ns = TICK + (uint64_t)(us * 1000), .kind = MARK_KERNEL };
	m->event.kind = kind;
	m->event.idle = !strcmp(name, "idle");
	memcpy(m->event.name, name, strlen(name));
}

static void packet_of(int64_t us, enum trace_mark_kind kind, uint32_t request)
{
	mark[marks++] = (struct trace_mark){ .t_ns = TICK + (uint64_t)(us * 1000),
					     .kind = kind,
					     .request = request };
}

/* The first request is answered first. */
static void packet(int64_t us, enum trace_mark_kind kind)
{
	packet_of(us, kind, kind == MARK_SENT ? sents++ : gots++);
}

static void softirq(int64_t us, enum trace_event_kind kind, uint32_t number)
{
	at(us, kind, "");
	mark[marks - 1].event.number = number;
}

static void attribute(void)
{
	uint64_t sum = 0;

	trace_attribute(&cycle, mark, marks);
	for (int i = 0; i < TRACE_WHERES; i++)
		sum += cycle.ns[i];
	assert_int_equal(sum, trace_length(&cycle));
}

static void assert_us(enum trace_where where, uint64_t us)
{
	if (cycle.ns[where] != us * US)
		fail_msg("%s: %llu ns instead of %llu us", trace_where_name(where),
			 (unsigned long long)cycle.ns[where], (unsigned long long)us);
}

static void assert_part(enum trace_where where, const char *who, uint64_t us)
{
	for (size_t i = 0; i < cycle.parts; i++)
		if (cycle.part[i].where == where && !strncmp(cycle.part[i].who, who, 16)) {
			assert_int_equal(cycle.part[i].ns, us * US);
			return;
		}
	fail_msg("no part of %s", who);
}

/* Asleep before the tick; awake at 50, asked at 60, in bed at 80 with one reply awaited. */
static void usual_beginning(void)
{
	at(-500, TRACE_OFF, "idle");
	at(30, TRACE_IRQ_BEGIN, "timer");
	at(35, TRACE_WAKING, "swapper");
	at(40, TRACE_IRQ_END, "");
	at(50, TRACE_ON, "pokeysd");
	packet(55, MARK_SENT);
	at(80, TRACE_OFF, "idle");
}

/* On PREEMPT_RT: the thread pushes one aside that is in the middle of a softirq. */
static void a_softirq_that_is_pushed_aside_is_not_the_threads_time(void **state)
{
	(void)state;
	at(-500, TRACE_OFF, "idle");
	at(10, TRACE_OTHER, "irq/30-enp1");
	softirq(20, TRACE_SOFTIRQ_BEGIN, 3);
	at(30, TRACE_WAKING, "irq/30-enp1");
	at(50, TRACE_ON, "pokeysd");
	packet(55, MARK_SENT);
	at(80, TRACE_OFF, "irq/30-enp1");
	softirq(90, TRACE_SOFTIRQ_END, 3);
	packet(200, MARK_GOT);
	at(210, TRACE_WAKING, "idle");
	at(230, TRACE_ON, "pokeysd");
	attribute();
	assert_us(TRACE_PLAN, 10);
	assert_us(TRACE_SEND, 20);
	assert_us(TRACE_RUN, 70);
	assert_us(TRACE_DEVICE, 120);
	assert_us(TRACE_SOFTIRQ, 30); /* 20 to 50, while it was late */
}

/* More of them than have a line each: none is left out of the sum. */
static void many_in_front_are_others(void **state)
{
	uint64_t sum = 0;

	(void)state;
	at(-500, TRACE_OFF, "idle");
	at(10, TRACE_WAKING, "idle");
	for (int i = 0; i < 40; i++) {
		char name[16];

		snprintf(name, sizeof(name), "thread %d", i);
		at(10 + i, TRACE_OTHER, name);
	}
	at(50, TRACE_ON, "pokeysd");
	attribute();
	assert_us(TRACE_BEHIND, 40);
	assert_part(TRACE_BEHIND, "thread 0", 1);
	assert_part(TRACE_BEHIND, "others", 40 - TRACE_PARTS + 1);
	for (size_t i = 0; i < cycle.parts; i++)
		sum += cycle.part[i].ns;
	assert_int_equal(sum, 40 * US);
}

static void a_usual_cycle_is_taken_apart(void **state)
{
	(void)state;
	usual_beginning();
	packet(200, MARK_GOT);
	softirq(205, TRACE_SOFTIRQ_BEGIN, 3);
	at(210, TRACE_WAKING, "idle");
	softirq(215, TRACE_SOFTIRQ_END, 3);
	at(230, TRACE_ON, "pokeysd");
	attribute();
	assert_true(cycle.whole);
	assert_us(TRACE_TIMER, 30);
	assert_us(TRACE_INTERRUPT, 10);
	assert_part(TRACE_INTERRUPT, "timer", 10);
	assert_us(TRACE_WAKE_UP, 10 + 15);
	assert_us(TRACE_PLAN, 10);
	assert_us(TRACE_SEND, 20);
	assert_us(TRACE_DEVICE, 120);
	assert_us(TRACE_RECEIVE, 5);
	assert_us(TRACE_SOFTIRQ, 10);
	assert_part(TRACE_SOFTIRQ, "NET_RX", 10);
	assert_us(TRACE_RUN, 70);
	assert_us(TRACE_BEHIND, 0);
}

static void who_is_in_front_is_named(void **state)
{
	(void)state;
	at(-500, TRACE_OFF, "cc1");
	at(10, TRACE_WAKING, "cc1");
	at(30, TRACE_OTHER, "migration/1");
	at(50, TRACE_ON, "pokeysd");
	at(100, TRACE_PREEMPTED, "rtc:servo");
	at(120, TRACE_OTHER, "ksoftirqd/1");
	at(125, TRACE_ON, "pokeysd");
	attribute();
	assert_us(TRACE_TIMER, 10);
	assert_us(TRACE_BEHIND, 40 + 25);
	assert_part(TRACE_BEHIND, "cc1", 20);
	assert_part(TRACE_BEHIND, "migration/1", 20);
	assert_part(TRACE_BEHIND, "rtc:servo", 20);
	assert_part(TRACE_BEHIND, "ksoftirqd/1", 5);
	assert_us(TRACE_SEND, 300 - 60 - 25);
}

static void interrupts_hold_up_what_runs_but_not_who_waits_for_a_device(void **state)
{
	(void)state;
	usual_beginning();
	at(100, TRACE_IRQ_BEGIN, "enp1s0"); /* while the device is awaited: nobody's loss */
	at(110, TRACE_IRQ_END, "");
	packet(200, MARK_GOT);
	at(220, TRACE_WAKING, "x");
	at(220, TRACE_ON, "pokeysd");
	at(240, TRACE_IRQ_BEGIN, "enp1s0"); /* in the middle of its work */
	softirq(245, TRACE_SOFTIRQ_BEGIN, 9);
	at(250, TRACE_IRQ_BEGIN, "timer");
	at(255, TRACE_IRQ_END, "");
	at(260, TRACE_IRQ_END, "");
	softirq(270, TRACE_SOFTIRQ_END, 9);
	attribute();
	assert_us(TRACE_DEVICE, 120);
	assert_us(TRACE_INTERRUPT, 10 + 20);
	assert_us(TRACE_SOFTIRQ, 10);
	assert_part(TRACE_SOFTIRQ, "RCU", 10);
	assert_us(TRACE_RECEIVE, 20);
	assert_us(TRACE_RUN, 80 - 30);
}

static void the_second_reply_is_waited_for_as_well(void **state)
{
	(void)state;
	usual_beginning();
	marks--;
	packet(56, MARK_SENT);
	at(80, TRACE_OFF, "idle");
	packet(100, MARK_GOT);
	at(105, TRACE_WAKING, "idle");
	at(110, TRACE_ON, "pokeysd");
	at(120, TRACE_OFF, "idle");
	packet(280, MARK_GOT);
	at(281, TRACE_WAKING, "idle");
	at(290, TRACE_ON, "pokeysd");
	attribute();
	assert_us(TRACE_DEVICE, 20 + 160);
	assert_us(TRACE_RECEIVE, 5 + 1);
	assert_us(TRACE_WAKE_UP, 10 + 5 + 9);
	assert_us(TRACE_RUN, 10 + 10);
}

static void a_thread_that_polls_waits_for_the_device_while_it_runs(void **state)
{
	(void)state;
	cycle.spins = true;
	packet(55, MARK_SENT);
	packet(250, MARK_GOT);
	attribute();
	assert_true(cycle.whole);
	assert_us(TRACE_RUN, 50 + 50); /* polls for its tick; takes the reply */
	assert_us(TRACE_PLAN, 10);
	assert_us(TRACE_DEVICE, 190);
}

/* One that was lost is sent again; one of the cycle before is never answered. */
static void a_request_is_waited_for_once(void **state)
{
	(void)state;
	cycle.spins = true;
	packet_of(-500, MARK_SENT, 4095);
	packet_of(55, MARK_SENT, 7);
	packet_of(100, MARK_SENT, 7);
	packet_of(250, MARK_GOT, 7);
	attribute();
	assert_us(TRACE_DEVICE, 190);
	assert_us(TRACE_RUN, 50 + 50);
}

/* Whoever sleeps after it has asked waits for somebody, also when it was asked long ago. */
static void asleep_without_a_reply_is_the_devices_time(void **state)
{
	(void)state;
	usual_beginning();
	packet(90, MARK_GOT);
	at(91, TRACE_WAKING, "idle");
	at(95, TRACE_ON, "pokeysd");
	at(100, TRACE_OFF, "idle");
	at(280, TRACE_WAKING, "idle");
	at(290, TRACE_ON, "pokeysd");
	attribute();
	assert_true(cycle.whole);
	assert_us(TRACE_DEVICE, 10 + 180);
	assert_us(TRACE_RECEIVE, 1);
}

/* The thread has noted the time, so it did run then, whatever the kernel has told. */
static void a_switch_that_is_missing_is_told(void **state)
{
	(void)state;
	at(-500, TRACE_OFF, "idle");
	at(80, TRACE_OFF, "idle");
	at(230, TRACE_ON, "pokeysd");
	attribute();
	assert_false(cycle.whole);
	begin(NULL);
	usual_beginning(); /* and is asleep when it publishes */
	attribute();
	assert_false(cycle.whole);
}

static void a_cycle_before_that_took_too_long_is_not_the_timers_fault(void **state)
{
	(void)state;
	at(-100, TRACE_ON, "pokeysd");
	attribute();
	assert_us(TRACE_RUN, 50);
	assert_us(TRACE_TIMER, 0);
}

static void what_was_not_seen_is_told(void **state)
{
	(void)state;
	at(250, TRACE_ON, "pokeysd");
	attribute();
	assert_false(cycle.whole);
	marks = 0;
	attribute();
	assert_false(cycle.whole);
}

static void marks_outside_of_the_cycle_count_for_nothing(void **state)
{
	struct trace_cycle without;

	(void)state;
	usual_beginning();
	attribute();
	without = cycle;
	at(300, TRACE_ON, "pokeysd");
	at(400, TRACE_PREEMPTED, "x");
	packet(401, MARK_GOT);
	attribute();
	assert_memory_equal(cycle.ns, without.ns, sizeof(cycle.ns));
}

/* Any marks in any order: the sum holds, parts stay within theirs. */
static void nothing_is_forgotten_whatever_comes(void **state)
{
	unsigned int seed = 20260101;

	(void)state;
	for (int round = 0; round < 2000; round++) {
		int64_t us = -200;

		begin(NULL);
		cycle.spins = round % 3 == 0;
		while (marks < MARKS) {
			uint32_t kind = (uint32_t)rand_r(&seed) % 12;

			us += rand_r(&seed) % 20;
			if (kind < 10)
				at(us, kind, kind % 2 ? "idle" : "a name of 16 ch");
			else
				packet(us, kind == 10 ? MARK_SENT : MARK_GOT);
		}
		attribute();
		for (size_t i = 0; i < cycle.parts; i++)
			assert_true(cycle.part[i].ns <= cycle.ns[cycle.part[i].where]);
	}
}

static void put_cycle(struct collect *collect, uint64_t number, uint64_t length_us)
{
	const struct recorder_cycle recorded = {
		.cycle = number,
		.tick_ns = TICK + number * 1000 * US,
		.woke_ns = TICK + number * 1000 * US + 5 * US,
		.asked_ns = TICK + number * 1000 * US + 6 * US,
		.published_ns = TICK + (number * 1000 + length_us) * US,
	};
	struct recorder_slot slot = { .kind = RECORDER_CYCLE };

	memcpy(slot.data, &recorded, sizeof(recorded));
	collect_slot(collect, &slot);
}

static void the_slowest_are_kept_slowest_first(void **state)
{
	static const uint64_t lengths[] = { 100, 900, 300, 500, 200, 800, 50 };
	static struct collect collect;
	struct trace_report report = { 0 };

	(void)state;
	collect = (struct collect){ .wanted = 3 };
	assert_int_equal(collect_begin(&collect), 0);
	for (uint64_t i = 0; i < 7; i++)
		put_cycle(&collect, i, lengths[i]);
	collect_judge(&collect, TICK + 3500 * US);
	assert_int_equal(collect.lengths, 3); /* the fourth ends at 3500 */
	collect_judge(&collect, UINT64_MAX / 2);
	collect_report(&collect, &report);
	assert_int_equal(report.cycles, 7);
	assert_int_equal(report.count, 3);
	assert_int_equal(report.cycle[0].cycle, 1);
	assert_int_equal(report.cycle[1].cycle, 5);
	assert_int_equal(report.cycle[2].cycle, 3);
	assert_int_equal(report.median_ns, 300 * US);
	assert_int_equal(report.max_ns, 900 * US);
	collect_end(&collect);
}

static void below_the_threshold_none_is_kept(void **state)
{
	static struct collect collect;
	struct trace_report report = { 0 };

	(void)state;
	collect = (struct collect){ .wanted = 5, .threshold_ns = 400 * US };
	assert_int_equal(collect_begin(&collect), 0);
	put_cycle(&collect, 1, 399);
	put_cycle(&collect, 2, 400);
	collect_judge(&collect, UINT64_MAX / 2);
	collect_report(&collect, &report);
	assert_int_equal(report.count, 1);
	assert_int_equal(report.cycle[0].cycle, 2);
	assert_int_equal(report.cycles, 2);
	collect_end(&collect);
}

static void marks_of_both_witnesses_meet_in_the_order_of_time(void **state)
{
	static struct collect collect;
	struct trace_report report = { 0 };
	const struct recorder_slot sent = {
		.kind = RECORDER_SENT,
		.tries = 2,
		.t_ns = TICK + 1000 * US + 6 * US,
	};
	const struct recorder_slot got = {
		.kind = RECORDER_RECEIVED,
		.verdict = POKEYS_VERDICT_ACCEPTED,
		.t_ns = TICK + 1000 * US + 80 * US,
	};
	struct trace_event event = { .t_ns = TICK + 990 * US, .kind = TRACE_ON };

	(void)state;
	collect = (struct collect){ .wanted = 1 };
	assert_int_equal(collect_begin(&collect), 0);
	put_cycle(&collect, 1, 100);
	collect_slot(&collect, &got);
	collect_slot(&collect, &sent);
	collect_event(&collect, &event);
	event = (struct trace_event){ .t_ns = TICK + 1000 * US + 20 * US,
				      .kind = TRACE_OFF,
				      .idle = 1 };
	collect_event(&collect, &event);
	event = (struct trace_event){ .t_ns = TICK + 1000 * US + 90 * US, .kind = TRACE_ON };
	collect_event(&collect, &event);
	collect_judge(&collect, UINT64_MAX / 2);
	collect_report(&collect, &report);
	assert_true(report.cycle[0].whole);
	assert_int_equal(report.cycle[0].ns[TRACE_SEND], 14 * US);
	assert_int_equal(report.cycle[0].ns[TRACE_DEVICE], 60 * US);
	assert_int_equal(report.cycle[0].ns[TRACE_RECEIVE], 10 * US);
	assert_int_equal(report.cycle[0].ns[TRACE_RUN], 5 * US + 10 * US);
	collect_end(&collect);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup(name, begin)
	const struct CMUnitTest tests[] = {
		TEST(a_usual_cycle_is_taken_apart),
		TEST(a_softirq_that_is_pushed_aside_is_not_the_threads_time),
		TEST(who_is_in_front_is_named),
		TEST(many_in_front_are_others),
		TEST(interrupts_hold_up_what_runs_but_not_who_waits_for_a_device),
		TEST(the_second_reply_is_waited_for_as_well),
		TEST(a_thread_that_polls_waits_for_the_device_while_it_runs),
		TEST(a_request_is_waited_for_once),
		TEST(asleep_without_a_reply_is_the_devices_time),
		TEST(a_switch_that_is_missing_is_told),
		TEST(a_cycle_before_that_took_too_long_is_not_the_timers_fault),
		TEST(what_was_not_seen_is_told),
		TEST(marks_outside_of_the_cycle_count_for_nothing),
		TEST(nothing_is_forgotten_whatever_comes),
		TEST(the_slowest_are_kept_slowest_first),
		TEST(below_the_threshold_none_is_kept),
		TEST(marks_of_both_witnesses_meet_in_the_order_of_time),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
