/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Rule 1, a fresh root for each start: the daemon is killed at random moments
 * while clients stay attached, again and again, and each time the next one
 * must start, be found, and leave nothing of the dead one behind.
 *
 * POKEYS_KILLS sets the number of rounds, POKEYS_SEED the moments. How it
 * fails without the rule is shown by the last test.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/iox.h"
#include "tests/shm/folder.h"

enum { CLIENTS = 3, FOUND_MS = 60000 };

struct resources {
	int descriptors, mappings, threads;
};

static int count_entries(const char *path)
{
	DIR *folder = opendir(path);
	int count = 0;

	while (folder && readdir(folder))
		count++;
	if (folder)
		closedir(folder);
	return count;
}

static struct resources resources(void)
{
	struct resources now = {
		.descriptors = count_entries("/proc/self/fd"),
		.threads = count_entries("/proc/self/task"),
	};
	FILE *maps = fopen("/proc/self/maps", "r");
	char line[512];

	/* only files: the heap's arenas come and go as they like */
	while (fgets(line, sizeof(line), maps))
		now.mappings += strchr(line, '/') != NULL;
	fclose(maps);
	return now;
}

static uint64_t current_epoch(const struct folder *folder)
{
	char path[64], target[64] = "";

	snprintf(path, sizeof(path), "%s/current", folder->path);
	if (readlink(path, target, sizeof(target) - 1) < 3)
		return 0;
	return strtoull(target + 2, NULL, 16);
}

/* All of them read what the daemon of now has written, or time is up. */
static bool all_found(struct folder *folder, pokeys_client **clients)
{
	uint64_t began = folder_now_ns();
	struct pokeys_state state;
	int found;

	do {
		found = 0;
		for (int i = 0; i < CLIENTS; i++)
			found += !pokeys_client_read(clients[i], &state) &&
				 state.epoch == current_epoch(folder) &&
				 folder_pattern_whole(&state);
		if (found == CLIENTS)
			return true;
		folder_sleep_ms(1);
	} while (folder_now_ns() - began < FOUND_MS * UINT64_C(1000000));
	for (int i = 0; i < CLIENTS; i++)
		fprintf(stderr, "client %d: %s\n", i, folder_status(folder, clients[i]));
	return false;
}

static void open_clients(struct folder *folder, pokeys_client **clients)
{
	clients[0] = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	clients[1] = folder_client(folder, POKEYS_CLIENT_EVENTS);
	clients[2] = folder_client(folder, 0);
	for (int i = 0; i < CLIENTS; i++)
		assert_int_equal(pokeys_client_follow(clients[i], 5), 0);
}

static void killed_daemon_is_followed_by_the_next(void **state)
{
	unsigned int rounds = folder_count("POKEYS_KILLS", 30);
	struct folder *folder = *state;
	struct resources first = { 0 }, now;
	pokeys_client *clients[CLIENTS];
	struct shm_device *mill;
	char said[256];
	pid_t daemon;

	srand(folder_seed());
	open_clients(folder, clients);
	for (unsigned int i = 0; i < rounds; i++) {
		daemon = folder_peer(folder, "host", said);
		assert_string_equal(said, "ready");
		assert_true(all_found(folder, clients));
		now = resources();
		if (!i)
			first = now;
		assert_int_equal(now.descriptors, first.descriptors);
		assert_int_equal(now.mappings, first.mappings);
		assert_int_equal(now.threads, first.threads);
		/* lock, current, monitor, e.* */
		assert_int_equal(count_entries(folder->path), 2 + 4);
		folder_sleep_ms((unsigned int)rand() % 20);
		folder_end_peer(daemon, SIGKILL);
	}
	for (int i = 0; i < CLIENTS; i++)
		pokeys_client_close(clients[i]);
	shm_host_close(folder_host_mill(folder, &mill)); /* removes what the last one left */
}

static void daemon_killed_while_it_starts_is_followed_by_the_next(void **state)
{
	unsigned int rounds = folder_count("POKEYS_KILLS", 30);
	struct folder *folder = *state;
	struct shm_device *mill;
	pid_t daemon;

	srand(folder_seed());
	for (unsigned int i = 0; i < rounds; i++) {
		daemon = folder_peer(folder, "host", NULL);
		usleep((useconds_t)rand() % 8000); /* it needs about 5 ms */
		folder_end_peer(daemon, SIGKILL);
	}
	shm_host_close(folder_host_mill(folder, &mill));
}

static void dead_daemon_stays_readable_until_the_next(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_state before, after;
	struct shm_device *mill;
	char said[256];
	pid_t daemon = folder_peer(folder, "host", said);

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	folder_end_peer(daemon, SIGKILL);
	assert_int_equal(pokeys_client_read(client, &before), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pokeys_client_read(client, &after), 0);
	assert_int_equal(before.cycle, after.cycle); /* it ages: the reader's clock tells */
	pokeys_client_close(client);
	shm_host_close(folder_host_mill(folder, &mill));
}

static void touch(const struct folder *folder, const char *name)
{
	char path[64];

	snprintf(path, sizeof(path), "%s/%s", folder->path, name);
	assert_int_equal(close(open(path, O_CREAT | O_WRONLY, 0600)), 0);
}

static int clear(struct folder *folder)
{
	return shm_host_clear(folder->path, folder->why, sizeof(folder->why));
}

/* The next one may never come, or end before it has taken the folder. */
static void dead_daemon_is_cleared_without_a_next_one(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_state image;
	char said[256], path[64];
	pid_t daemon = folder_peer(folder, "host", said);

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	touch(folder, "control");
	touch(folder, "recorder");
	folder_end_peer(daemon, SIGKILL);
	assert_int_equal(clear(folder), 0);
	assert_string_equal(folder->why, "");
	assert_int_equal(count_entries(folder->path), 2 + 1);
	snprintf(path, sizeof(path), "%s/recorder", folder->path);
	assert_int_equal(unlink(path), 0); /* that was the one */
	assert_int_equal(pokeys_client_read(client, &image), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_DETACHED);
	assert_non_null(strstr(folder_status(folder, client), "is pokeysd running?"));
	pokeys_client_close(client);
}

static void nothing_of_a_living_daemon_is_cleared(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, 0);
	char said[256], who[64];
	pid_t daemon = folder_peer(folder, "host", said);
	int entries = count_entries(folder->path);

	snprintf(who, sizeof(who), "another pokeysd (pid %d) holds %s;", (int)daemon, folder->path);
	assert_int_equal(clear(folder), -EBUSY);
	assert_non_null(strstr(folder->why, who));
	assert_int_equal(count_entries(folder->path), entries);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	pokeys_client_close(client);
	assert_int_equal(folder_end_peer(daemon, SIGTERM), 0);
}

/* Named by mistake: without a lock there never was a daemon, whatever is called as its files. */
static void where_no_daemon_was_nothing_is_cleared(void **state)
{
	struct folder *folder = *state;
	char path[64];
	int fd;

	assert_int_equal(clear(folder), 0);
	assert_int_equal(access(folder->path, F_OK), -1);
	mkdir(folder->path, 0700);
	touch(folder, "control");
	touch(folder, "e.12");
	snprintf(path, sizeof(path), "%s/current", folder->path);
	assert_int_equal(symlink("release-7", path), 0);
	assert_int_equal(clear(folder), 0);
	assert_string_equal(folder->why, "");
	assert_int_equal(count_entries(folder->path), 2 + 3);
	touch(folder, "lock"); /* somebody else's */
	assert_int_equal(clear(folder), 0);
	assert_int_equal(count_entries(folder->path), 2 + 4);
	snprintf(path, sizeof(path), "%s/lock", folder->path);
	fd = open(path, O_WRONLY);
	assert_int_equal(write(fd, "12345\n", 6), 6);
	close(fd);
	assert_int_equal(clear(folder), 0);
	assert_int_equal(count_entries(folder->path), 2);
}

/* Who asks again hears it again, until there is nothing in the way. */
static void what_cannot_be_cleared_is_told_each_time(void **state)
{
	static const char *const names[] = { "current", ".current", "control" };
	struct folder *folder = *state;
	char said[256], path[64];

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		folder_end_peer(folder_peer(folder, "host", said), SIGKILL);
		snprintf(path, sizeof(path), "%s/%s", folder->path, names[i]);
		unlink(path);
		assert_int_equal(mkdir(path, 0700), 0);
		for (unsigned int again = 0; again < 3; again++) {
			assert_int_equal(clear(folder), -EISDIR);
			assert_non_null(strstr(folder->why, path));
			/* nothing else of the daemon's is there but its lock */
			assert_int_equal(count_entries(folder->path), 2 + 2);
		}
		assert_int_equal(rmdir(path), 0);
		assert_int_equal(clear(folder), 0);
		assert_string_equal(folder->why, "");
		assert_int_equal(count_entries(folder->path), 2);
	}
}

static void client_may_outlive_the_folder(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	struct pokeys_state image;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	shm_host_close(host);
	assert_int_equal(rmdir(folder->path), 0);
	assert_int_equal(pokeys_client_read(client, &image), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_DETACHED);
	pokeys_client_close(client);
}

static void clean_end_leaves_nothing(void **state)
{
	struct folder *folder = *state;
	char said[256];
	pid_t daemon = folder_peer(folder, "host", said);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_EVENTS);

	pokeys_client_poll(client);
	assert_int_equal(folder_end_peer(daemon, SIGTERM), 0);
	assert_int_equal(count_entries(folder->path), 2);
	pokeys_client_close(client);
}

/*
 * The rule broken: one root for ever. A reader stays attached, the daemon is
 * killed, the next one cleans up, opens what is there and may not write.
 */
static void without_a_fresh_root_the_next_daemon_may_not_write(void **state)
{
	struct folder *folder = *state;
	struct iox_state_reader *reader;
	struct iox_node *node;
	char said[256];
	pid_t daemon;

	daemon = folder_peer_at(folder->base, "fixed", said);
	assert_string_equal(said, "ready");
	assert_int_equal(iox_node_open(folder->base, "reader", &node, NULL), 0);
	assert_int_equal(iox_state_reader_open(node, "pokeys/mill/state", &reader, NULL), 0);
	folder_end_peer(daemon, SIGKILL);
	daemon = folder_peer_at(folder->base, "fixed", said);
	assert_string_equal(said, "ExceedsMaxSupportedWriters");
	folder_end_peer(daemon, SIGKILL);
	iox_state_reader_close(reader);
	iox_node_close(node);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(killed_daemon_is_followed_by_the_next),
		BOTH(daemon_killed_while_it_starts_is_followed_by_the_next),
		BOTH(dead_daemon_stays_readable_until_the_next),
		BOTH(dead_daemon_is_cleared_without_a_next_one),
		BOTH(nothing_of_a_living_daemon_is_cleared),
		BOTH(where_no_daemon_was_nothing_is_cleared),
		BOTH(what_cannot_be_cleared_is_told_each_time),
		BOTH(client_may_outlive_the_folder),
		BOTH(clean_end_leaves_nothing),
		BOTH(without_a_fresh_root_the_next_daemon_may_not_write),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
