/* SPDX-License-Identifier: MIT */
/*
 * The files that everybody maps.
 *
 * A mapping is only as good as the file below it: touching a page beyond the
 * end of a file, or one that a full tmpfs cannot provide, is a SIGBUS in
 * whoever touches it, which may be a servo thread. And opening a file that is
 * not complete makes iceoryx2 wait for its creator. So the daemon allocates
 * every page when it has made the files and writes their sizes into the
 * manifest, and a client compares before it maps. This finds what an accident
 * leaves (a truncated file, a full disk, a stray hand). It is no defence
 * against somebody of the group who wants to do harm: he may write there.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/runtime.h"
#include "shm/say.h"
#include "shm/segments.h"

enum { SEGMENT_PATH_MAX = SHM_PATH_MAX + 256 + 16 };

/* Sockets and folders are not mapped; the manifest is ours. */
static int is_segment(int folder_fd, const char *name, struct stat *status)
{
	return name[0] == 'p' && !fstatat(folder_fd, name, status, AT_SYMLINK_NOFOLLOW) &&
	       S_ISREG(status->st_mode);
}

static int allocate(int folder_fd, const char *name, off_t bytes)
{
	int fd = openat(folder_fd, name, O_RDWR | O_NOFOLLOW | O_CLOEXEC);
	int r = 0;

	if (fd < 0)
		return errno == EACCES ? 0 : -errno; /* read-only: written, not sparse */
	if (fallocate(fd, 0, 0, bytes) && errno != EOPNOTSUPP)
		r = -errno;
	close(fd);
	return r;
}

static int print_folder(const char *root, const char *prefix, FILE *file)
{
	char path[SEGMENT_PATH_MAX];
	struct dirent *entry;
	struct stat status;
	DIR *folder;
	int r = 0;

	snprintf(path, sizeof(path), "%s/%s", root, prefix);
	folder = opendir(path);
	if (!folder)
		return -errno;
	while (!r && (entry = readdir(folder))) {
		if (!is_segment(dirfd(folder), entry->d_name, &status))
			continue;
		r = allocate(dirfd(folder), entry->d_name, status.st_size);
		fprintf(file, "segment %s%s %" PRIu64 "\n", prefix, entry->d_name,
			(uint64_t)status.st_size);
	}
	closedir(folder);
	return r;
}

int segments_print(const char *root, FILE *file)
{
	int r = print_folder(root, "", file);

	return r ? r : print_folder(root, "services/", file);
}

int segment_check(const char *root, const char *name, uint64_t bytes, char *why, size_t size)
{
	char path[SEGMENT_PATH_MAX];
	struct stat status;

	if (strstr(name, ".."))
		return -EPROTO;
	snprintf(path, sizeof(path), "%s/%s", root, name);
	if (lstat(path, &status))
		return errno == ENOENT ? -ENOENT : -errno;
	if (!S_ISREG(status.st_mode))
		return say(why, size, -EBADMSG, "%s is not a file any more; restart pokeysd", path);
	if ((uint64_t)status.st_size != bytes)
		return say(why, size, -EBADMSG,
			   "%s has %" PRIu64 " bytes, pokeysd made it %" PRIu64 " long; "
			   "restart pokeysd",
			   path, (uint64_t)status.st_size, bytes);
	return 0;
}
