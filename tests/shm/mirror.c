/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The mirror: who only reads sees all of it and leaves nothing, whatever stands in its place is
 * refused in words or harmless, and a user who may read may do nothing else.
 *
 * POKEYS_DAMAGED sets how many damaged files are tried (default 30,000).
 */
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <grp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "shm/host_private.h"
#include "shm/mirror.h"
#include "tests/shm/folder.h"

enum {
	OWNER = 4001,
	GROUP = 4002,
	MONITOR = 4003,
	MONITORS = 4004, /* nobody's numbers */
	PATHS_MAX = 200,
};

static char *path_of(const struct folder *folder, const char *name)
{
	static char path[128];

	snprintf(path, sizeof(path), "%s/%s", folder->path, name);
	return path;
}

/* ---- what is read */

static void all_images_are_mirrored(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_report report = { .count = 99 };
	struct pokeys_diag diag = { .cycle = 7 };
	struct pokeys_state image;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	for (uint64_t cycle = 1; cycle < 10; cycle++) {
		folder_pattern(&image, cycle);
		shm_device_write(mill, &image);
		memset(&image, 0, sizeof(image));
		assert_int_equal(pokeys_client_read(client, &image), 0);
		assert_true(folder_pattern_whole(&image));
		assert_int_equal(image.cycle, cycle);
		assert_int_equal(image.epoch, shm_host_epoch(host));
	}
	shm_device_write_diag(mill, &diag);
	shm_device_write_report(mill, &report);
	diag.cycle = report.count = 0;
	assert_int_equal(pokeys_client_read_diag(client, &diag), 0);
	assert_int_equal(diag.cycle, 7);
	assert_int_equal(pokeys_client_read_report(client, &report), 0);
	assert_int_equal(report.count, 99);
	pokeys_client_close(client);
	shm_host_close(host);
}

static unsigned int things;

static int count_one(const char *path, const struct stat *status, int type, struct FTW *at)
{
	(void)path, (void)status, (void)type, (void)at;
	things++;
	return 0;
}

/* One mapping, which cannot be written, and no file more than before. */
static void a_reader_leaves_no_trace(void **state)
{
	struct folder *folder = *state;
	const pid_t daemon = folder_peer(folder, "host", (char[256]){ "" });
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_EVENTS);
	unsigned int before, mapped = 0;
	char line[512], mode[8];
	FILE *maps;

	nftw(folder->path, count_one, 16, FTW_PHYS);
	before = things;
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	maps = fopen("/proc/self/maps", "r");
	while (fgets(line, sizeof(line), maps)) {
		if (!strstr(line, folder->path))
			continue;
		assert_int_equal(sscanf(line, "%*s %7s", mode), 1);
		assert_string_equal(mode, "r--s");
		mapped++;
	}
	fclose(maps);
	assert_int_equal(mapped, 1);
	things = 0;
	nftw(folder->path, count_one, 16, FTW_PHYS);
	assert_int_equal(things, before);
	pokeys_client_close(client);
	assert_int_equal(folder_end_peer(daemon, SIGTERM), 0);
}

/* It has begun to write and not counted yet; then it is killed. */
static void a_write_that_never_ends_harms_nobody(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	struct mirror_cells *cells;
	struct pokeys_state image;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	folder_pattern(&image, 5);
	shm_device_write(mill, &image);
	cells = &mill->mirror.image[MIRROR_STATE];
	memset(cells->cell[(*cells->counter + 1) & 1], 0xee, cells->size / 2);
	assert_int_equal(pokeys_client_read(client, &image), 0);
	assert_true(folder_pattern_whole(&image) && image.cycle == 5);
	pokeys_client_close(client);
	shm_host_close(host);
}

/* What it was told is old by then, and it sees that by its own clock. */
static void the_next_daemons_file_is_noticed(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_state image;
	struct shm_device *mill;
	struct shm_host *host;

	for (int i = 0; i < 5; i++) {
		folder_end_peer(folder_peer(folder, "host", (char[256]){ "" }), SIGKILL);
		assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
		assert_int_equal(pokeys_client_read(client, &image), 0);
		host = folder_host_mill(folder, &mill);
		assert_int_equal(pokeys_client_read(client, &image), 0); /* still the old */
		assert_true(image.epoch != shm_host_epoch(host));
		assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
		assert_int_equal(pokeys_client_read(client, &image), 0);
		assert_true(image.epoch == shm_host_epoch(host));
		shm_host_close(host);
	}
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_DETACHED);
	pokeys_client_close(client);
}

/* Whoever takes the only device must not take the first that has a file. */
static void devices_are_listed_together_or_not_at_all(void **state)
{
	static const char *const devices[] = { "mill", "lathe", "panel", NULL };
	struct folder *folder = *state;
	struct shm_device *opened[3];
	struct shm_host *host = folder_host(folder, opened, devices);
	char names[4][POKEYS_SHM_NAME_MAX];

	assert_int_equal(pokeys_shm_devices(folder->path, names, 4), 3);
	assert_string_equal(names[2], "panel");
	assert_int_equal(unlink(path_of(folder, MIRROR_FOLDER "/lathe")), 0);
	assert_int_equal(pokeys_shm_devices(folder->path, names, 4), 0);
	assert_int_equal(shm_host_maintain(host), -ESTALE);
	shm_host_close(host);
}

/* ... or it is a daemon of before there were mirrors. */
static void a_folder_that_somebody_removes_is_told(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	char names[1][POKEYS_SHM_NAME_MAX];

	assert_int_equal(unlink(path_of(folder, MIRROR_FOLDER "/mill")), 0);
	assert_int_equal(rmdir(path_of(folder, MIRROR_FOLDER)), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_REFUSED);
	assert_non_null(strstr(folder_status(folder, client),
			       "is of another version, or somebody "
			       "has removed its folder monitor; restart pokeysd"));
	assert_int_equal(pokeys_shm_devices(folder->path, names, 1), -EPROTONOSUPPORT);
	assert_int_equal(shm_host_maintain(host), -ESTALE);
	pokeys_client_close(client);
	shm_host_close(host);
}

/* ---- what is refused */

static void assert_said(struct folder *folder, const struct mirror_head *head, size_t length,
			const char *words)
{
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_state image;
	int fd = open(path_of(folder, MIRROR_FOLDER "/mill"), O_WRONLY | O_TRUNC);

	assert_int_equal(write(fd, head, length), length);
	assert_int_equal(ftruncate(fd, (off_t)head->file_size), 0);
	close(fd);
	pokeys_client_poll(client);
	if (!strstr(folder_status(folder, client), words))
		fail_msg("it said: %s", folder->why);
	assert_int_equal(pokeys_client_read(client, &image), -ENOTCONN);
	pokeys_client_close(client);
}

static void other_versions_are_refused_in_words(void **state)
{
	struct folder *folder = *state;
	struct mirror_head good, head;
	struct shm_device *mill;
	char words[128];

	folder_end_peer(folder_peer(folder, "host", (char[256]){ "" }), SIGKILL);
	int fd = open(path_of(folder, MIRROR_FOLDER "/mill"), O_RDONLY);
	assert_int_equal(read(fd, &good, sizeof(good)), sizeof(good));
	close(fd);
	head = good;
	head.version++;
	assert_said(folder, &head, sizeof(head),
		    "the daemon speaks mirror version 3, this program "
		    "2; install daemon and program of one version");
	head = good;
	head.part[MIRROR_REPORT].version = 77;
	snprintf(words, sizeof(words), "the daemon speaks report layout 77, this program %d",
		 POKEYS_REPORT_VERSION);
	assert_said(folder, &head, sizeof(head), words);
	head = good;
	head.part[MIRROR_DIAG].hash ^= 1;
	assert_said(folder, &head, sizeof(head), "install daemon and program of one build");
	head = good;
	memcpy(head.boot, "0", 2);
	assert_said(folder, &head, sizeof(head), "before this machine was started");
	head = good;
	head.magic = 0;
	assert_said(folder, &head, sizeof(head), "/monitor/mill: not a file that pokeysd made");
	head = good;
	assert_said(folder, &head, 100, "/monitor/mill: not a file that pokeysd made");
	shm_host_close(folder_host_mill(folder, &mill));
}

static void what_is_no_file_is_refused(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, 0);

	mkdir(folder->path, 0700);
	mkdir(path_of(folder, MIRROR_FOLDER), 0700);
	for (int how = 0; how < 4; how++) {
		const char *path = path_of(folder, MIRROR_FOLDER "/mill");

		assert_int_equal(how == 0 ? mkfifo(path, 0666) :
				 how == 1 ? mkdir(path, 0700) :
				 how == 2 ? symlink("/etc/passwd", path) :
					    close(open(path, O_CREAT | O_WRONLY, 0600)),
				 0);
		assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_REFUSED);
		assert_non_null(strstr(folder_status(folder, client), "/monitor/mill: "));
		assert_int_equal(remove(path), 0);
	}
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_DETACHED);
	rmdir(path_of(folder, MIRROR_FOLDER));
	pokeys_client_close(client);
}

/* Any byte of the head, and numbers that a check forgets. */
static void damage(unsigned char *bytes, size_t size)
{
	static const uint32_t odd[] = {
		0, 1, 63, 64, 0x7fffffff, 0x80000000, 0xffffffc0, 0xffffffff
	};
	const int many = 1 + rand() % 4;
	uint32_t word;

	for (int i = 0; i < many; i++) {
		size_t at = (size_t)rand() % sizeof(struct mirror_head);

		if (rand() % 2) {
			bytes[at] ^= (unsigned char)(1 << rand() % 8);
			continue;
		}
		at -= at % 4;
		word = odd[rand() % 8];
		if (rand() % 3 == 0)
			word = (uint32_t)(size - (size_t)(rand() % 200));
		memcpy(bytes + at, &word, sizeof(word));
	}
}

static void try_damaged(struct folder *folder, unsigned char *good, size_t size)
{
	unsigned char *bytes = malloc(size);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_EVENTS);
	const char *path = path_of(folder, MIRROR_FOLDER "/mill");
	static union {
		struct pokeys_state state;
		struct pokeys_diag diag;
		struct pokeys_report report;
	} image;
	static struct pokeys_event events[8];
	struct pokeys_events_cursor cursor = {
		.epoch = ((struct mirror_head *)(void *)good)->epoch,
		.next = rand() % 2 ? 0 : UINT64_MAX - (uint64_t)(rand() % 3),
	};
	int fd, count;

	memcpy(bytes, good, size);
	damage(bytes, size);
	unlink(path);
	fd = open(path, O_CREAT | O_EXCL | O_WRONLY, 0600);
	if (write(fd, bytes, rand() % 10 ? size : (size_t)rand() % size) < 0)
		_exit(2);
	close(fd);
	if (pokeys_client_poll(client) == POKEYS_CLIENT_ATTACHED) {
		pokeys_client_read(client, &image.state);
		pokeys_client_read_diag(client, &image.diag);
		pokeys_client_read_report(client, &image.report);
		count = pokeys_client_read_events(client, &cursor, events, sizeof(events[0]), 8);
		for (int i = 0; i < count; i++)
			if (strlen(events[i].text) >= sizeof(events[i].text) ||
			    strlen(events[i].kind) >= sizeof(events[i].kind))
				_exit(3);
		pokeys_client_wait(client, 0);
	}
	pokeys_client_close(client);
	free(bytes);
}

/* As if there were some, up to the last possible number. */
static void put_events(unsigned char *file)
{
	const struct mirror_ring *ring = &((struct mirror_head *)(void *)file)->events;
	const uint64_t newest = UINT64_MAX;

	memcpy(file + ring->counter, &newest, sizeof(newest));
	for (uint64_t i = 0; i < ring->slots; i++) {
		const uint64_t number = newest - i;
		unsigned char *slot = file + ring->slot +
				      (number - 1) % ring->slots * ring->slot_size;

		memset(slot, 0xff, ring->slot_size);
		memcpy(slot, &number, sizeof(number));
	}
}

static void damaged_files_do_not_crash_a_reader(void **state)
{
	const unsigned int count = folder_count("POKEYS_DAMAGED", 30000);
	struct folder *folder = *state;
	static unsigned char good[1 << 18] __attribute__((aligned(8)));
	struct shm_device *mill;
	ssize_t size;
	int status;
	pid_t pid;

	folder_end_peer(folder_peer(folder, "host", (char[256]){ "" }), SIGKILL);
	int fd = open(path_of(folder, MIRROR_FOLDER "/mill"), O_RDONLY);
	size = read(fd, good, sizeof(good));
	assert_in_range(size, sizeof(struct mirror_head), sizeof(good) - 1);
	close(fd);
	srand(folder_seed());
	put_events(good);
	pid = fork();
	if (!pid) {
		for (unsigned int i = 0; i < count; i++)
			try_damaged(folder, good, (size_t)size);
		_exit(0);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_int_equal(status, 0);
	shm_host_close(folder_host_mill(folder, &mill));
}

/* ---- a user who may read and nothing else */

static void become(uid_t user, gid_t group, gid_t more)
{
	if (setgroups(1, &more) || setresgid(group, group, group) || setresuid(user, user, user))
		_exit(99);
	umask(0);
	prctl(PR_SET_PDEATHSIG, SIGKILL);
}

static pid_t start_daemon(struct folder *folder)
{
	struct shm_device *mill;
	struct shm_host *host;
	struct pokeys_state image;
	char ready = 0;
	int pipe_fds[2];
	pid_t pid;

	assert_int_equal(mkdir(folder->path, 0700), 0);
	assert_int_equal(chown(folder->path, OWNER, GROUP), 0);
	assert_int_equal(chmod(folder->path, 02751), 0);
	assert_int_equal(pipe(pipe_fds), 0);
	pid = fork();
	if (!pid) {
		become(OWNER, GROUP, MONITORS);
		if (shm_host_open(&host, folder->path, NULL, "4004", folder->why,
				  sizeof(folder->why)) ||
		    shm_host_add(host, "mill", &mill, folder->why, sizeof(folder->why)) ||
		    shm_host_publish(host, folder->why, sizeof(folder->why)))
			fprintf(stderr, "%s\n", folder->why);
		else if (write(pipe_fds[1], "r", 1) != 1)
			_exit(1);
		for (uint64_t cycle = 1;; cycle++) {
			folder_pattern(&image, cycle);
			shm_device_write(mill, &image);
			shm_host_maintain(host);
			folder_sleep_ms(1);
		}
	}
	close(pipe_fds[1]);
	assert_int_equal(read(pipe_fds[0], &ready, 1), 1);
	close(pipe_fds[0]);
	return pid;
}

static char paths[PATHS_MAX][256];
static size_t path_count;

static int note_path(const char *path, const struct stat *status, int type, struct FTW *at)
{
	(void)status, (void)type, (void)at;
	if (path_count < PATHS_MAX)
		snprintf(paths[path_count++], sizeof(paths[0]), "%s", path);
	return 0;
}

static bool is_mirror(const struct folder *folder, const char *path)
{
	return !strncmp(path, path_of(folder, MIRROR_FOLDER),
			strlen(folder->path) + 1 + strlen(MIRROR_FOLDER));
}

/* What may be done to one thing of the daemon's: nothing, but looking where the mirror is. */
static const char *harm(const struct folder *folder, const char *path)
{
	char inside[300], elsewhere[300];

	snprintf(inside, sizeof(inside), "%s/x", path);
	snprintf(elsewhere, sizeof(elsewhere), "%s.x", path);
	if (open(path, O_WRONLY | O_CLOEXEC) >= 0 || open(path, O_RDWR | O_CLOEXEC) >= 0)
		return "opens it for writing";
	if (!is_mirror(folder, path) && open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW) >= 0)
		return "opens it";
	if (!truncate(path, 0) || !chmod(path, 0777) || !chown(path, MONITOR, MONITOR))
		return "changes it";
	if (!unlink(path) || !rmdir(path) || !rename(path, elsewhere) || !rename(elsewhere, path))
		return "removes it";
	if (!mkdir(inside, 0777) || !symlink("x", inside) || !mkdir(elsewhere, 0777) ||
	    open(inside, O_CREAT | O_WRONLY, 0666) >= 0)
		return "puts something there";
	return NULL;
}

static int try_everything(struct folder *folder, pid_t daemon)
{
	const char *mirror = path_of(folder, MIRROR_FOLDER "/mill");
	pokeys_client *reader = folder_client(folder, POKEYS_CLIENT_EVENTS);
	pokeys_client *commander = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_state image;
	const char *harmed;
	int fd = open(mirror, O_RDONLY);

	if (pokeys_client_poll(reader) != POKEYS_CLIENT_ATTACHED ||
	    pokeys_client_read(reader, &image)) {
		fprintf(stderr, "it may not read: %s\n", folder_status(folder, reader));
		return 1;
	}
	if (pokeys_client_poll(commander) != POKEYS_CLIENT_REFUSED ||
	    !strstr(folder_status(folder, commander), "this user must be in group 4002")) {
		fprintf(stderr, "commanding: %s\n", folder_status(folder, commander));
		return 1;
	}
	for (size_t i = 0; i < path_count; i++) {
		harmed = harm(folder, paths[i]);
		if (harmed) {
			fprintf(stderr, "%s: it %s\n", paths[i], harmed);
			return 1;
		}
	}
	if (mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) != MAP_FAILED ||
	    !mprotect((void *)(uintptr_t)mmap(NULL, 4096, PROT_READ, MAP_SHARED, fd, 0), 4096,
		      PROT_READ | PROT_WRITE) ||
	    !kill(daemon, SIGTERM))
		return 2;
	return flock(fd, LOCK_EX) ? 3 : 0; /* that it may, and nobody minds */
}

static uint64_t cycle_of(pokeys_client *client)
{
	struct pokeys_state image;

	assert_int_equal(pokeys_client_read(client, &image), 0);
	assert_true(folder_pattern_whole(&image));
	return image.cycle;
}

static void who_may_read_may_do_nothing_else(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client;
	struct shm_device *mill;
	uint64_t before, began;
	pid_t daemon, pid;
	int status;

	if (geteuid()) {
		fprintf(stderr, "needs root, to become other users\n");
		skip();
	}
	daemon = start_daemon(folder);
	path_count = 0;
	nftw(folder->path, note_path, 16, FTW_PHYS);
	assert_in_range(path_count, 20, PATHS_MAX - 1);
	pid = fork();
	if (!pid) {
		become(MONITOR, MONITOR, MONITORS);
		status = try_everything(folder, daemon);
		if (status)
			_exit(status);
		raise(SIGSTOP); /* with its lock, and what it has mapped */
		_exit(1);
	}
	assert_int_equal(waitpid(pid, &status, WUNTRACED), pid);
	assert_true(WIFSTOPPED(status));
	client = folder_client(folder, 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	before = cycle_of(client);
	began = folder_now_ns();
	while (cycle_of(client) < before + 100 && folder_now_ns() - began < UINT64_C(60000000000))
		folder_sleep_ms(1);
	assert_true(cycle_of(client) >= before + 100);
	pokeys_client_close(client);
	folder_end_peer(daemon, SIGKILL);
	shm_host_close(folder_host_mill(folder, &mill)); /* the next one is not kept out */
	folder_end_peer(pid, SIGKILL);
}

static void a_group_that_cannot_be_had_is_told(void **state)
{
	struct folder *folder = *state;
	struct shm_host *host;

	assert_int_equal(shm_host_open(&host, folder->path, NULL, "no-such-group", folder->why,
				       sizeof(folder->why)),
			 -ENOENT);
	assert_non_null(strstr(folder->why, "group 'no-such-group' does not exist"));
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		/* the first, which fork from a process that has not used iceoryx2 */
		BOTH(who_may_read_may_do_nothing_else),
		BOTH(damaged_files_do_not_crash_a_reader),
		BOTH(a_reader_leaves_no_trace),
		BOTH(other_versions_are_refused_in_words),
		BOTH(what_is_no_file_is_refused),
		BOTH(all_images_are_mirrored),
		BOTH(a_write_that_never_ends_harms_nobody),
		BOTH(the_next_daemons_file_is_noticed),
		BOTH(devices_are_listed_together_or_not_at_all),
		BOTH(a_folder_that_somebody_removes_is_told),
		BOTH(a_group_that_cannot_be_had_is_told),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
