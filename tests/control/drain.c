// SPDX-License-Identifier: GPL-2.0-or-later
/* Events become lines; noise of one device hides nothing else. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/drain.h"

static struct config config;
static struct teller teller = { .config = &config };
static struct event_ring ring;
static struct drain drain;
static int pipe_fd[2];
static char got[65536];

static int setup(void **state)
{
	(void)state;
	memset(&ring, 0, sizeof(ring));
	config.devices = 2;
	strcpy(config.device[0].name, "mill");
	strcpy(config.device[1].name, "lathe");
	teller.show = NULL;
	drain_init(&drain, &teller, &ring, NULL, NULL);
	if (pipe(pipe_fd))
		return -1;
	log_open(pipe_fd[1], EVENT_DEBUG);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	close(pipe_fd[0]);
	close(pipe_fd[1]);
	return 0;
}

static void push(uint8_t device, enum event_code code, int64_t a)
{
	const struct event event = {
		.code = (uint16_t)code, .level = EVENT_WARNING, .device = device, .a = a
	};

	event_push(&ring, &event);
}

/* How often a text stands in what was written since the last time. */
static int written(const char *text)
{
	int count = 0;
	ssize_t length;

	log_line(EVENT_ERROR, "end");
	length = read(pipe_fd[0], got, sizeof(got) - 1);
	got[length > 0 ? length : 0] = '\0';
	for (const char *at = got; (at = strstr(at, text)); at++)
		count++;
	return count;
}

static void an_event_is_written_with_its_device(void **state)
{
	(void)state;
	push(1, EVENT_SAFE, 1);
	assert_int_equal(drain_run(&drain, 1), 1);
	assert_int_equal(written("lathe: "), 1);
	assert_int_equal(drain_run(&drain, 2), 0);
}

static void noise_of_one_device_hides_no_other(void **state)
{
	uint64_t now = 1;

	(void)state;
	for (int i = 0; i < 100; i++) {
		push(0, EVENT_STALE, 1);
		drain_run(&drain, now += 1000000);
	}
	assert_int_equal(written("mill: "), LOG_BURST);
	push(1, EVENT_STALE, 1);
	push(0, EVENT_SAFE, 1);
	push(0, EVENT_STALE, 1);
	drain_run(&drain, now += 1000000);
	assert_int_equal(written("lathe: "), 1);
	assert_non_null(strstr(got, "mill: "));
	push(0, EVENT_STALE, 1);
	drain_run(&drain, now + LOG_WHILE_NS);
	assert_int_equal(written("(91 more of this kind were not written)"), 1);
}

/* Each is a line of its own, however many: they are no repetition of one another. */
static void every_setting_that_was_changed_is_told(void **state)
{
	(void)state;
	for (int i = 0; i < 100; i++)
		push(0, EVENT_CONFIG_CHANGED, 1);
	drain_run(&drain, 1);
	assert_int_equal(written("mill: "), 100);
}

static void lost_events_are_told_once(void **state)
{
	(void)state;
	for (int i = 0; i < EVENT_RING + 44; i++)
		push(0, EVENT_SAFE, 1);
	assert_int_equal(drain_run(&drain, 1), EVENT_RING);
	assert_int_equal(written("44 events came faster"), 1);
	drain_run(&drain, 2);
	assert_int_equal(written("events came faster"), 0);
}

static void an_event_of_nobody_and_of_no_kind_does_no_harm(void **state)
{
	(void)state;
	push(255, EVENT_TRANSPORT, -5);
	push(16, (enum event_code)9999, 1);
	push(255, EVENT_CODES, 1);
	assert_int_equal(drain_run(&drain, 1), 3);
	assert_int_equal(written("\n"), 4);
}

/* ---- what readers get */

static struct {
	uint32_t device;
	struct pokeys_event event;
} told[8];
static uint32_t told_count;

static void take(void *context, uint32_t device, const struct pokeys_event *event)
{
	assert_ptr_equal(context, &drain);
	told[told_count % 8].device = device;
	told[told_count++ % 8].event = *event;
}

static uint64_t wall_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_REALTIME, &now);
	return (uint64_t)now.tv_sec * 1000000000 + (uint64_t)now.tv_nsec;
}

static void what_is_written_down_is_told(void **state)
{
	const struct event event = { .t_ns = 5000000000,
				     .code = EVENT_SAFE,
				     .device = 1,
				     .a = 1,
				     .b = 1,
				     .level = EVENT_NOTICE };
	const uint64_t before = wall_ns();

	(void)state;
	teller.show = take;
	teller.context = &drain;
	told_count = 0;
	event_push(&ring, &event);
	drain_run(&drain, 7000000000);
	assert_int_equal(told_count, 1);
	assert_int_equal(told[0].device, 1);
	assert_int_equal(told[0].event.flags, 0);
	assert_string_equal(told[0].event.kind, "safe-state");
	assert_int_equal(told[0].event.level, EVENT_NOTICE);
	assert_int_equal(told[0].event.t_ns, 5000000000);
	assert_in_range(told[0].event.wall_ns, before - 2000000000, wall_ns() - 2000000000);
	assert_int_equal(written(told[0].event.text), 1);
	assert_null(strstr(told[0].event.text, "lathe"));
	for (int i = 0; i < 50; i++)
		push(0, EVENT_STALE, 1);
	drain_run(&drain, 7000000001);
	assert_int_equal(told_count, 1 + LOG_BURST);
	push(0, EVENT_STALE, 1);
	drain_run(&drain, 7000000001 + LOG_WHILE_NS);
	assert_int_equal(told[(told_count - 1) % 8].event.held, 40);
}

/* They are logged, but would push everything else out of what is kept for readers. */
static void settings_do_not_flood_readers(void **state)
{
	(void)state;
	teller.show = take;
	teller.context = &drain;
	told_count = 0;
	for (int i = 0; i < 100; i++)
		push(0, EVENT_CONFIG_CHANGED, 1);
	drain_run(&drain, 1);
	assert_int_equal(written("mill: "), 100);
	assert_int_equal(told_count, LOG_BURST);
	push(0, EVENT_CONFIG_CHANGED, 1);
	drain_run(&drain, 1 + LOG_WHILE_NS);
	assert_int_equal(written("more of this kind"), 0);
	assert_int_equal(told[LOG_BURST % 8].event.held, 90);
}

/* A line a minute, with how many it stands for; the log has its own limit. */
static void what_comes_again_and_again_is_shown_once_a_minute(void **state)
{
	const uint64_t second = 1000000000;

	(void)state;
	teller.show = take;
	teller.context = &drain;
	told_count = 0;
	for (uint64_t i = 0; i < 60; i++) {
		push(0, EVENT_PACKETS, EVENT_PACKETS_MISSED);
		drain_run(&drain, (100 + i) * second);
	}
	assert_int_equal(told_count, 1);
	assert_int_equal(written("mill: "), 60);
	push(1, EVENT_PACKETS, EVENT_PACKETS_MISSED);
	drain_run(&drain, 159 * second);
	assert_int_equal(told_count, 2); /* another device has its own */
	push(0, EVENT_PACKETS, EVENT_PACKETS_MISSED);
	drain_run(&drain, 160 * second);
	assert_int_equal(told_count, 3);
	assert_int_equal(told[2].event.held, 59);
}

static void what_is_for_who_debugs_is_not_told(void **state)
{
	const struct event event = { .code = EVENT_LINK, .level = EVENT_DEBUG };

	(void)state;
	teller.show = take;
	teller.context = &drain;
	told_count = 0;
	event_push(&ring, &event);
	drain_run(&drain, 1);
	assert_int_equal(written("mill: "), 1);
	assert_int_equal(told_count, 0);
}

/* Of the daemon, or of the network: each device's reader may want to know. */
static void what_concerns_no_device_concerns_all(void **state)
{
	(void)state;
	teller.show = take;
	teller.context = &drain;
	told_count = 0;
	push(255, EVENT_TRANSPORT, -5);
	drain_run(&drain, 1);
	assert_int_equal(told_count, 2);
	assert_int_equal(told[1].device, 1);
	assert_string_equal(told[1].event.kind, "transport");
	assert_int_equal(told[1].event.flags, POKEYS_EVENT_ALL_DEVICES);
	for (int i = 0; i < EVENT_RING + 44; i++)
		push(0, EVENT_SAFE, 1);
	drain_run(&drain, 2);
	assert_string_equal(told[(told_count - 1) % 8].event.kind, "events-lost");
	assert_int_equal(told[(told_count - 1) % 8].device, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(an_event_is_written_with_its_device, setup,
						teardown),
		cmocka_unit_test_setup_teardown(noise_of_one_device_hides_no_other, setup,
						teardown),
		cmocka_unit_test_setup_teardown(every_setting_that_was_changed_is_told, setup,
						teardown),
		cmocka_unit_test_setup_teardown(lost_events_are_told_once, setup, teardown),
		cmocka_unit_test_setup_teardown(what_is_written_down_is_told, setup, teardown),
		cmocka_unit_test_setup_teardown(settings_do_not_flood_readers, setup, teardown),
		cmocka_unit_test_setup_teardown(what_comes_again_and_again_is_shown_once_a_minute,
						setup, teardown),
		cmocka_unit_test_setup_teardown(what_is_for_who_debugs_is_not_told, setup,
						teardown),
		cmocka_unit_test_setup_teardown(what_concerns_no_device_concerns_all, setup,
						teardown),
		cmocka_unit_test_setup_teardown(an_event_of_nobody_and_of_no_kind_does_no_harm,
						setup, teardown),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
