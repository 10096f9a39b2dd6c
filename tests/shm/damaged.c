/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Files of iceoryx2 may hold anything, and may change while they are mapped. A process that
 * attaches reads and writes only inside its mappings, comes to an end, and says one line.
 *
 * The daemon is stopped while its files are damaged. POKEYS_DAMAGED sets how many damaged
 * files are tried (default 5,000).
 */
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "shm/iox.h"
#include "tests/shm/folder.h"

enum { FILES_MAX = 32, BYTES_MAX = 32768, PATH_MAX_HERE = 256, MEMBERS_AT = 8 };

static struct file {
	char path[PATH_MAX_HERE];
	unsigned char good[BYTES_MAX];
	size_t size;
	mode_t mode;
} files[FILES_MAX];
static size_t count;

static int keep(const char *path, const struct stat *status, int type, struct FTW *ftw)
{
	struct file *file = &files[count];
	int fd;

	(void)ftw;
	/* all that is made once; a node's are its own */
	if (type != FTW_F || strstr(path, "/nodes/") || strstr(path, "manifest"))
		return 0;
	assert_true(count < FILES_MAX && status->st_size <= BYTES_MAX);
	snprintf(file->path, sizeof(file->path), "%s", path);
	fd = open(path, O_RDONLY);
	file->size = (size_t)status->st_size;
	file->mode = status->st_mode & 0777;
	assert_int_equal(read(fd, file->good, file->size), status->st_size);
	close(fd);
	count++;
	return 0;
}

/* As it was; some are removed by whoever believes to be the last one. */
static void put(const struct file *file, const unsigned char *bytes, size_t size)
{
	int fd = open(file->path, O_WRONLY | O_CREAT, 0600);

	if (fd < 0)
		_exit(2);
	if (pwrite(fd, bytes, file->size, 0) < 0 || ftruncate(fd, (off_t)size) ||
	    fchmod(fd, file->mode))
		_exit(2);
	close(fd);
}

static void restore(const struct file *damaged)
{
	for (size_t i = 0; i < count; i++)
		if (&files[i] == damaged || access(files[i].path, F_OK))
			put(&files[i], files[i].good, files[i].size);
}

static uint64_t odd_number(void)
{
	static const uint64_t odd[] = {
		0,
		1,
		2,
		3,
		7,
		8,
		15,
		16,
		64,
		4095,
		4096,
		65536,
		UINT64_MAX,
		UINT64_MAX - 1,
		UINT64_MAX - 7,
		INT64_MAX,
		(uint64_t)INT64_MIN,
		UINT32_MAX,
		1ull << 32,
		0x7fffffffe000,
		0xffff800000000000,
	};

	return rand() % 4 ? odd[(size_t)rand() % (sizeof(odd) / sizeof(*odd))] :
			    (uint64_t)rand() << 32 | (uint64_t)rand();
}

static void damage_words(unsigned char *bytes, size_t size)
{
	for (int i = rand() % 4; i >= 0 && size >= 8; i--) {
		const uint64_t word = odd_number();

		/* most of what leads anywhere is at the beginning */
		memcpy(bytes + (size_t)rand() % (rand() % 2 && size > 256 ? 249 : size - 7) / 8 * 8,
		       &word, 8);
	}
}

static void damage_bytes(unsigned char *bytes, size_t size)
{
	for (int i = rand() % 8; i >= 0; i--)
		bytes[(size_t)rand() % size] ^= (unsigned char)(1u << rand() % 8);
}

static void damage_stretch(unsigned char *bytes, size_t size)
{
	const size_t begin = (size_t)rand() % size;

	for (size_t i = begin; i < size && i < begin + 64; i++)
		bytes[i] = (unsigned char)rand();
}

static const struct file *damage(void)
{
	static void (*const ways[])(unsigned char *, size_t) = {
		damage_words,
		damage_words,
		damage_bytes,
		damage_stretch,
	};
	const struct file *file = &files[(size_t)rand() % count];
	unsigned char bytes[BYTES_MAX];
	size_t size = file->size;

	memcpy(bytes, file->good, size);
	ways[rand() % 4](bytes, size);
	if (rand() % 16 == 0)
		size = 1 + (size_t)rand() % (2 * size);
	put(file, bytes, size);
	return file;
}

/* Take the commander's place and all seats, use them, and leave. */
static void use(const struct iox_node *node)
{
	static union {
		struct pokeys_state state;
		struct pokeys_diag diag;
		struct pokeys_report report;
	} image;
	struct iox_command_writer *command = NULL;
	struct iox_state_reader *state = NULL;
	struct iox_diag_reader *diag = NULL;
	struct iox_report_reader *report = NULL;

	if (!iox_command_writer_open(node, "pokeys/mill/command", &command, NULL)) {
		memset(iox_command_loan(command), 0, sizeof(struct pokeys_command));
		iox_command_commit(command);
	}
	if (!iox_state_reader_open(node, "pokeys/mill/state", &state, NULL))
		iox_state_read(state, &image.state);
	if (!iox_diag_reader_open(node, "pokeys/mill/diag", &diag, NULL))
		iox_diag_read(diag, &image.diag);
	if (!iox_report_reader_open(node, "pokeys/mill/settings", &report, NULL))
		iox_report_read(report, &image.report);
	iox_writers(node, "pokeys/mill/command", NULL, NULL);
	if (command)
		iox_command_writer_close(command);
	if (state)
		iox_state_reader_close(state);
	if (diag)
		iox_diag_reader_close(diag);
	if (report)
		iox_report_reader_close(report);
}

static void root_of(const struct folder *folder, char root[static 64])
{
	char name[32];
	char path[64];
	ssize_t length;

	snprintf(path, sizeof(path), "%s/current", folder->path);
	length = readlink(path, name, sizeof(name) - 1);
	assert_true(length > 0);
	snprintf(root, 64, "%s/%.*s", folder->path, (int)length, name);
}

/* A daemon that is stopped, and its files. */
static pid_t begin(struct folder *folder, char root[static 64])
{
	const pid_t daemon = folder_peer(folder, "host", folder->why);

	assert_string_equal(folder->why, "ready");
	kill(daemon, SIGSTOP);
	root_of(folder, root);
	count = 0;
	assert_int_equal(nftw(root, keep, 8, FTW_PHYS), 0);
	assert_true(count > 15);
	return daemon;
}

static void finish(struct folder *folder, pid_t daemon)
{
	struct shm_device *mill;

	folder_end_peer(daemon, SIGKILL);
	shm_host_close(folder_host_mill(folder, &mill));
}

static void in_a_process(struct folder *folder, const char *root,
			 void (*work)(const struct iox_node *, unsigned int))
{
	static const int fatal[] = { SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT };
	const unsigned int times = folder_count("POKEYS_DAMAGED", 5000);
	struct iox_node *node;
	int status;
	pid_t pid;

	srand(folder_seed());
	fflush(stdout);
	pid = fork();
	if (!pid) {
		for (size_t i = 0; i < sizeof(fatal) / sizeof(*fatal); i++)
			signal(fatal[i], SIG_DFL); /* cmocka would go on */
		if (iox_node_open(root, "test", &node, NULL))
			_exit(3);
		work(node, times);
		_exit(0);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	if (status)
		fail_msg("%s: status %#x", folder->path, (unsigned int)status);
}

static void use_damaged(const struct iox_node *node, unsigned int times)
{
	for (unsigned int i = 0; i < times; i++) {
		const struct file *file = damage();

		use(node);
		restore(file);
	}
}

static void damaged_files_do_not_crash_who_attaches(void **state)
{
	struct folder *folder = *state;
	char root[64];
	const pid_t daemon = begin(folder, root);

	in_a_process(folder, root, use_damaged);
	finish(folder, daemon);
}

/* Somebody of the group, who changes what others have mapped; cut files would be a SIGBUS. */
static pid_t start_vandal(void)
{
	const pid_t parent = getpid();
	const pid_t pid = fork();
	unsigned char *mapped[FILES_MAX];

	if (pid)
		return pid;
	srand((unsigned int)parent);
	for (size_t i = 0; i < count; i++) {
		int fd = open(files[i].path, O_RDWR);

		mapped[i] = mmap(NULL, files[i].size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
		close(fd);
	}
	while (getppid() == parent) {
		const size_t i = (size_t)rand() % count;

		damage_words(mapped[i], files[i].size);
		if (rand() % 4 == 0)
			memcpy(mapped[i], files[i].good, files[i].size);
	}
	_exit(0);
}

static void use_vandalised(const struct iox_node *node, unsigned int times)
{
	const pid_t vandal = start_vandal();

	for (unsigned int i = 0; i < times / 4; i++)
		use(node);
	kill(vandal, SIGKILL);
	waitpid(vandal, NULL, 0);
}

static void files_may_change_while_they_are_used(void **state)
{
	struct folder *folder = *state;
	char root[64];
	const pid_t daemon = begin(folder, root);

	in_a_process(folder, root, use_vandalised);
	finish(folder, daemon);
}

static const char *attempt(struct folder *folder)
{
	pid_t pid = folder_peer(folder, "once", folder->why);
	int status;

	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_int_equal(status, 0);
	return folder->why;
}

static void spoil_all(const char *suffix, size_t at, uint64_t word)
{
	for (size_t i = 0; i < count; i++) {
		unsigned char bytes[BYTES_MAX];

		if (!strstr(files[i].path, suffix))
			continue;
		memcpy(bytes, files[i].good, files[i].size);
		memcpy(bytes + at, &word, sizeof(word));
		put(&files[i], bytes, files[i].size);
	}
}

static void restore_all(void)
{
	for (size_t i = 0; i < count; i++)
		put(&files[i], files[i].good, files[i].size);
}

/* The list of a service's nodes: their number, and the distance to them. */
static size_t nodes_at(void)
{
	for (size_t i = 0; i < count; i++)
		for (size_t at = MEMBERS_AT; strstr(files[i].path, ".dynamic") && at + 16 < 512;
		     at += 8) {
			uint64_t words[2];

			memcpy(words, files[i].good + at, 16);
			if (words[0] == 72 && words[1] < files[i].size)
				return at;
		}
	fail_msg("no list of nodes");
	return 0;
}

static void what_is_wrong_is_told(void **state)
{
	struct folder *folder = *state;
	char root[64];
	const pid_t daemon = begin(folder, root);

	assert_string_equal(attempt(folder), "ready");
	spoil_all(".dynamic", nodes_at() + 8, 0x7f0000001000);
	assert_non_null(strstr(attempt(folder), "a list of members is not inside of its file"));
	spoil_all(".dynamic", MEMBERS_AT, 77);
	assert_non_null(strstr(attempt(folder), "the head of a file is not one"));
	restore_all();
	assert_string_equal(attempt(folder), "ready");
	finish(folder, daemon);
}

/* What a commander maps has been made by the daemon, and by nobody else. */
static void what_others_put_there_is_not_mapped(void **state)
{
	struct folder *folder = *state;
	char root[64];
	const pid_t daemon = begin(folder, root);

	if (geteuid()) {
		fprintf(stderr, "needs root, to make other users' files\n");
		finish(folder, daemon);
		skip();
	}
	for (size_t i = 0; i < count; i++)
		assert_int_equal(strstr(files[i].path, ".dynamic") &&
					 chown(files[i].path, 4001, 4001),
				 0);
	assert_non_null(strstr(attempt(folder), "a file is not the one that pokeysd made"));
	for (size_t i = 0; i < count; i++)
		assert_int_equal(chown(files[i].path, 0, 0), 0);
	assert_string_equal(attempt(folder), "ready");
	assert_int_equal(chmod(root, 02770), 0);
	assert_non_null(strstr(attempt(folder), "others than pokeysd may put files there"));
	assert_int_equal(chmod(root, 02750), 0);
	assert_string_equal(attempt(folder), "ready");
	finish(folder, daemon);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(damaged_files_do_not_crash_who_attaches),
		BOTH(files_may_change_while_they_are_used),
		BOTH(what_is_wrong_is_told),
		BOTH(what_others_put_there_is_not_mapped),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
