/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The daemon cleans up after the dead in a folder where its whole group may put anything: it
 * waits for nobody, follows no link, and believes nothing but the kernel's locks.
 */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "tests/shm/folder.h"

static char *in_nodes(const struct folder *folder, const char *format, const char *id)
{
	static char path[256];
	int length = snprintf(path, sizeof(path), "%s/current/nodes/", folder->path);

	snprintf(path + length, sizeof(path) - (size_t)length, format, id);
	return path;
}

static void put(const char *path, mode_t mode, off_t size)
{
	int fd = open(path, O_CREAT | O_EXCL | O_WRONLY, 0600);

	assert_true(fd >= 0);
	assert_int_equal(fchmod(fd, mode) || ftruncate(fd, size), 0);
	close(fd);
}

/* As iceoryx2 makes it, of a process that is gone. */
static void put_dead(const struct folder *folder, const char *id)
{
	put(in_nodes(folder, "p%s.node_monitor", id), 0666, 0);
	put(in_nodes(folder, "p%s.node_monitor_owner_lock", id), 0666, 0);
	put(in_nodes(folder, "p%s.node_monitor_context", id), 0444, 16);
}

static bool is_there(const char *path)
{
	struct stat status;

	return !lstat(path, &status);
}

static void assert_gone(const struct folder *folder, const char *id)
{
	assert_false(is_there(in_nodes(folder, "p%s.node_monitor", id)));
	assert_false(is_there(in_nodes(folder, "p%s.node_monitor_owner_lock", id)));
	assert_false(is_there(in_nodes(folder, "p%s.node_monitor_context", id)));
	assert_false(is_there(in_nodes(folder, "%s", id)));
}

static void links_are_not_followed(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char victim[64], file[80];

	snprintf(victim, sizeof(victim), "%s/victim", folder->base);
	snprintf(file, sizeof(file), "%s/p1.port_tag", victim);
	assert_int_equal(mkdir(victim, 0700), 0);
	put(file, 0600, 0);
	put_dead(folder, "77");
	assert_int_equal(symlink(victim, in_nodes(folder, "%s", "77")), 0);
	/* and one in the place of a file that is asked for its lock */
	put(in_nodes(folder, "p%s.node_monitor_context", "78"), 0444, 16);
	assert_int_equal(symlink(file, in_nodes(folder, "p%s.node_monitor", "78")), 0);
	assert_int_equal(shm_host_maintain(host), 2);
	assert_gone(folder, "77");
	assert_gone(folder, "78");
	assert_true(is_there(file));
	unlink(file);
	rmdir(victim);
	shm_host_close(host);
}

static void nothing_is_waited_for(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);

	put(in_nodes(folder, "p%s.node_monitor_context", "5"), 0444, 16);
	assert_int_equal(mkfifo(in_nodes(folder, "p%s.node_monitor", "5"), 0666), 0);
	assert_int_equal(mkfifo(in_nodes(folder, "p%s.node_monitor_owner_lock", "5"), 0666), 0);
	assert_int_equal(mkdir(in_nodes(folder, "%s", "5"), 0777), 0);
	assert_int_equal(mkfifo(in_nodes(folder, "%s/pnode.details", "5"), 0666), 0);
	put_dead(folder, "6");
	assert_int_equal(mkdir(in_nodes(folder, "%s", "6"), 0777), 0);
	put(in_nodes(folder, "%s/pnode.details", "6"), 0444, (off_t)1 << 40);
	assert_int_equal(shm_host_maintain(host), 2);
	assert_gone(folder, "5");
	assert_gone(folder, "6");
	assert_int_equal(shm_host_maintain(host), 0);
	shm_host_close(host);
}

/* Names that are none, numbers that are too large, a node that just begins. */
static void what_is_no_node_is_left(void **state)
{
	static const char *const ids[] = {
		"",
		"x",
		"1x",
		"-1",
		"07",
		"999999999999999999999999999999999999999",
		"9999999999999999999999999999999999999999999999999",
		NULL,
	};
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);

	for (size_t i = 0; ids[i]; i++)
		put_dead(folder, ids[i]);
	put(in_nodes(folder, "p%s.node_monitor", "8"), 0200, 0);
	put(in_nodes(folder, "p%s.node_monitor_context", "8"), 0200, 0);
	assert_int_equal(shm_host_maintain(host), 0);
	for (size_t i = 0; ids[i]; i++)
		assert_true(is_there(in_nodes(folder, "p%s.node_monitor", ids[i])));
	assert_true(is_there(in_nodes(folder, "p%s.node_monitor", "8")));
	shm_host_close(host);
}

/* Whatever is there, the place of a commander that died is cleared. */
static void a_dead_commander_is_found_among_them(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char said[256];

	put(in_nodes(folder, "p%s.node_monitor", ""), 0666, 0);
	/* of no owner that there can be: it stays */
	put_dead(folder, "340282366920938463463374607431768211455");
	put_dead(folder, "1");
	for (int i = 0; i < 3; i++) {
		pid_t commander = folder_peer(folder, "commander", said);

		assert_string_equal(said, "ready");
		assert_int_equal(shm_host_maintain(host), i ? 0 : 1);
		assert_int_equal(shm_device_commanders(mill), 1);
		folder_end_peer(commander, SIGKILL);
		assert_int_equal(shm_host_maintain(host), 1);
		assert_int_equal(shm_device_commanders(mill), 0);
	}
	shm_host_close(host);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(links_are_not_followed),
		BOTH(nothing_is_waited_for),
		BOTH(what_is_no_node_is_left),
		BOTH(a_dead_commander_is_found_among_them),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
