/* SPDX-License-Identifier: MIT */
/*
 * The runtime folder from the daemon's side: take it, lock it, clear it, make
 * a root in it; or clear it only, after one that was killed.
 *
 * Access is by group: the folder is 2751 (set-group-id, so that everything
 * below belongs to the group; others may pass, to the mirror), and each root in it is
 * 2750 as soon as all is made: what lies there was made by the daemon, and the group may
 * write into some of its files (rust/src/segment.rs). Only in nodes/ may it make any. A
 * folder that everybody may write to is refused; of one that somebody else made, nothing is
 * changed but that the group may not write there, unless a group is wanted.
 * A hardened unit forbids to ask for the set-group-id bit, even for what has
 * it (RestrictSUIDSGID=); so it is asked for only where it is missing.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <grp.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <linux/magic.h>
#include <time.h>
#include <unistd.h>
#include "shm/host_private.h"
#include "shm/say.h"

#define GROUP_NONE ((gid_t)-1)

/* A group that has no name; -1 is none, and what wraps round may be root's. */
static bool group_number(const char *text, gid_t *out)
{
	const size_t digits = strspn(text, "0123456789");
	const unsigned long long number = strtoull(text, NULL, 10);

	*out = (gid_t)number;
	return digits && digits <= 10 && !text[digits] && number < GROUP_NONE;
}

static int group_id(const char *group, gid_t *out, char *why, size_t size)
{
	struct group *entry;

	*out = GROUP_NONE;
	if (!group)
		return 0;
	entry = getgrnam(group);
	if (entry) {
		*out = entry->gr_gid;
		return 0;
	}
	if (group_number(group, out))
		return 0;
	return say(why, size, -ENOENT,
		   "group '%.40s' does not exist; create it (groupadd -r %.40s) or set another",
		   group, group);
}

/* Names that a daemon gives; "." and ".." are in every folder. */
static bool is_ours(const char *name)
{
	static const char *const names[] = { ".",           "..",      "lock",     "current",
					     ".current",    "control", "recorder", "recorder.died",
					     MIRROR_FOLDER, NULL };

	for (size_t i = 0; names[i]; i++) {
		if (!strcmp(name, names[i]))
			return true;
	}
	return runtime_root_name_ok(name);
}

/* Somebody may have named /etc: a folder with other things in it is not changed. */
static int check_own(const struct shm_host *host, gid_t gid, char *why, size_t size)
{
	DIR *folder = opendir(host->directory);
	struct dirent *entry;
	int r = 0;

	if (!folder)
		return say(why, size, -errno, "%s: %s", host->directory, strerror(errno));
	while (!r && (entry = readdir(folder))) {
		if (!is_ours(entry->d_name))
			r = say(why, size, -ENOTEMPTY,
				"%s: holds '%.40s', which is not pokeysd's; give the daemon a "
				"folder of its own, group %u, mode 2751",
				host->directory, entry->d_name, (unsigned int)gid);
	}
	closedir(folder);
	return r;
}

/*
 * systemd makes the folder for the service, says so, and gives it back to the service's
 * group at each start, with the metrics that pokeysd.conf has in it.
 */
static bool made_for_us(const struct shm_host *host)
{
	const char *made = getenv("RUNTIME_DIRECTORY");

	return made && !strcmp(made, host->directory);
}

static int give_to_group(struct shm_host *host, gid_t gid, char *why, size_t size)
{
	struct stat status;

	if (fchown(host->directory_fd, (uid_t)-1, gid))
		return say(why, size, -errno,
			   "%s: cannot be given to group %u: %s; do it as root (chgrp)",
			   host->directory, (unsigned int)gid, strerror(errno));
	if (fstat(host->directory_fd, &status) ||
	    ((status.st_mode & 07777) != 02751 && fchmod(host->directory_fd, 02751)))
		return say(why, size, -errno, "%s: mode cannot be set to 2751: %s", host->directory,
			   strerror(errno));
	return 0;
}

static int enter(struct shm_host *host, struct stat *status, char *why, size_t size)
{
	host->directory_fd = open(host->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (host->directory_fd < 0 || fstat(host->directory_fd, status))
		return say(why, size, -errno, "%s: %s", host->directory, strerror(errno));
	if (status->st_mode & S_IWOTH)
		return say(why, size, -EPERM,
			   "%s: everybody may write there; give the daemon a folder of its own, "
			   "mode 2751",
			   host->directory);
	return 0;
}

/* Who may write there may replace what commanders are to attach to. */
static int keep_group_out(const struct shm_host *host, const struct stat *status, char *why,
			  size_t size)
{
	if (!(status->st_mode & S_IWGRP) ||
	    !fchmod(host->directory_fd, status->st_mode & 07777 & ~(mode_t)S_IWGRP))
		return 0;
	return say(why, size, -errno, "%s: the group may write there; chmod g-w %s",
		   host->directory, host->directory);
}

static int open_directory(struct shm_host *host, gid_t gid, char *why, size_t size)
{
	bool made = !mkdir(host->directory, 0750);
	struct stat status;
	int r;

	if (!made && errno != EEXIST)
		return say(why, size, -errno, "%s: cannot be made: %s", host->directory,
			   strerror(errno));
	r = enter(host, &status, why, size);
	if (r)
		return r;
	if (made)
		return give_to_group(host, gid, why, size);
	if (gid == GROUP_NONE)
		return keep_group_out(host, &status, why, size);
	if (status.st_gid == gid && (status.st_mode & 07776) == 02750)
		return 0;
	r = made_for_us(host) ? 0 : check_own(host, gid, why, size);
	return r ? r : give_to_group(host, gid, why, size);
}

static int remove_name(const struct shm_host *host, const char *name, char *why, size_t size)
{
	if (!unlinkat(host->directory_fd, name, 0) || errno == ENOENT)
		return 0;
	if (errno == EISDIR)
		return say(why, size, -EISDIR,
			   "%s/%s: a folder, in the place of a file of "
			   "pokeysd's; remove it",
			   host->directory, name);
	return say(why, size, -errno, "%s/%s: cannot be removed: %s", host->directory, name,
		   strerror(errno));
}

/* The link first, so that nobody finds the way into what is being removed. */
static int remove_names(const struct shm_host *host, char *why, size_t size)
{
	static const char *const names[] = { "current", ".current", "control" };
	int r = 0;

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		const int failed = remove_name(host, names[i], r ? NULL : why, size);

		r = r ? r : failed;
	}
	return r;
}

/*
 * Whatever can be removed is. 0, or why no daemon can be here. What stays of the roots is no
 * reason to be without one, for ours has a name of its own: what another user has made and
 * does not let us remove is told, and what a client that was on its way already has kept
 * from becoming empty is removed next time (*left: -ENOTEMPTY).
 */
static int remove_stale(const struct shm_host *host, int *left, char *why, size_t size)
{
	int r = remove_names(host, why, size);
	const int mirror = mirror_clear(host->directory_fd);

	if (!r && mirror)
		r = say(why, size, mirror,
			"%s/" MIRROR_FOLDER ": cannot be removed: %s; remove it "
			"as root",
			host->directory, strerror(-mirror));
	*left = runtime_remove_stale(host->directory_fd, NULL);
	if (!r && *left && *left != -ENOTEMPTY)
		say(why, size, 0,
		    "%s: what is left there cannot be removed: %s; remove what is "
		    "not %s/current as root",
		    host->directory, strerror(-*left), host->directory);
	return r;
}

/*
 * Nobody else may enter until all is there: while iceoryx2 makes a file, everybody who can
 * reach it may write into it. Below a set-group-id folder it has the bit.
 */
static int make_folder(int parent_fd, const char *name, gid_t gid)
{
	int fd;
	int r = 0;

	if (mkdirat(parent_fd, name, 0700))
		return -errno;
	fd = openat(parent_fd, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
	if (fd < 0)
		return -errno;
	if (gid != GROUP_NONE && fchown(fd, (uid_t)-1, gid))
		r = -errno;
	close(fd);
	return r;
}

int shm_root_close(const struct shm_host *host)
{
	return chmod(host->root, 0700) ? -errno : 0;
}

/*
 * With the bit where it may be asked for, so that what is made later belongs to the group
 * as well; else segment.rs sees to that.
 */
int shm_root_open(const struct shm_host *host)
{
	return chmod(host->root, 02750) && chmod(host->root, 0750) ? -errno : 0;
}

/*
 * iceoryx2 lets everybody write there. Nobody but the daemon makes services; and nobody
 * replaces a node of somebody else.
 */
int shm_root_guard(const struct shm_host *host)
{
	char services[SHM_PATH_MAX + 16], nodes[SHM_PATH_MAX + 16];

	snprintf(services, sizeof(services), "%s/services", host->root);
	snprintf(nodes, sizeof(nodes), "%s/nodes", host->root);
	if (chmod(services, 0750) && errno != ENOENT)
		return -errno;
	return chmod(nodes, 01770) ? -errno : 0;
}

static int make_root(struct shm_host *host, gid_t gid, char *why, size_t size)
{
	struct timespec now;
	int r;

	do {
		clock_gettime(CLOCK_MONOTONIC, &now);
		host->manifest.epoch = (uint64_t)now.tv_sec * 1000000u +
				       (uint64_t)now.tv_nsec / 1000u;
		snprintf(host->root_name, sizeof(host->root_name), "e.%" PRIx64,
			 host->manifest.epoch);
		r = make_folder(host->directory_fd, host->root_name, gid);
	} while (r == -EEXIST);
	snprintf(host->root, sizeof(host->root), "%s/%s", host->directory, host->root_name);
	if (r)
		return say(why, size, r, "%s: cannot be made: %s", host->root, strerror(-r));
	return 0;
}

static void warn_of_disk(const struct shm_host *host, char *why, size_t size)
{
	struct statfs status;

	if (!*why && !fstatfs(host->directory_fd, &status) && status.f_type != TMPFS_MAGIC &&
	    status.f_type != RAMFS_MAGIC)
		say(why, size, 0, "%s is not on a tmpfs: publishing may wait for the disk",
		    host->directory);
}

/* Without a group that was named, the one that the packages make, where there is one. */
static int make_mirror(struct shm_host *host, const char *group, char *why, size_t size)
{
	const bool usual = !group && getgrnam(MIRROR_GROUP);
	struct stat status;
	const int r = group_id(usual ? MIRROR_GROUP : group, &host->mirror_gid, why, size);

	if (r)
		return r;
	host->mirror_fd = mirror_folder(host->directory_fd, host->directory, group != NULL,
					&host->mirror_gid, why, size);
	if (host->mirror_fd < 0)
		return host->mirror_fd;
	if (host->mirror_gid != GROUP_NONE && !fstat(host->directory_fd, &status) &&
	    !(status.st_mode & S_IXOTH))
		say(why, size, 0, "%s: those who may only read cannot pass it; chmod 2751 %s",
		    host->directory, host->directory);
	return 0;
}

int shm_folder_take(struct shm_host *host, const char *group, const char *monitor_group, char *why,
		    size_t size)
{
	gid_t gid;
	int r = group_id(group, &gid, why, size);
	int left;

	if (!r)
		r = open_directory(host, gid, why, size);
	if (!r)
		r = shm_lock_take(host, O_CREAT, why, size);
	if (!r)
		r = remove_stale(host, &left, why, size);
	if (!r)
		r = make_root(host, gid, why, size);
	if (!r)
		r = make_mirror(host, monitor_group, why, size);
	if (!r)
		warn_of_disk(host, why, size);
	return r;
}

/*
 * A daemon has its lock before all else and removes it last: without one there is
 * nothing of a daemon's, and whatever has such a name is somebody else's. So the lock
 * stays as long as anything else does, for who clears again.
 */
int shm_folder_clear(struct shm_host *host, char *why, size_t size)
{
	struct stat status;
	int r = enter(host, &status, why, size);
	int left;

	if (!r)
		r = shm_lock_take(host, 0, why, size);
	if (r == -ENOENT)
		return say(why, size, 0, "%s", "");
	if (r)
		return r;
	r = remove_stale(host, &left, why, size);
	host->unclear = r || left;
	return !r && left != -ENOTEMPTY ? left : r;
}

void shm_folder_give_back(struct shm_host *host)
{
	if (host->root[0])
		runtime_remove_tree(host->directory_fd, host->root_name);
	if (host->mirror_fd >= 0) {
		close(host->mirror_fd);
		host->unclear = host->unclear || mirror_clear(host->directory_fd);
	}
	if (host->lock_fd >= 0) {
		if (!host->unclear)
			unlinkat(host->directory_fd, "lock", 0);
		close(host->lock_fd);
	}
	if (host->directory_fd >= 0)
		close(host->directory_fd);
}
