/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Full: of descriptors, of memory. Whoever attaches or starts then is told so,
 * and leaves nothing behind, for it will try again five times a second.
 */
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tests/shm/folder.h"

static unsigned int things;

static int count_one(const char *path, const struct stat *status, int type, struct FTW *at)
{
	(void)path, (void)status, (void)type, (void)at;
	things++;
	return 0;
}

static unsigned int things_in(const struct folder *folder)
{
	things = 0;
	nftw(folder->path, count_one, 16, FTW_PHYS);
	return things;
}

/* May open `more` files, then no more. */
static void limit_files(rlim_t more)
{
	struct rlimit limit;
	int next = dup(STDIN_FILENO);

	close(next);
	getrlimit(RLIMIT_NOFILE, &limit);
	limit.rlim_cur = (rlim_t)next + more;
	setrlimit(RLIMIT_NOFILE, &limit);
}

/* In a child, for the limit is for good: how it went with `more` files. */
static int attach_with(struct folder *folder, rlim_t more, unsigned int flags)
{
	enum pokeys_client_state result;
	pokeys_client *client;
	int status;
	pid_t pid = fork();

	if (!pid) {
		client = folder_client(folder, flags);
		limit_files(more);
		result = pokeys_client_poll(client);
		if (result == POKEYS_CLIENT_REFUSED &&
		    !strstr(folder_status(folder, client), "Too many open files"))
			result = 9;
		pokeys_client_close(client);
		_exit((int)result);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status));
	return WEXITSTATUS(status);
}

static void client_without_descriptors_is_told_and_leaves_nothing(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	const unsigned int flags = POKEYS_CLIENT_COMMANDER | POKEYS_CLIENT_EVENTS;
	unsigned int before = things_in(folder);

	for (rlim_t more = 2; more < 24; more++)
		assert_int_equal(attach_with(folder, more, flags), POKEYS_CLIENT_REFUSED);
	assert_int_equal(attach_with(folder, 30, flags), POKEYS_CLIENT_ATTACHED);
	shm_host_maintain(host);
	assert_int_equal(things_in(folder), before);
	shm_host_close(host);
}

static void daemon_without_descriptors_is_told_and_leaves_nothing(void **state)
{
	struct folder *folder = *state;
	struct shm_host *host;
	int status;

	for (rlim_t more = 4; more < 36; more++) {
		pid_t pid = fork();

		if (!pid) {
			limit_files(more);
			status = shm_host_open(&host, folder->path, NULL, NULL, folder->why,
					       sizeof(folder->why));
			_exit(status && strstr(folder->why, "Too many open files") ? 0 : 1);
		}
		assert_int_equal(waitpid(pid, &status, 0), pid);
		assert_true(WIFEXITED(status) && !WEXITSTATUS(status));
	}
	assert_int_equal(things_in(folder), 1);
}

static rlim_t fill(const char *path, unsigned int free_pages)
{
	struct statvfs status;
	int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
	int r;

	statvfs(path, &status);
	r = posix_fallocate(fd, 0, (off_t)((status.f_bavail - free_pages) * status.f_frsize));
	close(fd);
	return r ? 0 : 1;
}

/* In a mount namespace of its own; 0, 77, or the number of pages at which it went wrong. */
static int attach_on_full_tmpfs(struct folder *folder)
{
	struct shm_device *mill;
	struct shm_host *host;
	char path[64];
	int r = 0;

	if (unshare(CLONE_NEWNS) || mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) ||
	    mkdir(folder->path, 0700) ||
	    mount("tmpfs", folder->path, "tmpfs", 0, "mode=0700,size=1024k"))
		return 77;
	host = folder_host_mill(folder, &mill);
	snprintf(path, sizeof(path), "%s/full", folder->path);
	for (unsigned int pages = 0; !r && pages < 12; pages++) {
		pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);

		if (!fill(path, pages) || pokeys_client_poll(client) != POKEYS_CLIENT_REFUSED ||
		    !strstr(folder_status(folder, client), "kB free"))
			r = 1 + (int)pages;
		pokeys_client_close(client);
		unlink(path);
	}
	shm_host_close(host);
	return r;
}

static void client_on_a_full_tmpfs_is_told(void **state)
{
	struct folder *folder = *state;
	int status;
	pid_t pid = fork();

	if (!pid)
		_exit(attach_on_full_tmpfs(folder));
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status));
	if (WEXITSTATUS(status) == 77) {
		fprintf(stderr, "mounts are not permitted here\n");
		skip();
	}
	assert_int_equal(WEXITSTATUS(status), 0);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(client_without_descriptors_is_told_and_leaves_nothing),
		BOTH(daemon_without_descriptors_is_told_and_leaves_nothing),
		BOTH(client_on_a_full_tmpfs_is_told),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
