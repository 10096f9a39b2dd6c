/* SPDX-License-Identifier: MIT */
/*
 * The runtime folder as files.
 *
 * Each start of the daemon works in a root of its own, e.<epoch>, and the
 * link `current` is renamed into place when the root is complete. With fixed
 * names a writer that was killed while any reader stayed attached leaves its
 * entry unwritable for good, and a forced removal lets the old reader delete
 * the new daemon's files. With fresh roots nothing old can be in the way: the
 * dead are removed by whoever holds the lock next, and a reader that is still
 * attached to a removed root keeps its mapping and does no harm.
 *
 * Names that come out of the folder are judged before they are used: a link
 * may point at e.<hexadecimal> beside it and nowhere else. Removing never
 * follows a symbolic link and works relative to open folders, so that nobody
 * can turn it elsewhere while it runs.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <grp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include "shm/runtime.h"
#include "shm/say.h"

#define DEVICE_CHARACTERS \
	"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-"

enum {
	TREE_DEPTH_MAX = 8,
	REMOVE_TRIES = 16,
	SOCKET_TAIL = sizeof("/control"),
};
_Static_assert(SHM_DIRECTORY_MAX - 1 + SOCKET_TAIL <= sizeof(((struct sockaddr_un *)0)->sun_path),
	       "sockets would not fit");

bool runtime_device_name_ok(const char *name)
{
	size_t length;

	if (!name)
		return false;
	length = strlen(name);
	return length >= 1 && length < POKEYS_SHM_NAME_MAX &&
	       strspn(name, DEVICE_CHARACTERS) == length;
}

bool runtime_root_name_ok(const char *name)
{
	size_t length = strlen(name);

	return length >= 3 && length < SHM_ROOT_NAME_MAX && name[0] == 'e' && name[1] == '.' &&
	       strspn(name + 2, "0123456789abcdef") == length - 2;
}

int runtime_check_directory(const char *directory, char *why, size_t size)
{
	size_t length = strlen(directory);

	if (directory[0] != '/')
		return say(why, size, -EINVAL, "runtime folder '%.80s': give an absolute path",
			   directory);
	if (length >= SHM_DIRECTORY_MAX)
		return say(why, size, -ENAMETOOLONG,
			   "runtime folder '%.40s...': its path has %zu characters, at most %d fit "
			   "(sockets live below it); choose a shorter one",
			   directory, length, SHM_DIRECTORY_MAX - 1);
	return 0;
}

int runtime_denied(const char *path, char *why, size_t size)
{
	char names[1024];
	struct group group, *known = NULL;
	struct stat st;

	if (stat(path, &st))
		return say(why, size, -EACCES, "%s: permission denied", path);
	if (!st.st_gid || !(st.st_mode & (S_ISDIR(st.st_mode) ? S_IXGRP : S_IRGRP)))
		return say(why, size, -EACCES,
			   "%s: permission denied; only its owner may %s, "
			   "until pokeysd.conf names a group (group = ...)",
			   path, S_ISDIR(st.st_mode) ? "enter" : "read it");
	if (getgrgid_r(st.st_gid, &group, names, sizeof(names), &known) || !known)
		return say(why, size, -EACCES,
			   "%s: permission denied; this user must be in "
			   "group %u",
			   path, (unsigned int)st.st_gid);
	return say(why, size, -EACCES,
		   "%s: permission denied; this user must be in group %s "
		   "(sudo adduser USER %s, then log in again)",
		   path, group.gr_name, group.gr_name);
}

int runtime_current(const char *directory, char name[SHM_ROOT_NAME_MAX])
{
	char path[SHM_PATH_MAX];
	char target[SHM_PATH_MAX];
	ssize_t length;

	snprintf(path, sizeof(path), "%s/current", directory);
	length = readlink(path, target, sizeof(target) - 1);
	if (length < 0)
		return errno == EINVAL ? -EPROTO : -errno;
	target[length] = '\0';
	if (!runtime_root_name_ok(target))
		return -EPROTO;
	snprintf(name, SHM_ROOT_NAME_MAX, "%.*s", SHM_ROOT_NAME_MAX - 1, target);
	return 0;
}

bool runtime_is_closed(const char *root)
{
	struct stat status;

	return !lstat(root, &status) && !(status.st_mode & (S_IRWXG | S_IRWXO));
}

/* Made by one of these two users, and nobody else may put or replace anything there. */
static bool is_closed(const char *path, mode_t closing, uid_t owner, uid_t other)
{
	struct stat status;

	return !lstat(path, &status) && S_ISDIR(status.st_mode) &&
	       (status.st_uid == owner || status.st_uid == other) &&
	       (!(status.st_mode & (S_IWGRP | S_IWOTH)) || status.st_mode & closing);
}

int runtime_check_root(const char *directory, const char *root, char *why, size_t size)
{
	char services[SHM_PATH_MAX + 16], nodes[SHM_PATH_MAX + 16];
	struct stat status, parent;

	if (stat(directory, &parent) || lstat(root, &status))
		return -errno;
	snprintf(services, sizeof(services), "%s/services", root);
	snprintf(nodes, sizeof(nodes), "%s/nodes", root);
	if (!(parent.st_mode & (S_IWGRP | S_IWOTH)) && is_closed(root, 0, parent.st_uid, 0) &&
	    is_closed(services, 0, status.st_uid, status.st_uid) &&
	    is_closed(nodes, S_ISVTX, status.st_uid, status.st_uid))
		return 0;
	if (access(services, F_OK) && errno == ENOENT)
		return -ENOENT;
	return say(why, size, -EPERM,
		   "%s: others than pokeysd may put files there; restart "
		   "pokeysd",
		   root);
}

int runtime_set_current(const char *directory, const char *name)
{
	char temporary[SHM_PATH_MAX];
	char path[SHM_PATH_MAX];

	snprintf(temporary, sizeof(temporary), "%s/.current", directory);
	snprintf(path, sizeof(path), "%s/current", directory);
	if (unlink(temporary) && errno != ENOENT)
		return -errno;
	if (symlink(name, temporary))
		return -errno;
	if (rename(temporary, path)) {
		int r = -errno;

		unlink(temporary);
		return r;
	}
	return 0;
}

static int remove_entries(DIR *folder, int depth);

static int remove_entry(int folder_fd, const char *name, int depth)
{
	DIR *inner;
	int fd;
	int r;

	if (!unlinkat(folder_fd, name, 0))
		return 0;
	if (errno != EISDIR && errno != EPERM)
		return errno == ENOENT ? 0 : -errno;
	if (depth == TREE_DEPTH_MAX)
		return -ELOOP;
	fd = openat(folder_fd, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
	if (fd < 0)
		return errno == ENOENT ? 0 : -errno;
	inner = fdopendir(fd);
	if (!inner) {
		close(fd);
		return -ENOMEM;
	}
	r = remove_entries(inner, depth + 1);
	closedir(inner);
	if (!r && unlinkat(folder_fd, name, AT_REMOVEDIR) && errno != ENOENT)
		r = -errno;
	return r;
}

static int remove_entries(DIR *folder, int depth)
{
	struct dirent *entry;
	int worst = 0;
	int r;

	while ((entry = readdir(folder))) {
		if (!strcmp(entry->d_name, ".") || !strcmp(entry->d_name, ".."))
			continue;
		r = remove_entry(dirfd(folder), entry->d_name, depth);
		if (r)
			worst = r;
	}
	return worst;
}

/* A client that attaches at this moment puts files into a folder already emptied: once more. */
int runtime_remove_tree(int directory_fd, const char *name)
{
	int r = -ENOTEMPTY;

	for (int tries = 0; r == -ENOTEMPTY && tries < REMOVE_TRIES; tries++)
		r = remove_entry(directory_fd, name, 0);
	return r;
}

int runtime_remove_stale(int directory_fd, const char *keep)
{
	struct dirent *entry;
	DIR *folder;
	int worst = 0;
	int fd;
	int r;

	/* a description of its own: the position in the folder is not shared */
	fd = openat(directory_fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (fd < 0)
		return -errno;
	folder = fdopendir(fd);
	if (!folder) {
		close(fd);
		return -ENOMEM;
	}
	while ((entry = readdir(folder))) {
		if (!runtime_root_name_ok(entry->d_name) || (keep && !strcmp(entry->d_name, keep)))
			continue;
		r = runtime_remove_tree(directory_fd, entry->d_name);
		if (r)
			worst = r;
	}
	closedir(folder);
	return worst;
}
