/* SPDX-License-Identifier: MIT */
/*
 * The dead in nodes/, where the whole group may write.
 *
 * A node is three files and a folder there, named by its number. While its process lives, it
 * has a record lock on the first of them; the kernel knows whether it lives, and nobody has to
 * be believed. iceoryx2 would read what the dead node has said of itself, such as where its
 * files are, wait for a FIFO in the place of a file, and follow links. So the names are looked
 * at here, and only numbers go on to iceoryx2.
 *
 * A lock of our own process is not shown to us, and closing the file would give it up: nodes
 * of this process are passed over.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/reap.h"
#include "shm/runtime.h"

enum {
	ID_MAX = 40, /* 128 bits in decimal, and a NUL */
	NAME_MAX_HERE = 80,
	DEAD_MAX = 64,   /* at once; the others wait */
	COMPLETE = 0444, /* the mode of a node's last file, when it is made */
};

#define PREFIX	"p"
#define LIVES	".node_monitor"

static const char *const parts[] = { LIVES, LIVES "_owner_lock", LIVES "_context" };

static void name_of(char name[static NAME_MAX_HERE], const char *id, const char *part)
{
	snprintf(name, NAME_MAX_HERE, PREFIX "%s%s", id, part);
}

/* "p<number>.node_monitor"; false if it is anything else. */
static bool take_id(const char *name, char id[static ID_MAX])
{
	const size_t digits = *name == *PREFIX ? strspn(name + 1, "0123456789") : 0;

	/* another spelling would have a lock of its own */
	if (!digits || digits >= ID_MAX || name[1] == '0' || strcmp(name + 1 + digits, LIVES))
		return false;
	memcpy(id, name + 1, digits);
	id[digits] = '\0';
	return true;
}

/* False only if it is certain that nobody holds it: a look that fails, fails for the living too. */
static bool may_be_locked(int nodes_fd, const char *name)
{
	struct flock lock = { .l_type = F_WRLCK, .l_whence = SEEK_SET };
	const int fd = openat(nodes_fd, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	struct stat status;
	bool locked;

	if (fd < 0)
		return errno != ENOENT && errno != ELOOP && errno != ENXIO;
	locked = fstat(fd, &status) ||
		 (S_ISREG(status.st_mode) && (fcntl(fd, F_GETLK, &lock) || lock.l_type != F_UNLCK));
	close(fd);
	return locked;
}

static bool is_dead(int nodes_fd, const char *id)
{
	char name[NAME_MAX_HERE];
	struct stat status;

	/* the last one of its files: before, it may just be beginning */
	name_of(name, id, parts[2]);
	if (fstatat(nodes_fd, name, &status, AT_SYMLINK_NOFOLLOW) || !S_ISREG(status.st_mode) ||
	    (status.st_mode & 0777) != COMPLETE)
		return false;
	for (size_t i = 0; i < 2; i++) {
		name_of(name, id, parts[i]);
		if (may_be_locked(nodes_fd, name))
			return false;
	}
	return true;
}

/* Its number is in the names of its files alone: they stay until nothing of it is left. */
static bool bury(const struct iox_node *node, int nodes_fd, const char *id)
{
	char name[NAME_MAX_HERE];

	/* before iceoryx2 looks for its tags there, and would follow a link */
	runtime_remove_tree(nodes_fd, id);
	if (iox_node_forget(node, id, NULL))
		return false;
	for (size_t i = 0; i < sizeof(parts) / sizeof(*parts); i++) {
		name_of(name, id, parts[i]);
		runtime_remove_tree(nodes_fd, name);
	}
	return true;
}

static int reap_in(const struct iox_node *node, DIR *nodes)
{
	struct dirent *entry;
	char id[ID_MAX];
	int dead = 0;

	while (dead < DEAD_MAX && (entry = readdir(nodes))) {
		if (!take_id(entry->d_name, id) || iox_node_is_ours(id) ||
		    !is_dead(dirfd(nodes), id))
			continue;
		dead += bury(node, dirfd(nodes), id);
	}
	return dead;
}

int reap(const struct iox_node *node, const char *root)
{
	char path[SHM_PATH_MAX + 16];
	DIR *nodes;
	int dead, fd;

	snprintf(path, sizeof(path), "%s/nodes", root);
	fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
	if (fd < 0)
		return -errno;
	nodes = fdopendir(fd);
	if (!nodes) {
		close(fd);
		return -ENOMEM;
	}
	dead = reap_in(node, nodes);
	closedir(nodes);
	return dead;
}
