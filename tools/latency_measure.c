// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * cyclictest's measurement: sleep until an absolute time, look at the clock,
 * note how late it is, again. Memory is locked and the stack touched before, or
 * the first page faults would be the maximum.
 *
 * All threads begin at one moment and have the same ticks. With a daemon those
 * lie half a period behind its own, so that on the same core neither finds the
 * other running: two SCHED_FIFO threads of one priority that wake up together
 * would each measure the other.
 *
 * A tick that was slept over is left out, as in the daemon, and not measured
 * again and again; its lateness is in the histogram, once.
 */
#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>
#include <pokeys/shm.h>
#include "tools/latency.h"
#include "tools/view.h"

enum { STACK = 256 << 10, TOUCHED = 64 << 10 };

struct sleeper {
	pthread_t thread;
	const struct latency_run *run;
	struct latency_series *series;
	uint64_t end_ns;
	int result; /* -errno */
};

static atomic_bool stopped;

static void stop(int number)
{
	(void)number;
	atomic_store(&stopped, true);
}

static void add(struct pokeys_histogram *histogram, uint64_t late_ns)
{
	histogram->bucket[pokeys_histogram_bucket(late_ns)]++;
	histogram->sum_ns += late_ns;
	if (!histogram->count++ || late_ns < histogram->min_ns)
		histogram->min_ns = late_ns;
	if (late_ns > histogram->max_ns)
		histogram->max_ns = late_ns;
}

static void sleep_until(uint64_t at_ns)
{
	const struct timespec at = {
		(time_t)(at_ns / 1000000000u),
		(long)(at_ns % 1000000000u),
	};

	clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
}

static void measure(struct sleeper *sleeper)
{
	uint64_t period = sleeper->run->period_ns, now = view_now();
	uint64_t tick = now - (now - sleeper->run->phase_ns) % period + 2 * period;

	while (tick < sleeper->end_ns && !atomic_load(&stopped)) {
		sleep_until(tick);
		now = view_now();
		if (now < tick) /* a signal woke us up */
			continue;
		add(&sleeper->series->histogram, now - tick);
		tick += ((now - tick) / period + 1) * period;
	}
}

static int become_realtime(int priority)
{
	const struct sched_param parameter = { .sched_priority = priority };

	prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);
	if (priority && sched_setscheduler(0, SCHED_FIFO, &parameter) < 0)
		return -errno;
	return 0;
}

static void *run_sleeper(void *argument)
{
	volatile uint8_t touched[TOUCHED];
	struct sleeper *sleeper = argument;
	cpu_set_t set;

	for (size_t i = 0; i < sizeof(touched); i += 4096)
		touched[i] = 0;
	CPU_ZERO(&set);
	CPU_SET((size_t)sleeper->series->cpu, &set);
	if (sched_setaffinity(0, sizeof(set), &set) < 0)
		sleeper->result = -errno;
	else
		sleeper->result = become_realtime(sleeper->run->priority);
	if (sleeper->result)
		atomic_store(&stopped, true);
	else
		measure(sleeper);
	return NULL;
}

static int create(struct sleeper *sleeper)
{
	pthread_attr_t attributes;
	int result;

	pthread_attr_init(&attributes);
	pthread_attr_setstacksize(&attributes, STACK);
	result = pthread_create(&sleeper->thread, &attributes, run_sleeper, sleeper);
	pthread_attr_destroy(&attributes);
	return -result;
}

/* A user's memory limit may suffice for the present memory but not for another thread's stack. */
static int start(struct sleeper *sleeper)
{
	int result = create(sleeper);

	if (result != -EAGAIN || sleeper->run->priority)
		return result;
	munlockall();
	return create(sleeper);
}

static void explain_memory(int result, char *why, size_t size)
{
	snprintf(why, size,
		 "memory cannot be locked: %s; run it as root, or raise this "
		 "user's limit (ulimit -l unlimited), or measure without: --no-realtime",
		 strerror(-result));
}

static int explain(const struct sleeper *sleeper, int result, char *why, size_t size)
{
	if (result == -EINVAL)
		snprintf(why, size, "core %d is not there, or not for this process",
			 sleeper->series->cpu);
	else if (result == -EPERM)
		snprintf(why, size,
			 "SCHED_FIFO priority %d is refused; run it as root, or give "
			 "this user a limit (rtprio in /etc/security/limits.d), or measure "
			 "without: --no-realtime",
			 sleeper->run->priority);
	else if (result == -EAGAIN)
		explain_memory(-ENOMEM, why, size);
	else
		snprintf(why, size, "a thread on core %d: %s", sleeper->series->cpu,
			 strerror(-result));
	return result;
}

/* The others need not go on. */
static void give_up(const struct sleeper *sleeper, int result, char *why, size_t size)
{
	atomic_store(&stopped, true);
	explain(sleeper, result, why, size);
}

int latency_measure(struct latency_run *run, size_t count, char *why, size_t size)
{
	struct sleeper sleepers[LATENCY_SERIES] = { 0 };
	struct sigaction action = { .sa_handler = stop };
	uint64_t begin = view_now(), end = begin + (uint64_t)(run->seconds * 1e9);
	size_t started = 0;
	int result = 0;

	if (mlockall(MCL_CURRENT | MCL_FUTURE) < 0 && run->priority) {
		result = -errno;
		explain_memory(result, why, size);
		return result;
	}
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	for (; started < count && !result; started += !result) {
		sleepers[started] = (struct sleeper){
			.run = run,
			.series = &run->series[started],
			.end_ns = end,
		};
		result = start(&sleepers[started]);
		if (result)
			give_up(&sleepers[started], result, why, size);
	}
	for (size_t i = 0; i < started; i++) {
		pthread_join(sleepers[i].thread, NULL);
		if (sleepers[i].result && !result)
			result = explain(&sleepers[i], sleepers[i].result, why, size);
	}
	run->seconds = (double)(view_now() - begin) / 1e9;
	return result;
}
