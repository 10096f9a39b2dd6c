/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Many readers, killed ones and stopped ones: the daemon's writes go on, and
 * nothing is left of them.
 */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tests/shm/folder.h"

enum { MANY = 20, ANY = 200 };

static void twenty_processes_read_while_the_daemon_publishes(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	struct pokeys_state image;
	char said[256];
	pid_t readers[MANY];

	for (int i = 0; i < MANY; i++) {
		readers[i] = folder_peer(folder, "reader", said);
		assert_string_equal(said, "ready");
		kill(readers[i], SIGSTOP); /* two cores are not for 20 that spin */
	}
	for (uint64_t cycle = 1; cycle < 1000; cycle++) {
		folder_pattern(&image, cycle);
		shm_device_write(mill, &image);
	}
	for (int i = 0; i < MANY; i++) {
		kill(readers[i], SIGCONT);
		if (i % 2)
			folder_end_peer(readers[i], SIGKILL);
		else
			assert_int_equal(folder_end_peer(readers[i], SIGTERM), 0);
	}
	assert_int_equal(shm_host_maintain(host), 0); /* nobody leaves anything behind */
	shm_host_close(host);
}

static void there_may_be_any_number_of_readers(void **state)
{
	pokeys_client *clients[ANY], *commander;
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	struct pokeys_state image;

	for (int i = 0; i < ANY; i++) {
		clients[i] = folder_client(folder, 0);
		assert_int_equal(pokeys_client_poll(clients[i]), POKEYS_CLIENT_ATTACHED);
	}
	commander = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	assert_int_equal(pokeys_client_poll(commander), POKEYS_CLIENT_ATTACHED);
	folder_pattern(&image, 7);
	shm_device_write(mill, &image);
	for (int i = 0; i < ANY; i++) {
		assert_int_equal(pokeys_client_read(clients[i], &image), 0);
		assert_int_equal(image.cycle, 7);
		pokeys_client_close(clients[i]);
	}
	pokeys_client_close(commander);
	shm_host_close(host);
}

static void killed_readers_leave_nothing(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char said[256];

	for (int i = 0; i < MANY; i++) {
		folder_end_peer(folder_peer(folder, "reader", said), SIGKILL);
		assert_string_equal(said, "ready");
		assert_int_equal(shm_host_maintain(host), 0);
	}
	shm_host_close(host);
}

static void reader_stopped_in_its_read_does_not_hold_up_the_daemon(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_state image;
	char said[256];
	pid_t reader = folder_peer(folder, "reader", said);

	pokeys_client_poll(client);
	for (uint64_t cycle = 1; cycle < 200; cycle++) {
		kill(reader, SIGSTOP);
		for (int i = 0; i < 5; i++) {
			folder_pattern(&image, cycle);
			shm_device_write(mill, &image);
		}
		assert_int_equal(pokeys_client_read(client, &image), 0);
		assert_int_equal(image.cycle, cycle);
		assert_int_equal(shm_host_maintain(host), 0);
		kill(reader, SIGCONT);
	}
	assert_int_equal(folder_end_peer(reader, SIGTERM), 0);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void killed_listener_does_not_silence_the_others(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_EVENTS);
	char said[256];
	pid_t listener = folder_peer(folder, "listener", said);

	assert_string_equal(said, "ready");
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	for (int i = 0; i < 3; i++) {
		shm_device_notify(mill);
		assert_int_equal(pokeys_client_wait(client, 10000), 1);
		if (!i)
			folder_end_peer(listener, SIGKILL);
	}
	assert_int_equal(shm_host_maintain(host), 0);
	shm_device_notify(mill);
	assert_int_equal(pokeys_client_wait(client, 10000), 1);
	pokeys_client_close(client);
	shm_host_close(host);
}

/* The daemon goes on, the listener finds one notification. */
static void listener_that_never_listens_holds_up_nobody(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_EVENTS);

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	for (int i = 0; i < 5000; i++)
		shm_device_notify(mill);
	assert_int_equal(pokeys_client_wait(client, 1000), 1);
	pokeys_client_close(client);
	shm_host_close(host);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(twenty_processes_read_while_the_daemon_publishes),
		BOTH(there_may_be_any_number_of_readers),
		BOTH(killed_readers_leave_nothing),
		BOTH(reader_stopped_in_its_read_does_not_hold_up_the_daemon),
		BOTH(killed_listener_does_not_silence_the_others),
		BOTH(listener_that_never_listens_holds_up_nobody),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
