/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Whatever stands in the runtime folder, a client says one line and goes on:
 * no crash, no hang, nothing read from it. The attempts are made by another
 * process (peer once), so that a crash is seen as such.
 */
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tests/shm/folder.h"

enum { ANSWER_MS = 60000, FILES_MAX = 64 };

/* What a fresh client says of the folder as it is. */
static const char *attempt(struct folder *folder)
{
	uint64_t began = folder_now_ns();
	pid_t pid = folder_peer(folder, "once", folder->why);
	int status;

	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status));
	assert_int_equal(WEXITSTATUS(status), 0);
	assert_true(folder_now_ns() - began < ANSWER_MS * UINT64_C(1000000));
	return folder->why;
}

static char *path_of(const struct folder *folder, const char *name)
{
	static char path[512];

	snprintf(path, sizeof(path), "%s/%s", folder->path, name);
	return path;
}

static void assert_says(struct folder *folder, const char *words)
{
	if (!strstr(attempt(folder), words))
		fail_msg("it said: %s", folder->why);
}

static void missing_folder_means_no_daemon(void **state)
{
	assert_says(*state, "no daemon in");
}

static void folder_that_is_a_file_means_no_daemon(void **state)
{
	struct folder *folder = *state;

	close(open(folder->path, O_CREAT | O_WRONLY, 0600));
	assert_says(folder, "no daemon in");
	unlink(folder->path);
}

static void foreign_links_are_refused(void **state)
{
	static const char *const targets[] = {
		"/etc", "..", "e.", "e.xyz", "e.12/../../etc", "e.0123456789abcdef0123456789",
		"E.12", " ",  NULL,
	};
	struct folder *folder = *state;

	mkdir(folder->path, 0700);
	for (size_t i = 0; targets[i]; i++) {
		assert_int_equal(symlink(targets[i], path_of(folder, "current")), 0);
		assert_says(folder, "/current: not a link that pokeysd made");
		unlink(path_of(folder, "current"));
	}
}

static void current_that_is_no_link_is_refused(void **state)
{
	struct folder *folder = *state;

	mkdir(folder->path, 0700);
	mkdir(path_of(folder, "current"), 0700);
	assert_says(folder, "/current: not a link that pokeysd made");
	rmdir(path_of(folder, "current"));
}

static void link_to_nothing_means_a_daemon_that_is_gone(void **state)
{
	struct folder *folder = *state;

	mkdir(folder->path, 0700);
	assert_int_equal(symlink("e.1234", path_of(folder, "current")), 0);
	assert_says(folder, "is gone");
	unlink(path_of(folder, "current"));
}

static void write_manifest(const struct folder *folder, const char *text, size_t length)
{
	int fd = open(path_of(folder, "e.1/manifest"), O_CREAT | O_TRUNC | O_WRONLY, 0600);

	assert_int_equal(write(fd, text, length), (ssize_t)length);
	close(fd);
}

static void manifests_that_are_none_are_refused(void **state)
{
	static const char good[] = "iceoryx2 0.10.0\nstate 1 1 8\ndiag 1 1 8\ncommand 1 1 8\n";
	static const char *const bad[] = {
		"",
		"\n",
		"hello",
		"iceoryx2 0.10.0\n",
		"state 1\n",
		"state x y z\n",
		"device ../../etc\n",
		"device \n",
		"device a b\n",
		NULL,
	};
	struct folder *folder = *state;
	char text[256];

	mkdir(folder->path, 0700);
	mkdir(path_of(folder, "e.1"), 0700);
	assert_int_equal(symlink("e.1", path_of(folder, "current")), 0);
	for (size_t i = 0; bad[i]; i++) {
		write_manifest(folder, bad[i], strlen(bad[i]));
		assert_says(folder, "not made by pokeysd");
		/* a bad line spoils a good one */
		snprintf(text, sizeof(text), "%s%s", good, bad[i]);
		write_manifest(folder, text, strlen(text));
		attempt(folder);
		assert_string_not_equal(folder->why, "ready");
	}
	write_manifest(folder, good, sizeof(good)); /* with a NUL at the end */
	assert_says(folder, "not made by pokeysd");
	unlink(path_of(folder, "e.1/manifest"));
	assert_int_equal(mkfifo(path_of(folder, "e.1/manifest"), 0600), 0);
	assert_says(folder, "not made by pokeysd");
	unlink(path_of(folder, "e.1/manifest"));
	assert_int_equal(symlink("/dev/zero", path_of(folder, "e.1/manifest")), 0);
	assert_says(folder, "not made by pokeysd");
	unlink(path_of(folder, "e.1/manifest"));
	unlink(path_of(folder, "current"));
	rmdir(path_of(folder, "e.1"));
}

static void huge_manifest_is_refused(void **state)
{
	struct folder *folder = *state;

	mkdir(folder->path, 0700);
	mkdir(path_of(folder, "e.1"), 0700);
	assert_int_equal(symlink("e.1", path_of(folder, "current")), 0);
	write_manifest(folder, "device a\n", 9);
	assert_int_equal(truncate(path_of(folder, "e.1/manifest"), (off_t)1 << 32), 0);
	assert_says(folder, "not made by pokeysd");
	unlink(path_of(folder, "e.1/manifest"));
	unlink(path_of(folder, "current"));
	rmdir(path_of(folder, "e.1"));
}

/* ---- segments of a living daemon, damaged one by one ---- */

static char files[FILES_MAX][256];
static size_t file_count;

static int note_segment(const char *path, const struct stat *status, int type, struct FTW *at)
{
	if (type == FTW_F && S_ISREG(status->st_mode) && at->level > 1 &&
	    !strstr(path, "/nodes/") && !strstr(path, "/manifest") && !strstr(path, "/monitor/") &&
	    file_count < FILES_MAX)
		snprintf(files[file_count++], sizeof(files[0]), "%s", path);
	return 0;
}

static void empty(const char *path, off_t size)
{
	(void)size;
	assert_int_equal(truncate(path, 0), 0);
}

static void halve(const char *path, off_t size)
{
	assert_int_equal(truncate(path, size / 2), 0);
}

static void remove_file(const char *path, off_t size)
{
	(void)size;
	assert_int_equal(unlink(path), 0);
}

static void become_fifo(const char *path, off_t size)
{
	(void)size;
	assert_int_equal(unlink(path), 0);
	assert_int_equal(mkfifo(path, 0666), 0);
}

/* The version that iceoryx2 begins its segments with is overwritten, too. */
static void overwrite(const char *path, off_t size)
{
	char *noise = malloc((size_t)size);
	int fd;

	for (off_t i = 0; i < size; i++)
		noise[i] = (char)rand();
	noise[0] = '\xff';
	chmod(path, 0666);
	fd = open(path, O_WRONLY);
	assert_int_equal(write(fd, noise, (size_t)size), size);
	close(fd);
	free(noise);
}

/*
 * A new daemon for each file: killed first, because it maps what is damaged.
 * What has the right size cannot always be seen to be wrong (overwrite), but
 * then it must be harmless.
 */
static void damage_each(struct folder *folder, void (*damage)(const char *, off_t))
{
	struct shm_device *mill;
	struct stat status;
	char said[256];
	size_t refused = 0;
	pid_t daemon;

	for (size_t i = 0;; i++) {
		daemon = folder_peer(folder, "host", said);
		assert_string_equal(said, "ready");
		folder_end_peer(daemon, SIGKILL);
		file_count = 0;
		assert_int_equal(nftw(folder->path, note_segment, 8, FTW_PHYS), 0);
		if (i == file_count)
			break;
		assert_int_equal(stat(files[i], &status), 0);
		damage(files[i], status.st_size);
		refused += strcmp(attempt(folder), "ready") != 0;
	}
	assert_true(file_count >= 15);
	if (damage != overwrite)
		assert_int_equal(refused, file_count);
	else
		assert_true(refused > 0);
	shm_host_close(folder_host_mill(folder, &mill));
}

static void empty_segments_are_refused(void **state)
{
	damage_each(*state, empty);
}

static void truncated_segments_are_refused(void **state)
{
	damage_each(*state, halve);
}

static void missing_segments_mean_a_daemon_that_is_gone(void **state)
{
	damage_each(*state, remove_file);
}

static void segments_that_are_no_files_are_refused(void **state)
{
	damage_each(*state, become_fifo);
}

static void overwritten_segments_do_not_crash_a_client(void **state)
{
	srand(folder_seed());
	damage_each(*state, overwrite);
}

static void damage_is_named(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	char said[256];

	folder_end_peer(folder_peer(folder, "host", said), SIGKILL);
	file_count = 0;
	nftw(folder->path, note_segment, 8, FTW_PHYS);
	assert_int_equal(truncate(files[0], 3), 0);
	assert_says(folder, files[0]);
	assert_says(folder, "has 3 bytes, pokeysd made it ");
	shm_host_close(folder_host_mill(folder, &mill));
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(missing_folder_means_no_daemon),
		BOTH(folder_that_is_a_file_means_no_daemon),
		BOTH(foreign_links_are_refused),
		BOTH(current_that_is_no_link_is_refused),
		BOTH(link_to_nothing_means_a_daemon_that_is_gone),
		BOTH(manifests_that_are_none_are_refused),
		BOTH(huge_manifest_is_refused),
		BOTH(empty_segments_are_refused),
		BOTH(truncated_segments_are_refused),
		BOTH(missing_segments_mean_a_daemon_that_is_gone),
		BOTH(segments_that_are_no_files_are_refused),
		BOTH(overwritten_segments_do_not_crash_a_client),
		BOTH(damage_is_named),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
