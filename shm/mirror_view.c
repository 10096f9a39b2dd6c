/* SPDX-License-Identifier: MIT */
/*
 * The mirror from a reader's side: judge a file, map it, copy from it.
 *
 * What is read may be anything: a file of another version, a truncated one, or one that
 * somebody put there. So its head is copied once and judged, every offset against the size of
 * the file, and only that copy is used to find the cells.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/manifest.h"
#include "shm/mirror.h"
#include "shm/mirror_copy.h"
#include "shm/say.h"

enum {
	TRIES = 1000, /* a writer that floods is overtaken within a few */
	SIZE_MOST = 1 << 20,
	SLOTS_MOST = 4096,
	PATH_MOST = SHM_PATH_MAX + POKEYS_SHM_NAME_MAX,
};

/* What every image begins with. */
struct header {
	uint32_t magic;
	uint16_t version, size_units;
	uint64_t hash;
};

static const struct header headers[MIRROR_IMAGES] = {
	[MIRROR_STATE] = { POKEYS_STATE_MAGIC, POKEYS_STATE_VERSION,
			   sizeof(struct pokeys_state) / 8, POKEYS_STATE_HASH },
	[MIRROR_DIAG] = { POKEYS_DIAG_MAGIC, POKEYS_DIAG_VERSION, sizeof(struct pokeys_diag) / 8,
			  POKEYS_DIAG_HASH },
	[MIRROR_REPORT] = { POKEYS_REPORT_MAGIC, POKEYS_REPORT_VERSION,
			    sizeof(struct pokeys_report) / 8, POKEYS_REPORT_HASH },
};

static const char *file_path(char path[PATH_MOST], const char *runtime, const char *device)
{
	snprintf(path, PATH_MOST, "%s/" MIRROR_FOLDER "/%s", runtime, device);
	return path;
}

/* As far as a range of the file may go: not into the head, not beyond its end, on a line. */
static bool fits(const struct mirror_head *head, uint32_t at, uint64_t bytes)
{
	return at % MIRROR_ALIGN == 0 && at >= sizeof(*head) && at <= head->file_size &&
	       bytes <= head->file_size - at;
}

static bool is_sound(const struct mirror_head *head, uint64_t file_size)
{
	const struct mirror_ring *ring = &head->events;

	if (head->file_size != file_size || !memchr(head->boot, 0, sizeof(head->boot)) ||
	    !memchr(head->device, 0, sizeof(head->device)))
		return false;
	for (int i = 0; i < MIRROR_IMAGES; i++) {
		const struct mirror_part *part = &head->part[i];

		if (!fits(head, part->counter, sizeof(uint64_t)) ||
		    !fits(head, part->cell[0], part->size) ||
		    !fits(head, part->cell[1], part->size))
			return false;
	}
	return fits(head, ring->counter, sizeof(uint64_t)) && ring->slots &&
	       ring->slots <= SLOTS_MOST && ring->slot_size == sizeof(struct pokeys_event) &&
	       fits(head, ring->slot, (uint64_t)ring->slots * ring->slot_size);
}

static struct manifest_layout layout_of(const struct mirror_part *part)
{
	return (struct manifest_layout){
		.version = part->version,
		.hash = part->hash,
		.size = part->size,
	};
}

/* In the words in which a commander is told of two versions. */
static int check_layouts(const struct mirror_head *head, char *why, size_t size)
{
	struct manifest theirs;

	manifest_init(&theirs);
	memcpy(theirs.boot, head->boot, sizeof(theirs.boot));
	theirs.layout[POKEYS_SHM_STATE] = layout_of(&head->part[MIRROR_STATE]);
	theirs.layout[POKEYS_SHM_DIAG] = layout_of(&head->part[MIRROR_DIAG]);
	theirs.layout[POKEYS_SHM_REPORT] = layout_of(&head->part[MIRROR_REPORT]);
	return manifest_check(&theirs, why, size);
}

static int read_head(int fd, struct stat *status, struct mirror_head *head)
{
	if (fstat(fd, status) || !S_ISREG(status->st_mode) ||
	    status->st_size < (off_t)sizeof(*head) || status->st_size > SIZE_MOST ||
	    pread(fd, head, sizeof(*head), 0) != (ssize_t)sizeof(*head) ||
	    head->magic != MIRROR_MAGIC)
		return -EPROTO;
	/* what another version of this file has behind its number is not known here */
	if (head->version != MIRROR_VERSION || head->head_size != sizeof(*head))
		return -EPROTONOSUPPORT;
	return is_sound(head, (uint64_t)status->st_size) ? 0 : -EPROTO;
}

static int say_foreign(const char *path, char *why, size_t size)
{
	return say(why, size, -EPROTO,
		   "%s: not a file that pokeysd made; remove it, then restart "
		   "pokeysd",
		   path);
}

static int judge(int fd, const char *path, struct stat *status, struct mirror_head *head, char *why,
		 size_t size)
{
	const int r = read_head(fd, status, head);

	if (r == -EPROTO)
		return say_foreign(path, why, size);
	if (r == -EPROTONOSUPPORT)
		return say(why, size, r,
			   "the daemon speaks mirror version %u, this program %d; "
			   "install daemon and program of one version",
			   head->version, MIRROR_VERSION);
	return check_layouts(head, why, size);
}

/* A daemon publishes the link last and removes it first. */
static bool has_no_mirror(const char *runtime)
{
	char name[SHM_ROOT_NAME_MAX], path[PATH_MOST];

	snprintf(path, sizeof(path), "%s/" MIRROR_FOLDER, runtime);
	return access(path, F_OK) && errno == ENOENT && !runtime_current(runtime, name);
}

int mirror_explain(const char *runtime, int error, char *why, size_t size)
{
	char path[PATH_MOST];

	snprintf(path, sizeof(path), "%s/" MIRROR_FOLDER, runtime);
	switch (error) {
	case -EACCES:
		return runtime_denied(access(path, F_OK) ? runtime : path, why, size);
	case -EPROTONOSUPPORT:
		return say(why, size, error,
			   "the daemon in %s is of another version, or somebody "
			   "has removed its folder " MIRROR_FOLDER "; restart pokeysd",
			   runtime);
	case -ENOENT:
	case 0:
		return say(why, size, error, "no daemon in %s; is pokeysd running?", runtime);
	default:
		return say(why, size, error, "%s: %s", path, strerror(-error));
	}
}

/* Why there is no such file: no daemon, no such device, or not for us. */
static int explain(const char *runtime, const char *device, int error, char *why, size_t size)
{
	char names[SHM_DEVICES_MAX][POKEYS_SHM_NAME_MAX];
	char path[PATH_MOST];
	int known;

	if (error == -ELOOP || error == -ENXIO)
		return say_foreign(file_path(path, runtime, device), why, size);
	if (error != -ENOENT && error != -ENOTDIR)
		return mirror_explain(runtime, error, why, size);
	known = mirror_devices(runtime, names, SHM_DEVICES_MAX);
	if (known > 0)
		return say(why, size, -ENODEV, "the daemon has no device '%s'; it has: %s%s",
			   device, names[0], known > 1 ? ", ..." : "");
	return mirror_explain(runtime, known ? known : -ENOENT, why, size);
}

int mirror_open(struct mirror_view *view, const char *runtime, const char *device, char *why,
		size_t size)
{
	struct mirror_head head;
	char path[PATH_MOST];
	struct stat status;
	void *base;
	int fd = open(file_path(path, runtime, device),
		      O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	int r;

	if (fd < 0)
		return explain(runtime, device, -errno, why, size);
	r = judge(fd, path, &status, &head, why, size);
	if (r) {
		close(fd);
		return r;
	}
	base = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_SHARED | MAP_POPULATE, fd, 0);
	close(fd);
	if (base == MAP_FAILED)
		return say(why, size, -errno, "%s: cannot be mapped: %s", path, strerror(errno));
	*view = (struct mirror_view){
		.shared = base,
		.size = (size_t)status.st_size,
		.device = status.st_dev,
		.inode = status.st_ino,
		.head = head,
	};
	return 0;
}

void mirror_close(struct mirror_view *view)
{
	munmap((void *)(uintptr_t)view->shared, view->size);
}

bool mirror_is_current(const struct mirror_view *view, const char *runtime, const char *device)
{
	char path[PATH_MOST];
	struct stat status;

	return !lstat(file_path(path, runtime, device), &status) && status.st_dev == view->device &&
	       status.st_ino == view->inode;
}

static bool copy_newest(const struct mirror_view *view, const struct mirror_part *part, void *to)
{
	const unsigned char *base = (const unsigned char *)view->shared;
	const _Atomic uint64_t *counter = (const void *)(base + part->counter);

	for (int i = 0; i < TRIES; i++) {
		const uint64_t count = atomic_load_explicit(counter, memory_order_acquire);

		mirror_copy_out(to, base + part->cell[count & 1], part->size);
		atomic_thread_fence(memory_order_acquire);
		if (atomic_load_explicit(counter, memory_order_relaxed) == count)
			return true;
	}
	return false;
}

int mirror_read(const struct mirror_view *view, enum mirror_image image, void *out)
{
	union {
		struct header header;
		struct pokeys_state state;
		struct pokeys_diag diag;
		struct pokeys_report report;
	} copy;
	const struct mirror_part *part = &view->head.part[image];

	if (!copy_newest(view, part, &copy))
		return -EAGAIN;
	if (memcmp(&copy.header, &headers[image], sizeof(copy.header)) != 0)
		return -EPROTO;
	memcpy(out, &copy, part->size);
	return 0;
}

/* One of them, if it is still there and whole. */
static bool copy_event(const struct mirror_view *view, uint64_t number, struct pokeys_event *to)
{
	const struct mirror_ring *ring = &view->head.events;
	const unsigned char *slot = (const unsigned char *)view->shared + ring->slot +
				    (number - 1) % ring->slots * ring->slot_size;
	const _Atomic uint64_t *whole = (const void *)slot;

	if (atomic_load_explicit(whole, memory_order_acquire) != number)
		return false;
	to->number = number;
	mirror_copy_out(&to->t_ns, slot + sizeof(to->number), sizeof(*to) - sizeof(to->number));
	atomic_thread_fence(memory_order_acquire);
	to->kind[sizeof(to->kind) - 1] = '\0';
	to->text[sizeof(to->text) - 1] = '\0';
	return atomic_load_explicit(whole, memory_order_relaxed) == number;
}

size_t mirror_read_events(const struct mirror_view *view, uint64_t *next, struct pokeys_event *out,
			  size_t max)
{
	const struct mirror_ring *ring = &view->head.events;
	const _Atomic uint64_t *counter = (const void *)((const unsigned char *)view->shared +
							 ring->counter);
	const uint64_t newest = atomic_load_explicit(counter, memory_order_acquire);
	const uint64_t oldest = newest > ring->slots ? newest - ring->slots + 1 : 1;
	size_t count = 0;

	if (*next < oldest)
		*next = oldest;
	for (; count < max && *next <= newest && *next; ++*next)
		count += copy_event(view, *next, &out[count]);
	return count;
}

struct named {
	uint32_t number, devices;
	uint64_t epoch;
	char name[POKEYS_SHM_NAME_MAX];
};

static int by_number(const void *a, const void *b)
{
	const struct named *one = a, *other = b;

	return one->number < other->number ? -1 : one->number > other->number;
}

/* 1, 0 (not a device's name), or -errno. */
static int take_name(int folder_fd, const char *name, struct named *named)
{
	struct mirror_head head = { 0 };
	struct stat status;
	int fd, r;

	if (!runtime_device_name_ok(name))
		return 0;
	fd = openat(folder_fd, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	if (fd < 0)
		return -errno;
	r = read_head(fd, &status, &head);
	close(fd);
	*named = (struct named){
		.number = head.number,
		.devices = head.devices,
		.epoch = head.epoch,
	};
	snprintf(named->name, sizeof(named->name), "%.31s", name);
	return r ? r : 1;
}

/* All of one daemon's, and no other's. */
static bool is_complete(const struct named *found, int count)
{
	for (int i = 0; i < count; i++)
		if (found[i].epoch != found[0].epoch || found[i].devices != (uint32_t)count)
			return false;
	return true;
}

/* How many names are there, or -errno of what is no file of a mirror. */
static int take_names(DIR *folder, struct named found[SHM_DEVICES_MAX])
{
	struct dirent *entry;
	int count = 0, r;

	while (count < SHM_DEVICES_MAX && (entry = readdir(folder))) {
		r = take_name(dirfd(folder), entry->d_name, &found[count]);
		if (r < 0 && r != -ENOENT)
			return r;
		count += r > 0;
	}
	return count;
}

int mirror_devices(const char *runtime, char names[][POKEYS_SHM_NAME_MAX], size_t max)
{
	struct named found[SHM_DEVICES_MAX];
	char path[PATH_MOST];
	DIR *folder;
	int count, error;

	snprintf(path, sizeof(path), "%s/" MIRROR_FOLDER, runtime);
	folder = opendir(path);
	if (!folder) {
		error = errno;
		if (has_no_mirror(runtime))
			return -EPROTONOSUPPORT;
		return error == ENOENT || error == ENOTDIR ? 0 : -error;
	}
	count = take_names(folder, found);
	closedir(folder);
	if (count < 0 || !is_complete(found, count))
		return count < 0 ? count : 0;
	qsort(found, (size_t)count, sizeof(found[0]), by_number);
	for (size_t i = 0; i < (size_t)count && i < max; i++)
		memcpy(names[i], found[i].name, sizeof(found[i].name));
	return count;
}
