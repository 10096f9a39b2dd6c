/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a thread needs to be realtime: priority, a core of its own, memory
 * that never faults. Cold, called before the loop begins.
 */
#ifndef RT_REALTIME_H
#define RT_REALTIME_H

#include <stdbool.h>
#include <stddef.h>

struct realtime_options {
	int priority;  /* SCHED_FIFO 1..98 */
	int cpu;       /* core to pin to, -1 = none */
	bool required; /* false: go on without, and say so */
};

/*
 * Lock and pre-fault the process's memory; check that the limit really allows
 * it. Called once by the main thread before other threads are made. 0, or
 * -errno with one line in `why` (what was refused, what to do about it).
 */
int realtime_lock_memory(char *why, size_t size);

/*
 * Make the calling thread realtime. 0, or -errno with one line in `why`:
 * -EPERM no right to a realtime priority (capability, limit, or a cgroup
 * without realtime time), -EINVAL a core that does not exist.
 */
int realtime_enter(const struct realtime_options *options, char *why, size_t size);

/* Hold /dev/cpu_dma_latency at 0 us; fd, or -errno (not fatal). */
int realtime_hold_cpu_awake(void);

/*
 * The most of its time that a SCHED_FIFO thread may run without being
 * throttled (kernel.sched_rt_runtime_us of sched_rt_period_us, less 5 % for
 * safety), at most 0.9; 1.0 when throttling is off. Cold.
 */
double realtime_duty_limit(void);

/* The same from the two settings, in us. Pure. */
double realtime_duty_of(long runtime_us, long period_us);

#endif
