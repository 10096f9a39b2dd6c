/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A client that sees no /proc, or not the processes of others in it: that
 * tells it nothing about who lives.
 */
#include <errno.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tests/shm/folder.h"

enum { NOT_PERMITTED = 77 };

/* In a child for which an empty folder stands at `place`; its client's status. */
static int poll_without(struct folder *folder, const char *place, unsigned int flags,
			const char *words)
{
	pokeys_client *client;
	int result, status;
	pid_t pid = fork();

	if (!pid) {
		if (unshare(CLONE_NEWNS) || mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) ||
		    mount("tmpfs", place, "tmpfs", 0, "size=4k"))
			_exit(NOT_PERMITTED);
		client = folder_client(folder, flags);
		result = (int)pokeys_client_poll(client);
		if (!strstr(folder_status(folder, client), words)) {
			fprintf(stderr, "it said: %s\n", folder->why);
			result = 9;
		}
		pokeys_client_close(client);
		_exit(result);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status));
	return WEXITSTATUS(status);
}

static void client_without_proc_attaches(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	int result = poll_without(folder, "/proc", POKEYS_CLIENT_COMMANDER, "attached");

	shm_host_close(host);
	if (result == NOT_PERMITTED)
		skip();
	assert_int_equal(result, POKEYS_CLIENT_ATTACHED);
}

static void commander_that_is_hidden_is_not_called_dead(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char said[256], place[32];
	pid_t peer = folder_peer(folder, "commander", said);
	int result;

	snprintf(place, sizeof(place), "/proc/%d", (int)peer);
	result = poll_without(folder, place, POKEYS_CLIENT_COMMANDER,
			      "another commander holds device 'mill'");
	folder_end_peer(peer, SIGKILL);
	shm_host_maintain(host);
	shm_host_close(host);
	if (result == NOT_PERMITTED)
		skip();
	assert_int_equal(result, POKEYS_CLIENT_REFUSED);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(client_without_proc_attaches),
		BOTH(commander_that_is_hidden_is_not_called_dead),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
