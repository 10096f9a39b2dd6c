// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One record into its folder.
 *
 * It is written beside and renamed, so that a file of that name is a whole one.
 * Names begin with the time in UTC, so that their order is that of time also in
 * the night in which the clock is set back; the oldest are removed by it. Nothing
 * else in the folder is touched.
 *
 * A daemon that is killed leaves what it had begun, and the next one removes it. Two
 * may share a folder, and a cable that is pulled out is a fault for both in the same
 * second. So whoever writes a file has it locked, and the kernel takes the lock back
 * however he ends: one that can be locked was left. Where a name is taken, that of the
 * next second is.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include "daemon/control/keeper.h"
#include "daemon/recorder/export.h"

#define PREFIX "pokeysd-"
#define TIME "########T######Z-"		/* # is a digit */
#define SUFFIX ".pcapng"
#define BESIDE ".new"

enum { NAMES = 10 };

static const char *const reasons[RECORD_REASONS] = {
	[RECORD_LOST] = "lost",           [RECORD_COMMANDER] = "commander",
	[RECORD_EMERGENCY] = "emergency", [RECORD_LIMIT] = "limit",
	[RECORD_HEATER] = "heater",       [RECORD_SERVO] = "servo",
	[RECORD_LATE] = "late",           [RECORD_TRANSPORT] = "transport",
	[RECORD_DIED] = "died",
};

const char *keeper_word(enum record_reason reason)
{
	return reasons[reason];
}

static int is_record(const struct dirent *entry)
{
	size_t length = strlen(entry->d_name);

	return !strncmp(entry->d_name, PREFIX, strlen(PREFIX)) && length > strlen(SUFFIX) &&
	       !strcmp(entry->d_name + length - strlen(SUFFIX), SUFFIX);
}

/* Leave the newest `files`. */
static void remove_oldest(const char *folder, uint32_t files)
{
	struct dirent **entry;
	int count = scandir(folder, &entry, is_record, alphasort);
	char path[KEEPER_PATH + 256];

	for (int i = 0; i < count; i++) {
		snprintf(path, sizeof(path), "%s/%s", folder, entry[i]->d_name);
		if (count - i > (int)files)
			unlink(path);
		free(entry[i]);
	}
	if (count >= 0)
		free(entry);
}

/* Begun by a pokeysd, and not ended: nobody else gives such a name. */
static int is_begun(const struct dirent *entry)
{
	static const char stem[] = PREFIX TIME;
	const char *name = entry->d_name;
	char rest[64];

	for (const char *at = stem; *at; at++, name++)
		if (*at == '#' ? *name < '0' || *name > '9' : *name != *at)
			return false;
	for (int i = RECORD_NOTHING + 1; i < RECORD_REASONS; i++) {
		snprintf(rest, sizeof(rest), "%s" SUFFIX BESIDE, reasons[i]);
		if (!strcmp(name, rest))
			return true;
	}
	return false;
}

static bool is_named(const char *path, const struct stat *file)
{
	struct stat found;

	return !lstat(path, &found) && found.st_ino == file->st_ino && found.st_dev == file->st_dev;
}

/* Remove a file of ours that nobody writes any more; true if it was one. */
static bool remove_left(const char *path)
{
	const int fd = open(path, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	struct stat file;
	bool removed;

	if (fd < 0)
		return false;
	removed = !fstat(fd, &file) && S_ISREG(file.st_mode) && file.st_uid == geteuid() &&
		  !flock(fd, LOCK_EX | LOCK_NB) && is_named(path, &file) && !unlink(path);
	close(fd);
	return removed;
}

void keeper_tidy(const char *folder)
{
	struct dirent **entry;
	int count = scandir(folder, &entry, is_begun, NULL);
	char path[KEEPER_PATH + 256];

	for (int i = 0; i < count; i++) {
		snprintf(path, sizeof(path), "%s/%s", folder, entry[i]->d_name);
		remove_left(path);
		free(entry[i]);
	}
	if (count >= 0)
		free(entry);
}

static int name_file(const char *folder, enum record_reason reason, time_t when,
		     char path[KEEPER_PATH])
{
	struct tm parts;
	char text[32];
	int length;

	gmtime_r(&when, &parts);
	strftime(text, sizeof(text), "%Y%m%dT%H%M%SZ", &parts);
	length = snprintf(path, KEEPER_PATH, "%s/" PREFIX "%s-%s" SUFFIX, folder, text,
			  reasons[reason]);
	return length < KEEPER_PATH - (int)strlen(BESIDE) ? 0 : -ENAMETOOLONG;
}

void keeper_beside(const char *path, char beside[KEEPER_PATH])
{
	snprintf(beside, KEEPER_PATH, "%.*s" BESIDE, KEEPER_PATH - (int)sizeof(BESIDE), path);
}

/*
 * A new file, locked where the file system can. -EEXIST also if somebody has taken it
 * for one that was left, in the moment before it was locked.
 */
static int create(const char *beside)
{
	const int fd = open(beside, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
	struct stat file;

	if (fd < 0)
		return -errno;
	if (!(flock(fd, LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK) && !fstat(fd, &file) &&
	    file.st_nlink)
		return fd;
	close(fd);
	return -EEXIST;
}

/* While `beside` is ours, nobody else makes a record of the name that goes with it. */
static int create_for(const char *path)
{
	char beside[KEEPER_PATH];
	int fd;

	keeper_beside(path, beside);
	fd = create(beside);
	if (fd == -EEXIST && remove_left(beside))
		fd = create(beside);
	if (fd < 0 || access(path, F_OK))
		return fd;
	unlink(beside);
	close(fd);
	return -EEXIST;
}

/* Its name into `path`; a descriptor of the file beside it, or -errno. */
static int begin(const char *folder, enum record_reason reason, char path[KEEPER_PATH])
{
	const time_t now = time(NULL);
	int fd = -EEXIST;

	for (int i = 0; fd == -EEXIST && i < NAMES; i++) {
		fd = name_file(folder, reason, now + i, path);
		if (!fd)
			fd = create_for(path);
	}
	return fd;
}

/*
 * Members of the monitor group may read the record, and nobody but the daemon may change it.
 * If that cannot be, the record is written all the same.
 */
static void share(int fd, gid_t readers)
{
	if (readers != (gid_t)-1 && !fchown(fd, (uid_t)-1, readers))
		fchmod(fd, 0640);
}

static int put_record(const struct recorder_file *ring, int fd, enum record_reason reason,
		      uint64_t *packets)
{
	static struct stations stations;
	const struct export_options options = {
		.device = EXPORT_ALL,
		.application = "pokeysd " POKEYSD_VERSION,
		.comment = reasons[reason],
		.wall_ns = export_wall(),
		.stations = &stations,
	};
	struct export_summary summary;
	FILE *to = fdopen(fd, "w");
	int result;

	if (!to) {
		close(fd);
		return -ENOMEM;
	}
	stations_read(&stations, "/proc/self/net/arp");
	result = export_record(ring, &options, to, &summary);
	if (fclose(to) && !result)
		result = -errno;
	*packets = summary.packets;
	return result;
}

/* It stays locked until it has its name. */
static int finish(const struct recorder_file *ring, int fd, const struct keeper_order *order,
		  const char *path, uint64_t *packets)
{
	const int lock = fcntl(fd, F_DUPFD_CLOEXEC, 0);
	char beside[KEEPER_PATH];
	int result;

	share(fd, order->readers);
	result = put_record(ring, fd, order->reason, packets);
	keeper_beside(path, beside);
	if (!result && rename(beside, path))
		result = -errno;
	if (result)
		unlink(beside);
	if (lock >= 0)
		close(lock);
	return result;
}

int keeper_write(const struct keeper_order *order, char path[KEEPER_PATH], _Atomic bool *begun,
		 uint64_t *packets)
{
	struct recorder_file file;
	char why[KEEPER_PATH];
	int result = recorder_open(&file, order->ring, why, sizeof(why));
	int fd;

	if (result)
		return result;
	fd = begin(order->folder, order->reason, path);
	if (fd < 0) {
		recorder_release(&file);
		return fd;
	}
	atomic_store_explicit(begun, true, memory_order_release);
	result = finish(&file, fd, order, path, packets);
	atomic_store_explicit(begun, false, memory_order_release);
	recorder_release(&file);
	if (!result)
		remove_oldest(order->folder, order->files);
	return result;
}
