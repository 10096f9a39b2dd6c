/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The event ring never waits and never lies about what it dropped, and every
 * event has a line for a person.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <pthread.h>
#include <cmocka.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "daemon/device/event.h"
#include "daemon/device/event_name.h"
#include "wire/op.h"
#include "wire/system.h"

static struct event_ring ring;

static void push(int64_t a)
{
	const struct event event = { .t_ns = 1, .code = EVENT_STALE, .a = a };

	event_push(&ring, &event);
}

static int clear(void **state)
{
	(void)state;
	memset(&ring, 0, sizeof(ring));
	return 0;
}

static void events_come_out_in_order(void **state)
{
	struct event event;

	(void)state;
	assert_int_equal(event_pop(&ring, &event), 0);
	for (int64_t i = 0; i < 1000; i++) {
		push(i);
		assert_int_equal(event_pop(&ring, &event), 1);
		assert_int_equal(event.a, i);
	}
	assert_int_equal(event_pop(&ring, &event), 0);
}

static void full_ring_drops_the_newest_and_counts(void **state)
{
	struct event event;

	(void)state;
	for (int64_t i = 0; i < EVENT_RING + 10; i++)
		push(i);
	assert_int_equal(atomic_load(&ring.dropped), 10);
	assert_int_equal(atomic_load(&ring.high_water), EVENT_RING);
	for (int64_t i = 0; i < EVENT_RING; i++) {
		assert_int_equal(event_pop(&ring, &event), 1);
		assert_int_equal(event.a, i);
	}
	assert_int_equal(event_pop(&ring, &event), 0);
}

static void indices_may_wrap(void **state)
{
	struct event event;

	(void)state;
	atomic_store(&ring.head, UINT32_MAX - 2);
	atomic_store(&ring.tail, UINT32_MAX - 2);
	for (int64_t i = 0; i < 10; i++)
		push(i);
	for (int64_t i = 0; i < 10; i++) {
		assert_int_equal(event_pop(&ring, &event), 1);
		assert_int_equal(event.a, i);
	}
}

enum { MANY = 200000 };

static void *writer(void *context)
{
	(void)context;
	for (int64_t i = 1; i <= MANY; i++)
		push(i);
	return NULL;
}

static void reader_beside_the_writer_sees_whole_events_in_order(void **state)
{
	int64_t last = 0, seen = 0;
	struct event event;
	pthread_t thread;

	(void)state;
	assert_int_equal(pthread_create(&thread, NULL, writer, NULL), 0);
	while (last < MANY && seen + (int64_t)atomic_load(&ring.dropped) < MANY) {
		if (!event_pop(&ring, &event))
			continue;
		assert_true(event.a > last && event.code == EVENT_STALE);
		last = event.a;
		seen++;
	}
	pthread_join(thread, NULL);
	while (event_pop(&ring, &event))
		seen++;
	assert_int_equal(seen + (int64_t)atomic_load(&ring.dropped), MANY);
}

static void every_code_has_a_line_of_its_own(void **state)
{
	char text[EVENT_CODES][256];

	(void)state;
	for (uint16_t code = 1; code < EVENT_CODES; code++) {
		const struct event event = { .code = code, .a = 1, .b = 2, .c = 3 };
		const size_t n = event_format(&event, "mill", text[code], sizeof(text[code]));

		assert_int_equal(n, strlen(text[code]));
		assert_int_equal(strncmp(text[code], "mill: ", 6), 0);
		assert_true(n > 15 && !strchr(text[code], '\n') && !strstr(text[code], "unknown"));
		for (uint16_t other = 1; other < code; other++)
			assert_string_not_equal(text[code], text[other]);
	}
}

static void every_code_has_a_word_of_its_own(void **state)
{
	(void)state;
	for (uint32_t code = 1; code < EVENT_CODES; code++) {
		const char *word = event_kind_name(code);

		assert_in_range(strlen(word), 3, 31);
		assert_int_equal(strspn(word, "abcdefghijklmnopqrstuvwxyz-"), strlen(word));
		assert_string_not_equal(word, event_kind_name(EVENT_CODES));
		for (uint32_t other = 1; other < code; other++)
			assert_string_not_equal(word, event_kind_name(other));
	}
}

/* The texts that somebody has to act upon. */
static void lines_say_what_where_and_what_to_do(void **state)
{
	static const struct {
		struct event event;
		const char *line;
	} rows[] = {
		{ { .code = EVENT_LINK,
		    .a = POKEYS_LINK_LOST,
		    .b = POKEYS_LINK_RUNNING,
		    .c = POKEYS_FAULT_NO_ANSWER },
		  "mill: lost (was running): it does not answer; check power, cable and address, "
		  "and whether sudo pokeysctl discover finds it" },
		{ { .code = EVENT_LINK,
		    .a = POKEYS_LINK_CONFIGURING,
		    .b = POKEYS_LINK_CONFIGURING,
		    .c = POKEYS_FAULT_LOCKED },
		  "mill: still configuring: it is locked" },
		{ { .code = EVENT_LINK,
		    .a = POKEYS_LINK_SEARCHING,
		    .b = POKEYS_LINK_SEARCHING,
		    .c = POKEYS_FAULT_NONE },
		  "mill: still searching: the fault reported before has gone" },
		{ { .code = EVENT_TASK, .a = POKEYS_TASK_HOMING, .b = POKEYS_TASK_TRIPPED, .c = 3 },
		  "mill: homing of axes 0 and 1: stopped by a limit switch or the emergency "
		  "input" },
		{ { .code = EVENT_TASK, .a = POKEYS_TASK_HYBRID_PROBING, .b = POKEYS_TASK_DONE },
		  "mill: hybrid probing: done" },
		{ { .code = EVENT_POSITION_LOST, .a = 4, .b = PLACE_NOT_HOMED },
		  "mill: the position of axis 2 is no longer valid (homing, or setting the "
		  "position, failed); home it" },
		{ { .code = EVENT_POSITION_LOST, .a = 0x8b, .b = PLACE_RESTART },
		  "mill: the positions of axes 0, 1, 3 and 7 are no longer valid (restart or "
		  "exchange of the device); home them" },
		{ { .code = EVENT_STALE, .a = 1, .b = 12000 },
		  "mill: data is stale: 12000 us old" },
		{ { .code = EVENT_STALE, .a = 1, .b = -1 },
		  "mill: data is stale: some of it has not been received yet" },
		{ { .code = EVENT_COMMANDER, .b = 101000 },
		  "mill: the commander's heartbeat is 101000 us late" },
		{ { .code = EVENT_COMMANDER, .b = -1, .c = 1 }, "mill: the commander has ended" },
		{ { .code = EVENT_COMMANDER, .b = -1 },
		  "mill: another commander has begun, or the same one again; "
		  "no heartbeat from it yet" },
		{ { .code = EVENT_LOCKED, .a = LOCK_CONFIGURATION },
		  "mill: settings differ, but its configuration is locked; unlock it or remove "
		  "those settings" },
		{ { .code = EVENT_LOCKED, .a = LOCK_NO_PASSWORD, .b = 255 },
		  "mill: requires a password (level 255); set password-file" },
		{ { .code = EVENT_LOCKED, .a = LOCK_WRONG_PASSWORD, .b = 255 },
		  "mill: rejects the password in password-file (level 255)" },
		{ { .code = EVENT_WRONG_SERIAL, .a = 777, .b = 65432 },
		  "mill: serial number 777 answers, but 65432 is configured; the device is not "
		  "used: check address and serial" },
		{ { .code = EVENT_IDENTIFIED, .a = 65432, .b = 32, .c = 0x04070f },
		  "mill: is serial number 65432, hardware 32, firmware 4.7.15" },
		{ { .code = EVENT_BAD_COMMAND,
		    .a = COMMAND_FAULT_NOT_OFFERED,
		    .b = COMMAND_PART_PONET },
		  "mill: command refused: this device has no PoNET" },
		{ { .code = EVENT_BAD_COMMAND, .a = COMMAND_FAULT_AXIS_VELOCITY, .b = 2 },
		  "mill: command refused: velocity must be a number within +-1e7 pulses/s, axis "
		  "2" },
		{ { .code = EVENT_ONE_SHOT,
		    .a = POKEYS_ONE_SHOT_REBOOT,
		    .b = 9,
		    .c = POKEYS_OUTCOME_REFUSED },
		  "mill: one-shot 9 (reboot): refused" },
		{ { .code = EVENT_ONE_SHOT,
		    .a = POKEYS_ONE_SHOT_HOME,
		    .b = 10,
		    .c = POKEYS_OUTCOME_REFUSED | REFUSAL_NO_HOME_SWITCH << 8 | 2 << 16 },
		  "mill: one-shot 10 (home): refused: axis 2 has no home switch (axis.2.home or "
		  "axis.2.home-shared in pokeysd.conf)" },
		{ { .code = EVENT_ONE_SHOT,
		    .a = POKEYS_ONE_SHOT_SAVE_CONFIG,
		    .b = EVENT_ORDERED,
		    .c = POKEYS_OUTCOME_DONE },
		  "mill: order of a terminal (save configuration): done" },
		{ { .code = EVENT_ENGINE, .a = 101, .b = 3 },
		  "mill: pulse engine stopped by the emergency input; clear the fault "
		  "(in LinuxCNC: reset the emergency stop) to go on" },
		{ { .code = EVENT_TRANSPORT, .a = -101 },
		  "mill: network transport failed: Network is unreachable" },
		{ { .code = EVENT_TRANSPORT, .a = -99 },
		  "mill: network transport failed: Cannot assign requested address; the interface "
		  "has no address of its own (ip address); retrying" },
		{ { .code = EVENT_TRANSPORT, .a = -19 },
		  "mill: network transport failed: No such device; the interface is not there "
		  "(ip link); retrying" },
		{ { .code = EVENT_NOT_SAFE, .a = 1000, .b = WIRE_FAILSAFE_ALL },
		  "mill: the safe state was not acknowledged: outputs may still be on, axes may "
		  "still move; its own failsafe acts 1000 ms after the last packet; look at the "
		  "machine, then whether it answers (pokeysctl discover)" },
		{ { .code = EVENT_NOT_SAFE, .a = 25500, .b = WIRE_FAILSAFE_PWM },
		  "mill: the safe state was not acknowledged: outputs may still be on, axes may "
		  "still move; its own failsafe acts 25500 ms after the last packet "
		  "(failsafe-parts 4); look at the machine, then whether it answers (pokeysctl "
		  "discover)" },
		{ { .code = EVENT_NOT_SAFE, .a = 0 },
		  "mill: the safe state was not acknowledged: outputs may still be on, axes may "
		  "still move; its own failsafe is off, and nothing else stops them; look at the "
		  "machine, then whether it answers (pokeysctl discover)" },
		{ { .code = EVENT_NOT_SAFE, .a = -1 },
		  "mill: the safe state was not acknowledged: outputs may still be on, axes may "
		  "still move; its own failsafe is not known; look at the machine, then whether "
		  "it answers (pokeysctl discover)" },
	};
	char text[256];

	(void)state;
	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
		event_format(&rows[i].event, "mill", text, sizeof(text));
		assert_string_equal(text, rows[i].line);
	}
}

static void numbers_out_of_every_table_do_no_harm(void **state)
{
	static const int64_t odd[] = { -1, INT64_MIN, INT64_MAX, 99, 1 << 20 };
	char text[64];

	(void)state;
	for (unsigned int code = 0; code < 70000; code += code < 40 ? 1 : 997) {
		for (size_t i = 0; i < sizeof(odd) / sizeof(odd[0]); i++) {
			const struct event event = {
				.code = (uint16_t)code,
				.a = odd[i],
				.b = odd[i],
				.c = odd[i],
			};

			for (size_t size = 0; size <= sizeof(text); size++) {
				memset(text, 'x', sizeof(text));
				const size_t n = event_format(&event, NULL, text, size);

				assert_true(size ? n < size && !text[n] : n == 0);
				assert_true(size == sizeof(text) || text[size] == 'x');
			}
		}
	}
}

static void texts_are_for_people(void **state)
{
	static const struct {
		struct event event;
		const char *text;
	} cases[] = {
		{ { .code = EVENT_CONFIG_CHANGED, .a = WIRE_OP_PIN_ALL, .b = 31, .c = 0x04 },
		  "mill: terminal 31: digital output (not saved in the device)" },
		{ { .code = EVENT_CONFIG_CHANGED, .a = WIRE_OP_PIN_ALL, .b = 8, .c = 0x82 },
		  "mill: terminal 8: digital input, inverted (not saved in the device)" },
		{ { .code = EVENT_CONFIG_CHANGED, .a = WIRE_OP_PULSE_AXIS_SET, .b = 0, .c = 13 },
		  "mill: axis 0 configured (not saved in the device)" },
		{ { .code = EVENT_CONFIG_CHANGED, .a = WIRE_OP_FAILSAFE, .b = -1, .c = 5 },
		  "mill: failsafe configured (not saved in the device)" },
		{ { .code = EVENT_PACKETS, .a = EVENT_PACKETS_MISSED, .b = 1 },
		  "mill: 1 request without a reply by its deadline" },
		{ { .code = EVENT_PACKETS, .a = EVENT_PACKETS_MISSED, .b = 2 },
		  "mill: 2 requests without a reply by their deadline" },
		{ { .code = EVENT_CYCLE_SKIPPED, .a = 1 },
		  "mill: 1 cycle was missed; is something else on this core?" },
		{ { .code = EVENT_CYCLE_SKIPPED, .a = 2 },
		  "mill: 2 cycles were missed; is something else on this core?" },
	};
	char text[256];

	(void)state;
	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		event_format(&cases[i].event, "mill", text, sizeof(text));
		assert_string_equal(text, cases[i].text);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(events_come_out_in_order, clear),
		cmocka_unit_test_setup(full_ring_drops_the_newest_and_counts, clear),
		cmocka_unit_test_setup(indices_may_wrap, clear),
		cmocka_unit_test_setup(reader_beside_the_writer_sees_whole_events_in_order, clear),
		cmocka_unit_test(every_code_has_a_line_of_its_own),
		cmocka_unit_test(every_code_has_a_word_of_its_own),
		cmocka_unit_test(lines_say_what_where_and_what_to_do),
		cmocka_unit_test(numbers_out_of_every_table_do_no_harm),
		cmocka_unit_test(texts_are_for_people),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
