/* SPDX-License-Identifier: MIT */
/*
 * iceoryx2 makes its files sparse and maps them, so a full tmpfs is a SIGBUS
 * in whoever makes one, be it the daemon or LinuxCNC. And when a file cannot be
 * opened it says "internal failure" and leaves half a node behind, which nobody
 * takes for dead and nobody removes: a client that tries again five times a
 * second fills the folder with them. So both are looked at before it begins.
 */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include "shm/room.h"
#include "shm/say.h"

/* -EMFILE or -ENFILE if fewer than `files` more descriptors are to be had. */
static int try_files(int fd, int files)
{
	int copy, r;

	if (!files)
		return 0;
	copy = fcntl(fd, F_DUPFD_CLOEXEC, 0);
	if (copy < 0)
		return -errno;
	r = try_files(copy, files - 1);
	close(copy);
	return r;
}

int room_check(const char *folder, uint64_t bytes, int files, char *why, size_t size)
{
	struct statvfs status;
	uint64_t there;
	int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	int r;

	if (fd < 0)
		return say(why, size, -errno, "%s: %s", folder, strerror(errno));
	r = try_files(fd, files);
	if (r)
		say(why, size, r,
		    "%s: %d more files must be open at once: %s; raise the limit "
		    "(ulimit -n, LimitNOFILE= in a unit)",
		    folder, files, strerror(-r));
	if (!r && !fstatvfs(fd, &status) && status.f_blocks) {
		there = (uint64_t)status.f_bavail * status.f_frsize;
		if (there < bytes)
			r = say(why, size, -ENOSPC,
				"%s: %" PRIu64 " kB free, %" PRIu64 " are needed", folder,
				there / 1024, bytes / 1024);
	}
	close(fd);
	return r;
}
