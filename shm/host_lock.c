/* SPDX-License-Identifier: MIT */
/*
 * One daemon per runtime folder: the lock is an flock on a file, given up by the
 * kernel however the daemon ends. The file is removed at a clean end, so
 * taking the lock makes sure that the file which was locked is still the one
 * that has the name; otherwise two daemons could hold two files.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/host_private.h"
#include "shm/say.h"

static int lock_busy(struct shm_host *host, int fd, char *why, size_t size)
{
	char text[24] = "";
	ssize_t length = pread(fd, text, sizeof(text) - 1, 0);
	long pid = length > 0 ? strtol(text, NULL, 10) : 0;

	return say(why, size, -EBUSY,
		   "another pokeysd (pid %ld) holds %s; stop it, or choose another runtime folder",
		   pid, host->directory);
}

/* As we write it; other programs have files of this name as well, empty ones for instance. */
static bool names_a_process(int fd)
{
	char text[24] = "", *end = text;
	ssize_t length = pread(fd, text, sizeof(text) - 1, 0);

	return length > 1 && strtol(text, &end, 10) > 0 && end == text + length - 1 && *end == '\n';
}

/* 1 = locked, 0 = it was another file by then: once more. -ENOENT: none of a daemon's. */
static int try_lock(struct shm_host *host, int create, char *why, size_t size)
{
	struct stat ours, named;
	int fd = openat(host->directory_fd, "lock",
			O_RDWR | create | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0600);
	int r;

	if (fd < 0)
		return say(why, size, -errno, "%s/lock: %s%s", host->directory, strerror(errno),
			   errno == EACCES ? "; it belongs to another user's daemon" : "");
	if (fstat(fd, &ours) || !S_ISREG(ours.st_mode)) {
		close(fd);
		return say(why, size, -EPROTO, "%s/lock: not a file; remove it", host->directory);
	}
	if (flock(fd, LOCK_EX | LOCK_NB)) {
		r = errno == EWOULDBLOCK ?
			    lock_busy(host, fd, why, size) :
			    say(why, size, -errno, "%s/lock: %s", host->directory, strerror(errno));
		close(fd);
		return r;
	}
	if (fstatat(host->directory_fd, "lock", &named, AT_SYMLINK_NOFOLLOW) ||
	    named.st_ino != ours.st_ino) {
		close(fd);
		return 0;
	}
	if (!(create & O_CREAT) && !names_a_process(fd)) {
		close(fd);
		return -ENOENT;
	}
	host->lock_fd = fd;
	return 1;
}

int shm_lock_take(struct shm_host *host, int create, char *why, size_t size)
{
	char text[24];
	int length;
	int r;

	do {
		r = try_lock(host, create, why, size);
	} while (!r);
	if (r < 0)
		return r;
	length = snprintf(text, sizeof(text), "%ld\n", (long)getpid());
	if (ftruncate(host->lock_fd, 0) || pwrite(host->lock_fd, text, (size_t)length, 0) != length)
		return say(why, size, -EIO, "%s/lock: cannot be written: %s", host->directory,
			   strerror(errno));
	return 0;
}
