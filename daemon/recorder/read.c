/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The file from outside.
 *
 * It is read with pread() and not mapped: whoever may write to the folder could
 * cut a mapped file short under a reader. For the same reason nothing in it is
 * believed: sizes are checked against the file, and a slot that does not bear
 * the number of its place is left out.
 *
 * What was copied is judged afterwards, by `written` as it is then: the writer
 * may have gone round meanwhile. The slot it is about to fill counts as
 * overwritten, for it may be filling it just now.
 */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include "daemon/recorder/read.h"

static size_t file_size(uint32_t slots)
{
	return RECORDER_HEAD + (size_t)slots * sizeof(struct recorder_slot);
}

static uint32_t round_up(uint32_t slots)
{
	uint32_t power = RECORDER_SLOTS_MIN;

	while (power < slots && power < RECORDER_SLOTS_MAX)
		power *= 2;
	return power;
}

static int map(struct recorder *recorder, int fd, uint32_t slots)
{
	void *memory;
	int rc;

	do { /* a folder in memory stops for any signal */
		rc = posix_fallocate(fd, 0, (off_t)file_size(slots));
	} while (rc == EINTR);
	if (rc)
		return -rc;
	memory = mmap(NULL, file_size(slots), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd,
		      0);
	if (memory == MAP_FAILED)
		return -errno;
	recorder->head = memory;
	recorder->slot = (void *)((char *)memory + RECORDER_HEAD);
	recorder->mask = slots - 1;
	return 0;
}

int recorder_create(struct recorder *recorder, const char *path, uint32_t slots)
{
	int fd, rc;

	*recorder = (struct recorder){ 0 };
	slots = round_up(slots);
	unlink(path);
	fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0640);
	if (fd < 0)
		return -errno;
	rc = map(recorder, fd, slots);
	close(fd);
	if (rc) {
		unlink(path);
		return rc;
	}
	memcpy(recorder->head->magic, RECORDER_MAGIC, sizeof(recorder->head->magic));
	recorder->head->version = RECORDER_VERSION;
	recorder->head->slot_size = sizeof(struct recorder_slot);
	recorder->head->slots = slots;
	recorder->head->process = getpid();
	return 0;
}

void recorder_close(struct recorder *recorder)
{
	if (recorder->head)
		munmap(recorder->head, file_size((uint32_t)recorder->mask + 1));
	*recorder = (struct recorder){ 0 };
}

static const char *fault_of(const struct recorder_file *file, off_t size)
{
	const struct recorder_head *head = &file->head;

	if (memcmp(head->magic, RECORDER_MAGIC, sizeof(head->magic)))
		return "it is no record of pokeysd";
	if (head->version != RECORDER_VERSION || head->slot_size != sizeof(struct recorder_slot))
		return "it was written by another version of pokeysd";
	if (head->slots < RECORDER_SLOTS_MIN || head->slots > RECORDER_SLOTS_MAX ||
	    head->slots & (head->slots - 1) || head->devices > RECORDER_DEVICES ||
	    size < (off_t)file_size(head->slots))
		return "it is damaged";
	return NULL;
}

int recorder_open(struct recorder_file *file, const char *path, char *why, size_t size)
{
	struct stat status;
	const char *fault = "it is no record of pokeysd";
	int error;

	file->fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
	if (file->fd < 0 || fstat(file->fd, &status)) {
		error = errno;
		recorder_release(file);
		snprintf(why, size, "%s: %s", path, strerror(error));
		return -error;
	}
	if (S_ISREG(status.st_mode) &&
	    pread(file->fd, &file->head, sizeof(file->head), 0) == (ssize_t)sizeof(file->head))
		fault = fault_of(file, status.st_size);
	if (!fault) {
		for (size_t i = 0; i < RECORDER_DEVICES; i++)
			file->head.name[i][sizeof(file->head.name[i]) - 1] = '\0';
		return 0;
	}
	recorder_release(file);
	snprintf(why, size, "%s: %s", path, fault);
	return -EPROTO;
}

void recorder_release(struct recorder_file *file)
{
	if (file->fd >= 0)
		close(file->fd);
	file->fd = -1;
}

bool recorder_lives(const struct recorder_file *file)
{
	struct recorder_head head;

	if (pread(file->fd, &head, sizeof(head), 0) != (ssize_t)sizeof(head) || head.ended ||
	    head.thread <= 0)
		return false;
	return !kill(head.thread, 0) || errno == EPERM;
}

uint64_t recorder_written(const struct recorder_file *file)
{
	uint64_t written = 0;

	if (pread(file->fd, &written, sizeof(written), offsetof(struct recorder_head, written)) !=
	    (ssize_t)sizeof(written))
		return 0;
	atomic_thread_fence(memory_order_acquire);
	return written;
}

/* The oldest number that nobody overwrites. */
static uint64_t oldest(const struct recorder_file *file, uint64_t written)
{
	return written < file->head.slots ? 0 : written - file->head.slots + 1;
}

/* Leaves in `out` what is whole of `count` slots copied from number `first` on. */
static size_t keep_whole(const struct recorder_file *file, uint64_t first,
			 struct recorder_slot *out, size_t count)
{
	uint64_t from;
	size_t kept = 0;

	atomic_thread_fence(memory_order_acquire);
	from = oldest(file, recorder_written(file));
	for (size_t i = 0; i < count; i++)
		if (first + i >= from && out[i].number == first + i)
			out[kept++] = out[i];
	return kept;
}

size_t recorder_read(const struct recorder_file *file, uint64_t *next, struct recorder_slot *out,
		     size_t count)
{
	const uint64_t written = recorder_written(file);
	const uint64_t from = oldest(file, written);
	uint64_t first = *next > from ? *next : from;
	uint64_t at = first & (file->head.slots - 1);
	ssize_t n;

	if (first >= written)
		return 0;
	if (count > written - first)
		count = (size_t)(written - first);
	if (count > file->head.slots - at) /* up to the end of the file only */
		count = (size_t)(file->head.slots - at);
	n = pread(file->fd, out, count * sizeof(*out), (off_t)(RECORDER_HEAD + at * sizeof(*out)));
	*next = first + count;
	return n == (ssize_t)(count * sizeof(*out)) ? keep_whole(file, first, out, count) : 0;
}
