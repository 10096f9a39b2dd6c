/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Rule 4, the writer's port lives as long as its entry: a commander that is
 * killed at any moment leaves a place that the daemon can clear, and the next
 * one has it within a second.
 *
 * What the rule is for: with the port dropped after the entry was
 * made (ImageWriter without `_port`), the next commander is refused for ever
 * with "another commander holds device", in the first round.
 */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tests/shm/folder.h"

enum { NEXT_MS = 60000 };

/* Let the daemon do its housekeeping until the client is attached, or time is up. */
static unsigned int attach_within(struct shm_host *host, pokeys_client *client, unsigned int ms)
{
	uint64_t began = folder_now_ns();
	uint64_t spent;

	do {
		assert_true(shm_host_maintain(host) >= 0);
		spent = (folder_now_ns() - began) / 1000000;
		if (pokeys_client_poll(client) == POKEYS_CLIENT_ATTACHED)
			return (unsigned int)spent;
		folder_sleep_ms(20);
	} while (spent < ms);
	return ms;
}

static void await_command(struct shm_device *mill, struct pokeys_command *command)
{
	for (int i = 0; i < NEXT_MS; i++) {
		if (shm_device_read_command(mill, command) == 1)
			return;
		folder_sleep_ms(1);
	}
	fail_msg("no command within %d ms", NEXT_MS);
}

static void killed_commander_is_followed_by_the_next(void **state)
{
	unsigned int rounds = folder_count("POKEYS_KILLS", 30);
	struct folder *folder = *state;
	struct pokeys_command command;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client;
	char said[256];
	pid_t commander;

	srand(folder_seed());
	for (unsigned int i = 0; i < rounds; i++) {
		commander = folder_peer(folder, "commander", i % 3 ? said : NULL);
		usleep((useconds_t)rand() % 10000);
		folder_end_peer(commander, SIGKILL);
		client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
		if (attach_within(host, client, NEXT_MS) == NEXT_MS)
			fail_msg("round %u: %s", i, folder_status(folder, client));
		memset(&command, 0, sizeof(command));
		command.heartbeat = i + 1;
		assert_int_equal(pokeys_client_write(client, &command), 0);
		assert_int_equal(shm_device_read_command(mill, &command), 1);
		assert_int_equal(command.heartbeat, i + 1);
		pokeys_client_close(client);
		assert_int_equal(shm_device_commanders(mill), 0);
	}
	shm_host_close(host);
}

static void dead_commander_is_cleared_and_its_wish_forgotten(void **state)
{
	struct folder *folder = *state;
	struct pokeys_command command;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char said[256];
	pid_t commander = folder_peer(folder, "commander", said);

	await_command(mill, &command);
	folder_end_peer(commander, SIGKILL);
	assert_int_equal(shm_device_commanders(mill), 1);
	assert_int_equal(shm_host_maintain(host), 1);
	assert_int_equal(shm_device_commanders(mill), 0);
	assert_int_equal(shm_device_read_command(mill, &command), 0);
	assert_int_equal(shm_host_maintain(host), 0);
	shm_host_close(host);
}

static void before_it_is_cleared_the_reason_is_said(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	char said[256], who[64];
	pid_t commander = folder_peer(folder, "commander", said);

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_REFUSED);
	snprintf(who, sizeof(who), "another commander holds device 'mill': process %d (",
		 (int)commander);
	assert_non_null(strstr(folder_status(folder, client), who));
	folder_end_peer(commander, SIGKILL);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_REFUSED);
	assert_non_null(strstr(folder_status(folder, client), "the daemon is clearing its place"));
	assert_true(attach_within(host, client, NEXT_MS) < NEXT_MS);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void commander_that_ends_makes_room_at_once(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	char said[256];
	pid_t commander = folder_peer(folder, "commander", said);

	assert_int_equal(folder_end_peer(commander, SIGTERM), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void stopped_commander_keeps_its_place(void **state)
{
	struct folder *folder = *state;
	struct pokeys_command first, later;
	int status;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	char said[256];
	pid_t commander = folder_peer(folder, "commander", said);

	await_command(mill, &first);
	kill(commander, SIGSTOP);
	assert_int_equal(waitpid(commander, &status, WUNTRACED), commander);
	assert_true(WIFSTOPPED(status));
	assert_int_equal(shm_device_read_command(mill, &first), 1);
	assert_int_equal(shm_host_maintain(host), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_REFUSED);
	assert_int_equal(shm_device_read_command(mill, &later), 1);
	assert_int_equal(later.heartbeat, first.heartbeat);
	kill(commander, SIGCONT);
	folder_end_peer(commander, SIGTERM);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void other_devices_keep_their_commander(void **state)
{
	static const char *const names[] = { "mill", "lathe", NULL };
	struct folder *folder = *state;
	struct pokeys_command command = { .heartbeat = 77 };
	struct shm_device *devices[2];
	struct shm_host *host = folder_host(folder, devices, names);
	pokeys_client *client;
	char said[256];
	pid_t commander;

	assert_int_equal(pokeys_client_open(&client, folder->path, "lathe", "test",
					    POKEYS_CLIENT_COMMANDER),
			 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	pokeys_client_write(client, &command);
	commander = folder_peer(folder, "commander", said);
	folder_end_peer(commander, SIGKILL);
	assert_int_equal(shm_host_maintain(host), 1);
	assert_int_equal(shm_device_read_command(devices[1], &command), 1);
	command.heartbeat++;
	assert_int_equal(pokeys_client_write(client, &command), 0);
	assert_int_equal(shm_device_read_command(devices[1], &command), 1);
	assert_int_equal(command.heartbeat, 78);
	pokeys_client_close(client);
	shm_host_close(host);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(killed_commander_is_followed_by_the_next),
		BOTH(dead_commander_is_cleared_and_its_wish_forgotten),
		BOTH(before_it_is_cleared_the_reason_is_said),
		BOTH(commander_that_ends_makes_room_at_once),
		BOTH(stopped_commander_keeps_its_place),
		BOTH(other_devices_keep_their_commander),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
