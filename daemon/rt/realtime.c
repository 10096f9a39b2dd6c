/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Locked memory, priority, a core: asked for, checked, and refused in words.
 *
 * Traps that this file knows:
 *  - mlockall() succeeds under a small RLIMIT_MEMLOCK as long as the process
 *    is small, and a later mmap() or pthread_create() fails with EAGAIN. So
 *    after locking, room is asked for and given back; if it is not to be had
 *    the lock is taken off again, or the process could not even go on without.
 *  - memory that the allocator gives back is unmapped, which interrupts every
 *    core that runs this process, also the isolated one. It keeps it instead.
 *  - SCHED_FIFO answers EPERM for a missing right and for a cgroup without
 *    realtime time alike (cgroup.c).
 *  - timer slack of 50 us hits every sleep of a thread that is not realtime;
 *    with --no-realtime that is this one.
 */
#include <errno.h>
#include <fcntl.h>
#include <malloc.h>
#include <sched.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>
#include "daemon/rt/cgroup.h"
#include "daemon/rt/realtime.h"

enum {
	ROOM = 32 << 20, /* what is still to come: stacks, rings, shared memory */
	HEAP = 1 << 20,
	STACK = 64 << 10, /* of the 256 KiB that the realtime thread has */
};

static int refuse(int rc, char *why, size_t size, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

static int refuse(int rc, char *why, size_t size, const char *format, ...)
{
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(why, size, format, arguments);
	va_end(arguments);
	return rc;
}

static void touch(volatile uint8_t *memory, size_t size)
{
	for (size_t i = 0; i < size; i += 4096)
		memory[i] = 0;
}

static void keep_heap(void)
{
	void *heap;

	mallopt(M_TRIM_THRESHOLD, -1);
	mallopt(M_MMAP_MAX, 0);
	heap = malloc(HEAP);
	if (heap)
		touch(heap, HEAP);
	free(heap);
}

/* Can so much more be mapped? Address space only, no page is touched. */
static bool room_to_lock(void)
{
	void *room = mmap(NULL, ROOM, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);

	if (room == MAP_FAILED)
		return false;
	munmap(room, ROOM);
	return true;
}

static int limit_refused(int rc, char *why, size_t size)
{
	struct rlimit limit = { 0 };

	getrlimit(RLIMIT_MEMLOCK, &limit);
	if (limit.rlim_cur == RLIM_INFINITY)
		return refuse(rc, why, size, "memory cannot be locked: %s", strerror(-rc));
	return refuse(rc, why, size,
		      "memory cannot be locked: the limit is %llu KiB; set "
		      "LimitMEMLOCK=infinity in the unit (or ulimit -l unlimited, or give "
		      "CAP_IPC_LOCK)",
		      (unsigned long long)limit.rlim_cur / 1024);
}

int realtime_lock_memory(char *why, size_t size)
{
	int rc;

	if (size)
		why[0] = '\0';
	if (mlockall(MCL_CURRENT | MCL_FUTURE) < 0) {
		rc = -errno;
		return limit_refused(rc, why, size);
	}
	if (!room_to_lock()) {
		munlockall();
		return limit_refused(-EAGAIN, why, size);
	}
	keep_heap();
	return 0;
}

static int pin(int cpu, char *why, size_t size)
{
	cpu_set_t set;

	if (cpu < 0)
		return 0;
	CPU_ZERO(&set);
	if (cpu < CPU_SETSIZE)
		CPU_SET((size_t)cpu, &set);
	if (sched_setaffinity(0, sizeof set, &set) == 0)
		return 0;
	return refuse(-errno, why, size,
		      "the realtime thread cannot be pinned to core %d: %s; "
		      "the machine has cores 0 to %ld, and a cpuset may allow fewer",
		      cpu, strerror(errno), sysconf(_SC_NPROCESSORS_CONF) - 1);
}

static int priority_refused(int rc, int priority, char *why, size_t size)
{
	char path[512];

	if (rc == -EPERM &&
	    cgroup_forbids_realtime("/proc/self/cgroup", "/sys/fs/cgroup", path, sizeof path))
		return refuse(rc, why, size,
			      "SCHED_FIFO is refused: this process is in a cgroup "
			      "without realtime time; write a budget (950000) into %s and into "
			      "those above it, or start the daemon in the top group",
			      path);
	if (rc == -EPERM)
		return refuse(rc, why, size,
			      "SCHED_FIFO priority %d is refused; give "
			      "CAP_SYS_NICE, or set LimitRTPRIO=%d in the unit",
			      priority, priority);
	return refuse(rc, why, size, "SCHED_FIFO priority %d is refused: %s", priority,
		      strerror(-rc));
}

static int set_priority(int priority, char *why, size_t size)
{
	const struct sched_param parameter = { .sched_priority = priority };

	if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) == 0)
		return 0;
	return priority_refused(-errno, priority, why, size);
}

static void fault_stack_in(void)
{
	volatile uint8_t stack[STACK];

	touch(stack, sizeof stack);
}

int realtime_enter(const struct realtime_options *options, char *why, size_t size)
{
	int rc;

	if (size)
		why[0] = '\0';
	fault_stack_in();
	prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);
	rc = set_priority(options->priority, why, size);
	if (rc == 0 || !options->required) {
		char text[256] = "";
		int pinned = pin(options->cpu, text, sizeof text);

		if (rc == 0 && pinned < 0)
			rc = refuse(pinned, why, size, "%s", text);
	}
	return rc;
}

int realtime_hold_cpu_awake(void)
{
	const int32_t no_latency = 0;
	int fd = open("/dev/cpu_dma_latency", O_RDWR | O_CLOEXEC);

	if (fd < 0)
		return -errno;
	if (write(fd, &no_latency, sizeof no_latency) != (ssize_t)sizeof no_latency) {
		int rc = -errno;

		close(fd);
		return rc;
	}
	return fd;
}

double realtime_duty_of(long runtime_us, long period_us)
{
	double part;

	if (runtime_us < 0)
		return 1.0;
	if (period_us <= 0)
		return 0.9;
	/* a twentieth less, in one division: 0.95 - 0.05 is not 0.9 */
	part = (double)(20 * runtime_us - period_us) / (double)(20 * period_us);
	if (part > 0.9)
		return 0.9;
	return part < 0.1 ? 0.1 : part;
}

static long read_setting(const char *path, long otherwise)
{
	FILE *f = fopen(path, "re");
	long value;

	if (!f)
		return otherwise;
	if (fscanf(f, "%ld", &value) != 1)
		value = otherwise;
	fclose(f);
	return value;
}

double realtime_duty_limit(void)
{
	return realtime_duty_of(read_setting("/proc/sys/kernel/sched_rt_runtime_us", 950000),
				read_setting("/proc/sys/kernel/sched_rt_period_us", 1000000));
}
