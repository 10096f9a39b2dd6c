/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Page faults of the realtime thread, counted by somebody else.
 *
 * getrusage(RUSAGE_THREAD) tells only about the calling thread, and the
 * realtime thread shall not spend a system call on being watched. So another
 * thread reads what the kernel says about it in /proc: fields 10 and 12 of
 * its stat file, counted behind the name, which may hold blanks and brackets.
 * What it had before its first cycle is taken off.
 */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>
#include "daemon/rt/internal.h"

void faults_begin(struct loop *loop)
{
	struct rusage usage = { 0 };

	getrusage(RUSAGE_THREAD, &usage);
	loop->own->minor_before = (uint64_t)usage.ru_minflt;
	loop->own->major_before = (uint64_t)usage.ru_majflt;
	atomic_store(&loop->shared.thread, gettid());
	if (loop->recorder.head)
		atomic_store(&loop->recorder.head->thread, gettid());
}

static int read_stat(int32_t thread, char *text, size_t size)
{
	char path[64];
	ssize_t n;
	int fd;

	snprintf(path, sizeof path, "/proc/self/task/%" PRId32 "/stat", thread);
	fd = open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0)
		return -errno;
	n = read(fd, text, size - 1);
	close(fd);
	if (n <= 0)
		return -EIO;
	text[n] = '\0';
	return 0;
}

int loop_sample_faults(struct loop *loop)
{
	int32_t thread = atomic_load(&loop->shared.thread);
	uint64_t minor, major;
	char text[1024], *rest;
	int rc;

	if (!thread)
		return -EAGAIN;
	rc = read_stat(thread, text, sizeof text);
	if (rc < 0)
		return rc;
	rest = strrchr(text, ')');
	if (!rest || sscanf(rest, ") %*c %*d %*d %*d %*d %*d %*u %" SCNu64 " %*u %" SCNu64, &minor,
			    &major) != 2)
		return -EPROTO;
	atomic_store(&loop->shared.minor_faults, minor - loop->own->minor_before);
	atomic_store(&loop->shared.major_faults, major - loop->own->major_before);
	return 0;
}
