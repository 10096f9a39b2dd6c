/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Rule 2, everything is a file below a folder of mode 2750: a member of the
 * group gets in, nobody else does, and nothing of it is anywhere else.
 *
 * Needs root, to become other users.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <grp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "shm/runtime.h"
#include "tests/shm/folder.h"

enum { OWNER = 4001, GROUP = 4002, MEMBER = 4003, STRANGER = 4004 }; /* nobody's numbers */

static void become(uid_t user, gid_t group, const gid_t *more, size_t count)
{
	if (setgroups(count, more) || setresgid(group, group, group) || setresuid(user, user, user))
		_exit(99);
	umask(0022); /* what people have */
}

/* A client that writes its line into folder->why; a process of its own. */
static int client_as(struct folder *folder, uid_t user, gid_t group, const gid_t *more,
		     size_t count, unsigned int flags)
{
	int pipe_fds[2], status;
	pokeys_client *client;
	struct pokeys_state image;
	ssize_t length;
	pid_t pid;

	assert_int_equal(pipe(pipe_fds), 0);
	pid = fork();
	if (!pid) {
		become(user, group, more, count);
		if (pokeys_client_open(&client, folder->path, "mill", "test", flags))
			_exit(98);
		pokeys_client_poll(client);
		status = (int)pokeys_client_status(client, folder->why, sizeof(folder->why));
		if (status == POKEYS_CLIENT_ATTACHED && pokeys_client_read(client, &image))
			_exit(97);
		length = write(pipe_fds[1], folder->why, strlen(folder->why) + 1);
		pokeys_client_close(client);
		_exit(length > 0 ? status : 96);
	}
	close(pipe_fds[1]);
	length = read(pipe_fds[0], folder->why, sizeof(folder->why) - 1);
	close(pipe_fds[0]);
	folder->why[length > 0 ? length : 0] = '\0';
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status));
	return WEXITSTATUS(status);
}

static int member(struct folder *folder, unsigned int flags)
{
	static const gid_t more[] = { GROUP };

	return client_as(folder, MEMBER, MEMBER, more, 1, flags);
}

static int stranger(struct folder *folder, unsigned int flags)
{
	return client_as(folder, STRANGER, STRANGER, NULL, 0, flags);
}

/* The daemon: a user that is not root, in a folder that root gave it. */
static pid_t start_daemon(struct folder *folder)
{
	struct shm_device *mill;
	struct shm_host *host;
	char ready = 0;
	int pipe_fds[2];
	pid_t pid;

	assert_int_equal(mkdir(folder->path, 0700), 0);
	assert_int_equal(chown(folder->path, OWNER, GROUP), 0);
	assert_int_equal(chmod(folder->path, 02770), 0);
	assert_int_equal(pipe(pipe_fds), 0);
	pid = fork();
	if (!pid) {
		become(OWNER, GROUP, NULL, 0);
		host = folder_host_mill(folder, &mill);
		if (write(pipe_fds[1], "r", 1) != 1)
			_exit(1);
		for (;;) {
			shm_host_maintain(host);
			folder_sleep_ms(20);
		}
	}
	close(pipe_fds[1]);
	assert_int_equal(read(pipe_fds[0], &ready, 1), 1);
	close(pipe_fds[0]);
	return pid;
}

/* What it left is removed by the next daemon of the same user. */
static void end_daemon(struct folder *folder, pid_t pid)
{
	struct shm_device *mill;
	int status;

	folder_end_peer(pid, SIGKILL);
	pid = fork();
	if (!pid) {
		become(OWNER, GROUP, NULL, 0);
		shm_host_close(folder_host_mill(folder, &mill));
		_exit(0);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status) && !WEXITSTATUS(status));
}

static void member_of_the_group_attaches(void **state)
{
	struct folder *folder = *state;
	pid_t daemon = start_daemon(folder);

	assert_int_equal(member(folder, 0), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(member(folder, POKEYS_CLIENT_COMMANDER | POKEYS_CLIENT_EVENTS),
			 POKEYS_CLIENT_ATTACHED);
	end_daemon(folder, daemon);
}

static void stranger_is_refused_in_words(void **state)
{
	struct folder *folder = *state;
	pid_t daemon = start_daemon(folder);

	for (unsigned int flags = 0; flags <= POKEYS_CLIENT_COMMANDER; flags++) {
		assert_int_equal(stranger(folder, flags), POKEYS_CLIENT_REFUSED);
		assert_non_null(strstr(folder->why,
				       "permission denied; this user must be in group 4002"));
	}
	end_daemon(folder, daemon);
}

/* What is told names the group that may enter, and does not send anybody into root's. */
static void who_may_enter_is_told(void **state)
{
	struct folder *folder = *state;
	char why[256], file[128];

	assert_int_equal(mkdir(folder->path, 0700), 0);
	assert_int_equal(chown(folder->path, 0, 5), 0);
	assert_int_equal(runtime_denied(folder->path, why, sizeof(why)), -EACCES);
	assert_non_null(strstr(why, "only its owner may enter"));
	assert_int_equal(chmod(folder->path, 02770), 0);
	runtime_denied(folder->path, why, sizeof(why));
	assert_non_null(strstr(why, "adduser USER tty")); /* 5 is Debian's, for ever */
	assert_int_equal(chown(folder->path, OWNER, 0), 0);
	assert_int_equal(chmod(folder->path, 02770), 0);
	runtime_denied(folder->path, why, sizeof(why));
	assert_non_null(strstr(why, "only its owner may enter"));
	/* a file in it has a group of its own */
	snprintf(file, sizeof(file), "%s/file", folder->path);
	close(open(file, O_CREAT | O_RDONLY | O_CLOEXEC, 0600));
	assert_int_equal(chown(file, OWNER, 5), 0);
	runtime_denied(file, why, sizeof(why));
	assert_non_null(strstr(why, "only its owner may read it"));
	assert_int_equal(chmod(file, 0640), 0);
	runtime_denied(file, why, sizeof(why));
	assert_non_null(strstr(why, "adduser USER tty"));
	unlink(file);
}

static void member_that_is_killed_is_cleaned_up_by_the_daemon(void **state)
{
	static const gid_t more[] = { GROUP };
	struct folder *folder = *state;
	pid_t daemon = start_daemon(folder);
	pid_t pid;
	uint64_t began;
	int r;

	for (int i = 0; i < 5; i++) {
		pid = fork();
		if (!pid) {
			pokeys_client *client;

			become(MEMBER, MEMBER, more, 1);
			pokeys_client_open(&client, folder->path, "mill", "test",
					   POKEYS_CLIENT_COMMANDER);
			pokeys_client_poll(client);
			kill(getpid(), SIGKILL);
		}
		waitpid(pid, NULL, 0);
		began = folder_now_ns();
		do {
			folder_sleep_ms(20);
			r = member(folder, POKEYS_CLIENT_COMMANDER);
		} while (r != POKEYS_CLIENT_ATTACHED &&
			 folder_now_ns() - began < UINT64_C(60000000000));
		assert_int_equal(r, POKEYS_CLIENT_ATTACHED);
	}
	end_daemon(folder, daemon);
}

static void second_daemon_of_another_user_is_refused(void **state)
{
	static const gid_t more[] = { GROUP };
	struct folder *folder = *state;
	pid_t daemon = start_daemon(folder);
	struct shm_host *host;
	int status;
	pid_t pid = fork();

	if (!pid) {
		become(MEMBER, MEMBER, more, 1);
		status = shm_host_open(&host, folder->path, NULL, NULL, folder->why,
				       sizeof(folder->why));
		_exit(status == -EACCES &&
				      strstr(folder->why, "it belongs to another user's daemon") ?
			      0 :
			      1);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_int_equal(WEXITSTATUS(status), 0);
	end_daemon(folder, daemon);
}

/* Every file that is mapped for sharing lies below the folder. */
static void nothing_is_mapped_from_anywhere_else(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder,
					      POKEYS_CLIENT_COMMANDER | POKEYS_CLIENT_EVENTS);
	char line[512], mode[8];
	int mapped = 0;
	FILE *maps;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	maps = fopen("/proc/self/maps", "r");
	while (fgets(line, sizeof(line), maps)) {
		if (sscanf(line, "%*s %7s", mode) != 1 || mode[3] != 's')
			continue;
		mapped++;
		if (!strstr(line, folder->path))
			fail_msg("mapped: %s", line);
	}
	fclose(maps);
	assert_true(mapped > 10);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void made_as(const struct folder *folder, const char *name, mode_t mode)
{
	struct stat status;
	char path[96];

	snprintf(path, sizeof(path), "%s/current/%s", folder->path, name);
	assert_int_equal(stat(path, &status), 0);
	assert_int_equal(status.st_mode & 01777, mode);
	assert_int_equal(status.st_uid, OWNER);
}

/* Nobody replaces what others are to attach to; at a node, its owner does. */
static void only_the_daemon_puts_files_there(void **state)
{
	struct folder *folder = *state;
	pid_t daemon = start_daemon(folder);

	made_as(folder, ".", 0750);
	made_as(folder, "services", 0750);
	made_as(folder, "nodes", 01770);
	end_daemon(folder, daemon);
}

/* How many files of this kind a member of the group may write to. */
static int writable(const char *root, const char *suffix)
{
	DIR *folder = opendir(root);
	struct dirent *entry;
	int found = 0;

	while (folder && (entry = readdir(folder))) {
		const size_t length = strlen(entry->d_name), end = strlen(suffix);

		found += length > end && !strcmp(entry->d_name + length - end, suffix) &&
			 !faccessat(dirfd(folder), entry->d_name, W_OK, 0);
	}
	if (folder)
		closedir(folder);
	return found;
}

static bool may_make(const char *folder)
{
	char path[128];

	snprintf(path, sizeof(path), "%s/new", folder);
	return !mkdir(path, 0700) && !rmdir(path);
}

/* The exit status of a member is the first thing that is not so. */
static int look_as_member(const struct folder *folder)
{
	static const gid_t more[] = { GROUP };
	char root[64], services[80], nodes[80];

	become(MEMBER, MEMBER, more, 1);
	snprintf(root, sizeof(root), "%s/current", folder->path);
	snprintf(services, sizeof(services), "%s/services", root);
	snprintf(nodes, sizeof(nodes), "%s/nodes", root);
	if (writable(root, ".blackboard_data") != 2) /* command and wish */
		return 1;
	if (writable(root, ".dynamic") != 5)
		return 2;
	if (writable(root, ".blackboard_mgmt") || writable(root, "manifest") ||
	    writable(services, ".service"))
		return 3;
	if (may_make(folder->path) || may_make(root) || may_make(services))
		return 4;
	return may_make(nodes) ? 0 : 5;
}

static void a_member_may_write_what_a_commander_has_to(void **state)
{
	struct folder *folder = *state;
	pid_t daemon = start_daemon(folder);
	int status;
	pid_t pid;

	pid = fork();
	if (!pid)
		_exit(look_as_member(folder));
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_int_equal(status, 0);
	end_daemon(folder, daemon);
}

/* As it comes from an earlier version: the daemon closes it, and a commander looks. */
static void a_folder_that_the_group_may_write_to_is_refused(void **state)
{
	struct folder *folder = *state;
	pid_t daemon = start_daemon(folder);

	assert_int_equal(member(folder, POKEYS_CLIENT_COMMANDER), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(chmod(folder->path, 02770), 0);
	assert_int_equal(member(folder, POKEYS_CLIENT_COMMANDER), POKEYS_CLIENT_REFUSED);
	assert_non_null(strstr(folder->why, "others than pokeysd may put files there"));
	end_daemon(folder, daemon);
}

/* The files have a mode of their own. */
static void without_the_mode_a_stranger_still_stays_out(void **state)
{
	static const char *const open[] = { "/current/.", "/current/services", "" };
	struct folder *folder = *state;
	pid_t daemon = start_daemon(folder);
	char path[64];

	for (size_t i = 0; i < sizeof(open) / sizeof(*open); i++) {
		snprintf(path, sizeof(path), "%s%s", folder->path, open[i]);
		assert_int_equal(chmod(path, 02755), 0);
	}
	snprintf(path, sizeof(path), "%s/current/manifest", folder->path);
	assert_int_equal(chmod(path, 0644), 0);
	assert_int_equal(stranger(folder, POKEYS_CLIENT_COMMANDER), POKEYS_CLIENT_REFUSED);
	assert_int_equal(stranger(folder, 0), POKEYS_CLIENT_REFUSED);
	assert_int_equal(member(folder, POKEYS_CLIENT_COMMANDER), POKEYS_CLIENT_ATTACHED);
	end_daemon(folder, daemon);
}

/* What a member makes there is his, and not every folder of his can be emptied. */
static void what_cannot_be_removed_keeps_no_daemon_from_starting(void **state)
{
	struct folder *folder = *state;
	const pid_t daemon = start_daemon(folder);
	char root[64], inner[72], innermost[80];

	snprintf(root, sizeof(root), "%s/e.1", folder->path);
	snprintf(inner, sizeof(inner), "%s/a", root);
	snprintf(innermost, sizeof(innermost), "%s/b", inner);
	assert_int_equal(mkdir(root, 0755) || mkdir(inner, 0755) || mkdir(innermost, 0755), 0);
	assert_int_equal(chown(root, MEMBER, GROUP) || chown(inner, MEMBER, GROUP), 0);
	end_daemon(folder, daemon);
	assert_int_equal(access(innermost, F_OK), 0);
	assert_int_equal(rmdir(innermost) || rmdir(inner) || rmdir(root), 0);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(member_of_the_group_attaches),
		BOTH(stranger_is_refused_in_words),
		BOTH(who_may_enter_is_told),
		BOTH(member_that_is_killed_is_cleaned_up_by_the_daemon),
		BOTH(second_daemon_of_another_user_is_refused),
		BOTH(what_cannot_be_removed_keeps_no_daemon_from_starting),
		BOTH(only_the_daemon_puts_files_there),
		BOTH(a_member_may_write_what_a_commander_has_to),
		BOTH(a_folder_that_the_group_may_write_to_is_refused),
		BOTH(without_the_mode_a_stranger_still_stays_out),
		/* last: it uses iceoryx2 in this process, the others fork */
		BOTH(nothing_is_mapped_from_anywhere_else),
	};

	if (geteuid()) {
		fprintf(stderr, "needs root, to become other users\n");
		return 77;
	}
	return cmocka_run_group_tests(tests, NULL, NULL);
}
