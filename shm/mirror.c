/* SPDX-License-Identifier: MIT */
/*
 * The mirror from the daemon's side: its folder, its files, and writing them.
 *
 * The folder lies in the runtime folder, whose mode lets everybody pass (2751) and nobody but
 * its group look or write. So what keeps a monitor out of all else is the mode of each thing
 * there, not its secret name: roots are 2750, lock, control socket and recorder's rings at
 * most 0660.
 *
 * A member of the runtime folder's group may move the folder away, or put another in its place
 * and later make shorter what somebody has mapped: he may switch the machine off as well.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/manifest.h"
#include "shm/mirror.h"
#include "shm/mirror_copy.h"
#include "shm/say.h"

enum { TEMPORARY_NAME_MAX = POKEYS_SHM_NAME_MAX + 1 };

static const enum pokeys_shm_image images[MIRROR_IMAGES] = {
	[MIRROR_STATE] = POKEYS_SHM_STATE,
	[MIRROR_DIAG] = POKEYS_SHM_DIAG,
	[MIRROR_REPORT] = POKEYS_SHM_REPORT,
};

/* A group that was named must be given; one that only happens to be there need not. */
static int give_folder(int fd, const char *runtime, bool must, gid_t *gid, char *why, size_t size)
{
	int r;

	if (*gid == (gid_t)-1 || !fchown(fd, (uid_t)-1, *gid))
		return 0;
	r = say(why, size, -errno,
		"%s/" MIRROR_FOLDER ": cannot be given to group %u: %s; make "
		"the daemon's user a member of it",
		runtime, (unsigned int)*gid, strerror(errno));
	*gid = (gid_t)-1;
	return must ? r : 0;
}

static int enter_folder(int runtime_fd, const char *runtime, bool must, gid_t *gid, char *why,
			size_t size)
{
	int fd = openat(runtime_fd, MIRROR_FOLDER, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
	struct stat status;
	int r;

	if (fd < 0)
		return say(why, size, -errno, "%s/" MIRROR_FOLDER ": %s", runtime, strerror(errno));
	if (fstat(fd, &status) || status.st_uid != geteuid())
		r = say(why, size, -EPERM,
			"%s/" MIRROR_FOLDER ": belongs to another user; remove "
			"it",
			runtime);
	else
		r = give_folder(fd, runtime, must, gid, why, size);
	/* not the set-group-id bit, which a hardened unit may not ask for: files are given */
	if (!r && (status.st_mode & 0777) != 0750 && fchmod(fd, 0750))
		r = say(why, size, -errno, "%s/" MIRROR_FOLDER ": mode cannot be set to 0750: %s",
			runtime, strerror(errno));
	if (!r)
		return fd;
	close(fd);
	return r;
}

int mirror_folder(int runtime_fd, const char *runtime, bool must, gid_t *gid, char *why,
		  size_t size)
{
	int fd;

	if (mkdirat(runtime_fd, MIRROR_FOLDER, 0750) && errno != EEXIST)
		return say(why, size, -errno, "%s/" MIRROR_FOLDER ": cannot be made: %s", runtime,
			   strerror(errno));
	fd = enter_folder(runtime_fd, runtime, must, gid, why, size);
	if (fd < 0)
		unlinkat(runtime_fd, MIRROR_FOLDER, AT_REMOVEDIR);
	return fd;
}

static size_t aligned(size_t size)
{
	return (size + MIRROR_ALIGN - 1) / MIRROR_ALIGN * MIRROR_ALIGN;
}

/* Where everything is, and the size of the file. */
static void lay_out(struct mirror_head *head, const struct manifest *ours)
{
	size_t at = aligned(sizeof(struct mirror_head));

	for (int i = 0; i < MIRROR_IMAGES; i++) {
		const struct manifest_layout *layout = &ours->layout[images[i]];

		head->part[i] = (struct mirror_part){
			.hash = layout->hash,
			.version = layout->version,
			.size = (uint32_t)layout->size,
			.counter = (uint32_t)at,
			.cell = { (uint32_t)(at + MIRROR_ALIGN),
				  (uint32_t)(at + MIRROR_ALIGN + aligned(layout->size)) },
		};
		at += MIRROR_ALIGN + 2 * aligned(layout->size);
	}
	head->events = (struct mirror_ring){
		.counter = (uint32_t)at,
		.slot = (uint32_t)(at + MIRROR_ALIGN),
		.slots = POKEYS_EVENTS_KEPT,
		.slot_size = sizeof(struct pokeys_event),
	};
	head->file_size = head->events.slot + POKEYS_EVENTS_KEPT * sizeof(struct pokeys_event);
}

static const char *temporary(char name[TEMPORARY_NAME_MAX], const char *device)
{
	snprintf(name, TEMPORARY_NAME_MAX, ".%s", device);
	return name;
}

static int make_file(int folder_fd, gid_t gid, const char *name, size_t size, ino_t *inode)
{
	struct stat status;
	int fd, r;

	if (unlinkat(folder_fd, name, 0) && errno != ENOENT)
		return -errno;
	fd = openat(folder_fd, name, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0640);
	if (fd < 0)
		return -errno;
	r = fchmod(fd, 0640) || (gid != (gid_t)-1 && fchown(fd, (uid_t)-1, gid)) ? -errno : 0;
	if (!r)
		r = -posix_fallocate(fd, 0, (off_t)size);
	if (!r && fstat(fd, &status))
		r = -errno;
	if (!r) {
		*inode = status.st_ino;
		return fd;
	}
	close(fd);
	unlinkat(folder_fd, name, 0);
	return r;
}

static void fill(struct mirror *mirror, const struct mirror_head *head)
{
	unsigned char *base = (unsigned char *)mirror->head;

	memcpy(base, head, sizeof(*head));
	for (int i = 0; i < MIRROR_IMAGES; i++) {
		const struct mirror_part *part = &head->part[i];

		mirror->image[i] = (struct mirror_cells){
			.counter = (void *)(base + part->counter),
			.cell = { base + part->cell[0], base + part->cell[1] },
			.size = part->size,
		};
	}
}

int mirror_make(struct mirror *mirror, int folder_fd, gid_t gid, const char *device,
		unsigned int number, uint64_t epoch)
{
	struct mirror_head head = {
		.magic = MIRROR_MAGIC,
		.version = MIRROR_VERSION,
		.head_size = sizeof(head),
		.epoch = epoch,
		.number = number,
	};
	char name[TEMPORARY_NAME_MAX];
	struct manifest ours;
	void *base;
	int fd;

	manifest_init(&ours);
	memcpy(head.boot, ours.boot, sizeof(head.boot));
	snprintf(head.device, sizeof(head.device), "%s", device);
	lay_out(&head, &ours);
	fd = make_file(folder_fd, gid, temporary(name, device), head.file_size, &mirror->inode);
	if (fd < 0)
		return fd;
	base = mmap(NULL, head.file_size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
	close(fd);
	if (base == MAP_FAILED) {
		unlinkat(folder_fd, name, 0);
		return -ENOMEM;
	}
	mirror->head = base;
	mirror->folder_fd = folder_fd;
	fill(mirror, &head);
	return 0;
}

int mirror_publish(const struct mirror *mirror, size_t devices)
{
	char name[TEMPORARY_NAME_MAX];

	mirror->head->devices = (uint32_t)devices;
	return renameat(mirror->folder_fd, temporary(name, mirror->head->device), mirror->folder_fd,
			mirror->head->device) ?
		       -errno :
		       0;
}

void mirror_remove(struct mirror *mirror)
{
	char name[TEMPORARY_NAME_MAX];

	if (!mirror->head)
		return;
	if (unlinkat(mirror->folder_fd, temporary(name, mirror->head->device), 0))
		unlinkat(mirror->folder_fd, mirror->head->device, 0);
	munmap(mirror->head, mirror->head->file_size);
	mirror->head = NULL;
}

int mirror_clear(int runtime_fd)
{
	const int r = runtime_remove_tree(runtime_fd, MIRROR_FOLDER);

	return r == -ENOENT ? 0 : r;
}

void mirror_write(struct mirror *mirror, enum mirror_image image, const void *from)
{
	const struct mirror_cells *cells = &mirror->image[image];
	uint64_t count;

	if (!mirror->head)
		return;
	count = atomic_load_explicit(cells->counter, memory_order_relaxed) + 1;
	/* the counter of the last write before the first byte of this one */
	atomic_thread_fence(memory_order_release);
	mirror_copy_in(cells->cell[count & 1], from, cells->size);
	atomic_store_explicit(cells->counter, count, memory_order_release);
}

void mirror_write_event(struct mirror *mirror, const struct pokeys_event *event)
{
	unsigned char *base = (unsigned char *)mirror->head;
	const struct mirror_ring *ring;
	_Atomic uint64_t *counter, *number;
	uint64_t count;

	if (!base)
		return;
	ring = &mirror->head->events;
	counter = (void *)(base + ring->counter);
	count = atomic_load_explicit(counter, memory_order_relaxed) + 1;
	number = (void *)(base + ring->slot + (count - 1) % ring->slots * ring->slot_size);
	/* no reader may take the old number for that of the new text */
	atomic_store_explicit(number, 0, memory_order_relaxed);
	atomic_thread_fence(memory_order_release);
	mirror_copy_in(number + 1, &event->t_ns, sizeof(*event) - sizeof(event->number));
	atomic_store_explicit(number, count, memory_order_release);
	atomic_store_explicit(counter, count, memory_order_release);
}

bool mirror_is_there(const struct mirror *mirror)
{
	struct stat status;

	return !mirror->head ||
	       (!fstatat(mirror->folder_fd, mirror->head->device, &status, AT_SYMLINK_NOFOLLOW) &&
		status.st_ino == mirror->inode);
}

void mirror_notify(struct mirror *mirror)
{
	if (mirror->head)
		/* who sees it sees what it is about */
		atomic_fetch_add_explicit(&mirror->head->notices, 1, memory_order_release);
}

void mirror_show_commanders(struct mirror *mirror, int commanders)
{
	if (mirror->head)
		atomic_store_explicit(&mirror->head->commanders, commanders > 0,
				      memory_order_relaxed);
}
