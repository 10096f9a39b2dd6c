/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The events in the mirror: each comes once, the last are kept, none is torn, and a reader goes
 * on with those of the next daemon. Damaged rings are tried in mirror.c.
 */
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include "tests/shm/folder.h"

static void say_events(struct shm_device *device, uint64_t first, uint64_t last)
{
	for (uint64_t i = first; i <= last; i++) {
		struct pokeys_event event = {
			.t_ns = i, .wall_ns = ~i, .level = 4, .held = (uint32_t)i, .kind = "link"
		};

		memset(event.text, (int)('a' + i % 26), sizeof(event.text) - 1);
		shm_device_write_event(device, &event);
	}
}

static void assert_event(const struct pokeys_event *event, uint64_t number)
{
	char text[sizeof(event->text)] = "";

	assert_int_equal(event->number, number);
	assert_int_equal(event->t_ns, number);
	assert_int_equal(event->wall_ns, ~number);
	assert_int_equal(event->held, (uint32_t)number);
	memset(text, (int)('a' + number % 26), sizeof(text) - 1);
	assert_string_equal(event->text, text);
	assert_string_equal(event->kind, "link");
}

static int read_events(pokeys_client *client, struct pokeys_events_cursor *cursor,
		       struct pokeys_event *out, size_t max)
{
	return pokeys_client_read_events(client, cursor, out, sizeof(*out), max);
}

static void events_come_once_and_the_last_are_kept(void **state)
{
	static struct pokeys_event events[200];
	struct pokeys_events_cursor cursor = { 0 };
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_EVENTS);

	assert_int_equal(read_events(client, &cursor, events, 200), -ENOTCONN);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(read_events(client, &cursor, events, 200), 0);
	while (pokeys_client_wait(client, 0))
		;
	say_events(mill, 1, 5);
	assert_int_equal(pokeys_client_wait(client, 0), 1);
	assert_int_equal(read_events(client, &cursor, events, 2), 2);
	assert_event(&events[1], 2);
	assert_int_equal(read_events(client, &cursor, events, 200), 3);
	assert_event(&events[0], 3);
	assert_int_equal(read_events(client, &cursor, events, 200), 0);
	assert_int_equal(cursor.epoch, shm_host_epoch(host));
	say_events(mill, 6, 1000);
	assert_int_equal(read_events(client, &cursor, events, 200), POKEYS_EVENTS_KEPT);
	for (uint64_t i = 0; i < POKEYS_EVENTS_KEPT; i++)
		assert_event(&events[i], 1001 - POKEYS_EVENTS_KEPT + i);
	assert_int_equal(pokeys_client_read_events(client, &cursor, events, sizeof(events[0]) - 8,
						   200),
			 -EINVAL);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void the_next_daemons_events_begin_anew(void **state)
{
	static struct pokeys_event events[8];
	struct pokeys_events_cursor cursor = { 0 };
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, 0);
	pokeys_client *commander = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	say_events(mill, 1, 3);
	assert_int_equal(read_events(client, &cursor, events, 8), 3);
	say_events(mill, 4, 4);
	shm_host_close(host);
	assert_int_equal(read_events(client, &cursor, events, 8), 1); /* its last words */
	host = folder_host_mill(folder, &mill);
	say_events(mill, 1, 2);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(read_events(client, &cursor, events, 8), 2);
	assert_event(&events[0], 1);
	assert_int_equal(read_events(commander, &cursor, events, 8), -EPERM);
	pokeys_client_close(commander);
	pokeys_client_close(client);
	shm_host_close(host);
}

static _Atomic bool overtaken_enough;

static void *say_many(void *mill)
{
	for (uint64_t i = 1; !overtaken_enough; i++)
		say_events(mill, i, i);
	return NULL;
}

/* It is overtaken again and again, and what it has is whole all the same. */
static void no_event_is_torn(void **state)
{
	static struct pokeys_event events[64];
	struct pokeys_events_cursor cursor = { 0 };
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	uint64_t last = 0;
	unsigned int gaps = 0;
	pthread_t writer;
	int count;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pthread_create(&writer, NULL, say_many, mill), 0);
	while (gaps < 200) {
		count = read_events(client, &cursor, events, 64);
		for (int i = 0; i < count; i++) {
			assert_event(&events[i], events[i].number);
			assert_true(events[i].number > last);
			gaps += events[i].number != last + 1;
			last = events[i].number;
		}
	}
	overtaken_enough = true;
	pthread_join(writer, NULL);
	pokeys_client_close(client);
	shm_host_close(host);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(events_come_once_and_the_last_are_kept),
		BOTH(the_next_daemons_events_begin_anew),
		BOTH(no_event_is_torn),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
