// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The files of the flight recorder's folder: which of them are removed, and that those
 * of anybody else, or of another pokeysd, are not.
 */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/keeper.h"
#include "daemon/recorder/read.h"
#include "tests/control/folder.h"

static char records[64], ring[96];
static gid_t readers;

static int setup(void **state)
{
	struct recorder recorder;

	(void)state;
	readers = (gid_t)-1;
	strcpy(records, "/tmp/pokeysd-test-keeper.XXXXXX");
	assert_non_null(mkdtemp(records));
	snprintf(ring, sizeof(ring), "%s.ring", records);
	assert_int_equal(recorder_create(&recorder, ring, RECORDER_SLOTS_MIN), 0);
	recorder_close(&recorder);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	unlink(ring);
	return folder_remove(records);
}

static int files(const char *part)
{
	return folder_count(records, part);
}

/* An empty file in the folder; its descriptor. */
static int make(const char *name)
{
	char path[KEEPER_PATH];
	int fd;

	snprintf(path, sizeof(path), "%s/%s", records, name);
	fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
	assert_true(fd >= 0);
	return fd;
}

static int write_record(uint32_t most, enum record_reason why, char path[KEEPER_PATH])
{
	_Atomic bool begun = false;
	uint64_t packets;

	const struct keeper_order order = {
		.ring = ring,
		.folder = records,
		.reason = why,
		.files = most,
		.readers = readers,
	};

	return keeper_write(&order, path, &begun, &packets);
}

static void the_oldest_are_removed_and_nothing_else(void **state)
{
	static const char *const others[] = {
		"pokeysd-20200101T000000Z-lost.pcapng",
		"pokeysd-20200102T000000Z-late.pcapng",
		"pokeysd-20200103T000000Z-lost.pcapng",
		"notes.txt",
		"mine.pcapng",
	};
	char path[KEEPER_PATH];

	(void)state;
	for (size_t i = 0; i < sizeof(others) / sizeof(*others); i++)
		close(make(others[i]));
	assert_int_equal(write_record(3, RECORD_LATE, path), 0);
	assert_int_equal(files("pokeysd-"), 3);
	assert_int_equal(files("20200101"), 0);
	assert_int_equal(files("20200102"), 1);
	assert_int_equal(files("notes.txt") + files("mine.pcapng"), 2);
	assert_int_equal(access(path, R_OK), 0);
	assert_int_equal(files(".new"), 0);
}

static void those_who_may_read_the_devices_may_read_it(void **state)
{
	const gid_t group = 65534;
	char path[KEEPER_PATH];
	struct stat file;

	(void)state;
	if (geteuid())
		skip(); /* only root may give it to any group */
	assert_int_equal(write_record(3, RECORD_LATE, path), 0);
	assert_int_equal(stat(path, &file), 0);
	assert_int_equal(file.st_gid, getegid());
	unlink(path);
	readers = group;
	umask(0);
	assert_int_equal(write_record(3, RECORD_LATE, path), 0);
	umask(022);
	assert_int_equal(stat(path, &file), 0);
	assert_int_equal(file.st_gid, group);
	assert_int_equal(file.st_mode & 07777, 0640);
}

static void what_is_being_written_and_what_is_not_ours_stays(void **state)
{
	static const char left[] = "pokeysd-20200101T000000Z-lost.pcapng.new";
	static const char *const others[] = {
		"pokeysd-20200101T000000Z-lost.pcapng",
		"pokeysd-20200101T000000Z-lost.new",
		"pokeysd-20200101T000000Z-mine.pcapng.new",
		"pokeysd-mine-lost.pcapng.new",
		"mine.pcapng.new",
		"mine-20200101T000000Z-lost.pcapng.new",
		"pokeysd-20200101T000000Z-lost.pcapng.new.new",
	};
	char path[KEEPER_PATH];
	int fd;

	(void)state;
	close(make(left));
	fd = make("pokeysd-20200102T000000Z-died.pcapng.new");
	assert_int_equal(flock(fd, LOCK_EX), 0); /* as if it were another process */
	for (size_t i = 0; i < sizeof(others) / sizeof(*others); i++)
		close(make(others[i]));
	snprintf(path, sizeof(path), "%s/pokeysd-20200103T000000Z-late.pcapng.new", records);
	assert_int_equal(mkdir(path, 0700), 0);
	snprintf(path, sizeof(path), "%s/pokeysd-20200104T000000Z-late.pcapng.new", records);
	assert_int_equal(symlink("mine.pcapng.new", path), 0);
	keeper_tidy(records);
	assert_int_equal(files(left), 1); /* the one with two ends */
	assert_int_equal(files("pokeysd-20200102"), 1);
	assert_int_equal(files("-late.pcapng.new"), 2);
	assert_int_equal(files(""), 1 + (int)(sizeof(others) / sizeof(*others)) + 2);
	close(fd);
	keeper_tidy(records);
	assert_int_equal(files("pokeysd-20200102"), 0);
}

static void files_of_anybody_else_are_not_removed(void **state)
{
	int fd = make("pokeysd-20200101T000000Z-lost.pcapng.new");

	(void)state;
	if (fchown(fd, 65534, (gid_t)-1)) {
		close(fd);
		skip();
	}
	close(fd);
	keeper_tidy(records);
	assert_int_equal(files(".new"), 1);
}

/* Two daemons, one folder, and a cable that both hang on: neither takes the other's. */
static void a_name_that_is_taken_is_left_to_who_has_it(void **state)
{
	const time_t now = time(NULL);
	char path[KEEPER_PATH], name[64];
	int fd[5];

	(void)state;
	for (int i = 0; i < 5; i++) {
		const time_t when = now + i;
		struct tm parts;

		gmtime_r(&when, &parts);
		strftime(name, sizeof(name), "pokeysd-%Y%m%dT%H%M%SZ-limit.pcapng", &parts);
		close(make(name));
		strftime(name, sizeof(name), "pokeysd-%Y%m%dT%H%M%SZ-late.pcapng.new", &parts);
		fd[i] = make(name);
		assert_int_equal(flock(fd[i], LOCK_EX), 0);
	}
	assert_int_equal(write_record(20, RECORD_LATE, path), 0);
	assert_int_equal(files("-late.pcapng.new"), 5);
	assert_int_equal(files("-late.pcapng"), 6);
	assert_int_equal(write_record(20, RECORD_LIMIT, path), 0);
	assert_int_equal(files("-limit.pcapng"), 6);
	assert_int_equal(files("-limit.pcapng.new"), 0);
	for (int i = 0; i < 5; i++)
		close(fd[i]);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
	const struct CMUnitTest tests[] = {
		TEST(the_oldest_are_removed_and_nothing_else),
		TEST(those_who_may_read_the_devices_may_read_it),
		TEST(what_is_being_written_and_what_is_not_ours_stays),
		TEST(files_of_anybody_else_are_not_removed),
		TEST(a_name_that_is_taken_is_left_to_who_has_it),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
