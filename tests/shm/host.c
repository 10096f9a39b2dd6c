/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The daemon's side of the runtime folder: what it takes, what it refuses and
 * in which words, what it removes.
 */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <sched.h>
#include <unistd.h>
#include "shm/runtime.h"
#include "tests/shm/folder.h"

static int try_open(struct folder *folder, const char *path, const char *group)
{
	struct shm_host *host;
	int r = shm_host_open(&host, path, group, NULL, folder->why, sizeof(folder->why));

	if (!r)
		shm_host_close(host);
	return r;
}

static void assert_says(const struct folder *folder, const char *words)
{
	if (!strstr(folder->why, words))
		fail_msg("it said: %s", folder->why);
}

static mode_t mode_of(const char *path)
{
	struct stat status;

	assert_int_equal(stat(path, &status), 0);
	return status.st_mode & 07777;
}

static void folder_is_made_with_mode_2751_whatever_the_umask(void **state)
{
	struct folder *folder = *state;
	mode_t before = umask(0077);
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char path[64];

	umask(before);
	assert_int_equal(mode_of(folder->path), 02751);
	snprintf(path, sizeof(path), "%s/current/.", folder->path);
	assert_int_equal(mode_of(path), 02750);
	snprintf(path, sizeof(path), "%s/current/manifest", folder->path);
	assert_int_equal(mode_of(path), 0640);
	shm_host_close(host);
}

static void folder_that_exists_keeps_its_mode(void **state)
{
	struct folder *folder = *state;

	mkdir(folder->path, 0700);
	assert_int_equal(try_open(folder, folder->path, NULL), 0);
	assert_int_equal(mode_of(folder->path), 0700);
}

static void folder_open_to_everybody_is_refused(void **state)
{
	struct folder *folder = *state;

	mkdir(folder->path, 0700);
	chmod(folder->path, 01777);
	assert_int_equal(try_open(folder, folder->path, NULL), -EPERM);
	assert_says(folder, "everybody may write there");
}

static void folder_below_nothing_is_refused(void **state)
{
	struct folder *folder = *state;

	assert_int_equal(try_open(folder, "/nonexistent/pokeysd", NULL), -ENOENT);
	assert_says(folder, "/nonexistent/pokeysd: cannot be made: No such file");
}

static void folder_that_is_a_file_is_refused(void **state)
{
	struct folder *folder = *state;

	close(open(folder->path, O_CREAT | O_WRONLY, 0600));
	assert_int_equal(try_open(folder, folder->path, NULL), -ENOTDIR);
	assert_says(folder, folder->path);
	unlink(folder->path);
}

static void path_that_is_too_long_or_relative_is_refused(void **state)
{
	struct folder *folder = *state;
	char path[51] = "/";

	memset(path + 1, 'x', sizeof(path) - 2);
	assert_int_equal(try_open(folder, path, NULL), -ENAMETOOLONG);
	assert_says(folder, "at most 49 fit (sockets live below it)");
	assert_int_equal(try_open(folder, "run/pokeysd", NULL), -EINVAL);
	assert_says(folder, "give an absolute path");
}

/* The longest path that is allowed really works, event sockets included. */
static void longest_path_works(void **state)
{
	struct folder *folder = *state;
	char path[50];
	struct shm_device *mill;
	struct shm_host *host;
	pokeys_client *client;

	memset(path, 'x', sizeof(path));
	memcpy(path, folder->base, strlen(folder->base));
	path[strlen(folder->base)] = '/';
	path[49] = '\0';
	assert_int_equal(shm_host_open(&host, path, NULL, NULL, folder->why, sizeof(folder->why)),
			 0);
	assert_int_equal(shm_host_add(host, "mill", &mill, folder->why, sizeof(folder->why)), 0);
	assert_int_equal(shm_host_publish(host, folder->why, sizeof(folder->why)), 0);
	assert_int_equal(pokeys_client_open(&client, path, "mill", "test", POKEYS_CLIENT_EVENTS),
			 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	shm_device_notify(mill);
	assert_int_equal(pokeys_client_wait(client, 10000), 1);
	pokeys_client_close(client);
	shm_host_close(host);
	assert_int_equal(rmdir(path), 0);
}

static void unknown_group_is_refused(void **state)
{
	struct folder *folder = *state;

	assert_int_equal(try_open(folder, folder->path, "no-such-group"), -ENOENT);
	assert_says(folder, "group 'no-such-group' does not exist; create it");
}

/* 4294967296 would be group 0 if it wrapped round, and 4294967295 would be none. */
static void number_that_is_no_groups_is_refused(void **state)
{
	static const char *const numbers[] = {
		"4294967295", "4294967296", "99999999999999999999", "-1", "+1", " 1", "1x",
	};
	struct folder *folder = *state;

	for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++) {
		assert_int_equal(try_open(folder, folder->path, numbers[i]), -ENOENT);
		assert_says(folder, "does not exist; create it");
	}
}

static void group_is_given_the_folder(void **state)
{
	struct folder *folder = *state;
	struct stat status;
	char gid[16];

	/* a group that this process is in: allowed for everybody */
	snprintf(gid, sizeof(gid), "%u", (unsigned int)getegid());
	mkdir(folder->path, 0700);
	assert_int_equal(try_open(folder, folder->path, gid), 0);
	assert_int_equal(stat(folder->path, &status), 0);
	assert_int_equal(status.st_gid, getegid());
	assert_int_equal(mode_of(folder->path), 02751);
}

/* Of a folder that the service manager made for it, it knows that. */
static void metrics_in_the_services_folder_are_no_obstacle(void **state)
{
	struct folder *folder = *state;
	char path[64], gid[16];

	snprintf(gid, sizeof(gid), "%u", (unsigned int)getegid());
	mkdir(folder->path, 0755);
	snprintf(path, sizeof(path), "%s/pokeysd.prom", folder->path);
	close(open(path, O_CREAT | O_WRONLY, 0600));
	setenv("RUNTIME_DIRECTORY", "/run/another", 1);
	assert_int_equal(try_open(folder, folder->path, gid), -ENOTEMPTY);
	setenv("RUNTIME_DIRECTORY", folder->path, 1);
	assert_int_equal(try_open(folder, folder->path, gid), 0);
	unsetenv("RUNTIME_DIRECTORY");
	assert_int_equal(mode_of(folder->path), 02751);
	assert_int_equal(access(path, F_OK), 0);
	unlink(path);
}

static void folder_with_other_things_is_not_changed(void **state)
{
	struct folder *folder = *state;
	char path[64], gid[16];

	snprintf(gid, sizeof(gid), "%u", (unsigned int)getegid());
	mkdir(folder->path, 0755);
	snprintf(path, sizeof(path), "%s/passwd", folder->path);
	close(open(path, O_CREAT | O_WRONLY, 0644));
	assert_int_equal(try_open(folder, folder->path, gid), -ENOTEMPTY);
	assert_says(folder, "holds 'passwd', which is not pokeysd's");
	assert_int_equal(mode_of(folder->path), 0755);
	unlink(path);
	assert_int_equal(try_open(folder, folder->path, gid), 0);
	assert_int_equal(mode_of(folder->path), 02751);
}

/* It is found out at the start, not when the daemon drives its devices already. */
static void current_that_is_a_folder_is_refused(void **state)
{
	struct folder *folder = *state;
	char path[64];

	mkdir(folder->path, 0755);
	snprintf(path, sizeof(path), "%s/current", folder->path);
	mkdir(path, 0755);
	assert_int_equal(try_open(folder, folder->path, NULL), -EISDIR);
	assert_says(folder, "/current: a folder, in the place of a file of pokeysd's; remove it");
	rmdir(path);
	assert_int_equal(try_open(folder, folder->path, NULL), 0);
}

static void lock_that_is_no_file_is_refused(void **state)
{
	struct folder *folder = *state;
	char path[48];

	mkdir(folder->path, 0700);
	snprintf(path, sizeof(path), "%s/lock", folder->path);
	assert_int_equal(mkfifo(path, 0600), 0);
	assert_int_equal(try_open(folder, folder->path, NULL), -EPROTO);
	assert_says(folder, "/lock: not a file; remove it");
	unlink(path);
}

static void lock_of_a_dead_daemon_is_no_obstacle(void **state)
{
	struct folder *folder = *state;
	char said[256];

	for (int i = 0; i < 3; i++) {
		folder_end_peer(folder_peer(folder, "host", said), SIGKILL);
		assert_string_equal(said, "ready");
	}
	assert_int_equal(try_open(folder, folder->path, NULL), 0);
}

static void second_daemon_of_another_process_is_named(void **state)
{
	struct folder *folder = *state;
	char said[256], who[64];
	pid_t first = folder_peer(folder, "host", said);
	pid_t second = folder_peer(folder, "host", said);

	snprintf(who, sizeof(who), "another pokeysd (pid %d) holds %s;", (int)first, folder->path);
	if (!strstr(said, who))
		fail_msg("it said: %s", said);
	folder_end_peer(second, SIGTERM);
	assert_int_equal(folder_end_peer(first, SIGTERM), 0);
}

/* Only what is the daemon's is removed, and no link is followed out of it. */
static void what_is_not_the_daemons_stays(void **state)
{
	struct folder *folder = *state;
	char path[64], precious[64];

	snprintf(precious, sizeof(precious), "%s/precious", folder->base);
	mkdir(precious, 0700);
	snprintf(path, sizeof(path), "%s/precious/thing", folder->base);
	close(open(path, O_CREAT | O_WRONLY, 0600));
	mkdir(folder->path, 0700);
	snprintf(path, sizeof(path), "%s/e.12", folder->path);
	mkdir(path, 0700);
	snprintf(path, sizeof(path), "%s/e.12/link", folder->path);
	assert_int_equal(symlink(precious, path), 0);
	snprintf(path, sizeof(path), "%s/e.34", folder->path);
	assert_int_equal(symlink(precious, path), 0);
	snprintf(path, sizeof(path), "%s/e.not", folder->path);
	close(open(path, O_CREAT | O_WRONLY, 0600));
	assert_int_equal(try_open(folder, folder->path, NULL), 0);
	assert_int_equal(access(path, F_OK), 0);
	unlink(path);
	snprintf(path, sizeof(path), "%s/precious/thing", folder->base);
	assert_int_equal(access(path, F_OK), 0);
}

static void remains_that_a_late_client_makes_are_removed(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char path[64];

	snprintf(path, sizeof(path), "%s/e.12", folder->path);
	mkdir(path, 0700);
	snprintf(path, sizeof(path), "%s/e.12/nodes", folder->path);
	mkdir(path, 0700);
	assert_int_equal(shm_host_maintain(host), 0);
	assert_int_equal(access(path, F_OK), -1);
	shm_host_close(host);
}

static void a_link_that_was_removed_is_made_again(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	char path[64];

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	snprintf(path, sizeof(path), "%s/current", folder->path);
	assert_int_equal(unlink(path), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_DETACHED);
	assert_int_equal(shm_host_maintain(host), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void a_root_that_was_removed_is_told_and_not_published(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char path[64];

	snprintf(path, sizeof(path), "%s/current/manifest", folder->path);
	assert_int_equal(unlink(path), 0);
	snprintf(path, sizeof(path), "%s/current", folder->path);
	assert_int_equal(unlink(path), 0);
	assert_int_equal(shm_host_maintain(host), -ESTALE);
	assert_int_equal(access(path, F_OK), -1);
	shm_host_close(host);
}

static void device_twice_or_too_late_is_refused(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill, *other;
	struct shm_host *host = folder_host_mill(folder, &mill);

	assert_int_equal(shm_host_add(host, "mill", &other, folder->why, sizeof(folder->why)),
			 -EEXIST);
	assert_says(folder, "device mill: there are two of this name");
	assert_int_equal(shm_host_add(host, "lathe", &other, folder->why, sizeof(folder->why)),
			 -ENOSPC);
	shm_host_close(host);
}

static void as_many_devices_as_promised(void **state)
{
	struct folder *folder = *state;
	struct shm_device *device;
	struct shm_host *host;
	char names[SHM_DEVICES_MAX + 1][POKEYS_SHM_NAME_MAX];

	assert_int_equal(shm_host_open(&host, folder->path, NULL, NULL, folder->why,
				       sizeof(folder->why)),
			 0);
	for (int i = 0; i < SHM_DEVICES_MAX; i++) {
		snprintf(names[i], sizeof(names[i]), "device-with-a-really-long-nam%02d", i);
		assert_int_equal(shm_host_add(host, names[i], &device, folder->why,
					      sizeof(folder->why)),
				 0);
	}
	assert_int_equal(shm_host_add(host, "one-more", &device, folder->why, sizeof(folder->why)),
			 -ENOSPC);
	assert_int_equal(shm_host_publish(host, folder->why, sizeof(folder->why)), 0);
	assert_int_equal(pokeys_shm_devices(folder->path, names, SHM_DEVICES_MAX + 1),
			 SHM_DEVICES_MAX);
	shm_host_close(host);
}

/* ---- folders that only root can make: in a mount namespace of a child ---- */

static int in_mount(struct folder *folder, const char *options, unsigned long flags,
		    int (*inside)(struct folder *))
{
	int status;
	pid_t pid = fork();

	if (!pid) {
		if (unshare(CLONE_NEWNS) || mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) ||
		    (mkdir(folder->path, 0700) && errno != EEXIST) ||
		    mount("tmpfs", folder->path, "tmpfs", flags, options))
			_exit(77);
		_exit(inside(folder));
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status));
	if (WEXITSTATUS(status) == 77) {
		fprintf(stderr, "mounts are not permitted here\n");
		skip();
	}
	return WEXITSTATUS(status);
}

static int open_read_only(struct folder *folder)
{
	int r = try_open(folder, folder->path, NULL);

	return r == -EROFS && strstr(folder->why, "Read-only file system") ? 0 : 1;
}

static void read_only_folder_is_refused(void **state)
{
	assert_int_equal(in_mount(*state, "mode=0700", MS_RDONLY, open_read_only), 0);
}

static int open_full(struct folder *folder)
{
	int r = try_open(folder, folder->path, NULL);

	return r == -ENOSPC && strstr(folder->why, "kB free") ? 0 : 1;
}

/* Four pages: iceoryx2's first file is longer than what is left then. */
static void full_folder_is_refused_in_words(void **state)
{
	assert_int_equal(in_mount(*state, "mode=0700,size=128k", 0, open_full), 0);
	assert_int_equal(in_mount(*state, "mode=0700,size=4k", 0, open_full), 0);
}

static int open_on_tmpfs(struct folder *folder)
{
	return try_open(folder, folder->path, NULL) || folder->why[0] ? 1 : 0;
}

static void tmpfs_is_no_warning(void **state)
{
	assert_int_equal(in_mount(*state, "mode=0700", 0, open_on_tmpfs), 0);
}

static void disk_is_a_warning(void **state)
{
	struct folder *folder = *state;
	char path[] = "/var/tmp/pk.XXXXXX";

	if (!mkdtemp(path))
		skip();
	assert_int_equal(try_open(folder, path, NULL), 0);
	rmdir(path);
	if (!folder->why[0]) {
		fprintf(stderr, "/var/tmp is on a tmpfs here\n");
		skip();
	}
	assert_says(folder, "/var/tmp/pk.");
	assert_says(folder, "is not on a tmpfs");
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		/* first: these fork, and iceoryx2 must not have been used before */
		BOTH(read_only_folder_is_refused),
		BOTH(full_folder_is_refused_in_words),
		BOTH(tmpfs_is_no_warning),
		BOTH(disk_is_a_warning),
		BOTH(folder_is_made_with_mode_2751_whatever_the_umask),
		BOTH(folder_that_exists_keeps_its_mode),
		BOTH(folder_open_to_everybody_is_refused),
		BOTH(folder_below_nothing_is_refused),
		BOTH(folder_that_is_a_file_is_refused),
		BOTH(path_that_is_too_long_or_relative_is_refused),
		BOTH(longest_path_works),
		BOTH(unknown_group_is_refused),
		BOTH(number_that_is_no_groups_is_refused),
		BOTH(group_is_given_the_folder),
		BOTH(metrics_in_the_services_folder_are_no_obstacle),
		BOTH(folder_with_other_things_is_not_changed),
		BOTH(lock_that_is_no_file_is_refused),
		BOTH(lock_of_a_dead_daemon_is_no_obstacle),
		BOTH(second_daemon_of_another_process_is_named),
		BOTH(what_is_not_the_daemons_stays),
		BOTH(remains_that_a_late_client_makes_are_removed),
		BOTH(a_link_that_was_removed_is_made_again),
		BOTH(a_root_that_was_removed_is_told_and_not_published),
		BOTH(current_that_is_a_folder_is_refused),
		BOTH(device_twice_or_too_late_is_refused),
		BOTH(as_many_devices_as_promised),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
