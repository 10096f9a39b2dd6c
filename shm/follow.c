/* SPDX-License-Identifier: MIT */
/*
 * The follower: a thread of the library that polls.
 *
 * It must be harmless wherever it is started from, and LinuxCNC starts it
 * from a process that owns realtime threads. So nothing is inherited: the
 * scheduling class is set explicitly (a thread made by a SCHED_FIFO thread
 * would be SCHED_FIFO), all signals are blocked (they belong to the program),
 * and it does not stay on the core of a caller that is pinned: it would share
 * it with the servo thread for ever, for an isolated core is left by nobody.
 * It is joined at close; a thread that outlives a dlclose crashes the host.
 */
#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "shm/client_private.h"

enum {
	STACK_BYTES = 1024 * 1024, /* an attach was seen to use 160 kB of it */
	REFUSED_MS = 200,          /* an attempt costs milliseconds: not more often */
};

static void add_ms(struct timespec *when, unsigned int ms)
{
	when->tv_sec += ms / 1000;
	when->tv_nsec += (long)(ms % 1000) * 1000000;
	if (when->tv_nsec >= 1000000000) {
		when->tv_nsec -= 1000000000;
		when->tv_sec++;
	}
}

static void *follow(void *argument)
{
	struct pokeys_client *client = argument;
	struct client_follower *follower = &client->follower;
	struct timespec when;
	unsigned int ms;

	pthread_setname_np(pthread_self(), "pokeys-follow");
	pthread_mutex_lock(&follower->lock);
	while (!follower->stop) {
		pthread_mutex_unlock(&follower->lock);
		ms = follower->interval_ms;
		if (pokeys_client_poll(client) == POKEYS_CLIENT_REFUSED && ms < REFUSED_MS)
			ms = REFUSED_MS;
		clock_gettime(CLOCK_MONOTONIC, &when);
		add_ms(&when, ms);
		pthread_mutex_lock(&follower->lock);
		while (!follower->stop &&
		       !pthread_cond_timedwait(&follower->wake, &follower->lock, &when))
			;
	}
	pthread_mutex_unlock(&follower->lock);
	return NULL;
}

/* CPUs in /sys/devices/system/cpu/isolated, like "1,4-7". */
static void remove_isolated(cpu_set_t *cpus)
{
	unsigned long first, last;
	char text[256];
	char *at = text;
	FILE *file = fopen("/sys/devices/system/cpu/isolated", "re");

	if (!file)
		return;
	if (!fgets(text, sizeof(text), file))
		text[0] = '\0';
	fclose(file);
	while (*at >= '0' && *at <= '9') {
		first = strtoul(at, &at, 10);
		last = *at == '-' ? strtoul(at + 1, &at, 10) : first;
		for (; first <= last && first < CPU_SETSIZE; first++)
			CPU_CLR(first, cpus);
		if (*at == ',')
			at++;
	}
}

/*
 * Where it may run: where the caller may, unless the caller is realtime or
 * pinned to one core; then everywhere else. Never on isolated cores. If
 * nothing is left, there is no choice: the caller's.
 */
static void choose_cpus(cpu_set_t *cpus)
{
	struct sched_param parameter;
	cpu_set_t caller, all;
	int policy = SCHED_OTHER;

	CPU_ZERO(&caller);
	sched_getaffinity(0, sizeof(caller), &caller);
	pthread_getschedparam(pthread_self(), &policy, &parameter);
	*cpus = caller;
	if (policy != SCHED_OTHER || CPU_COUNT(&caller) == 1) {
		CPU_ZERO(&all);
		for (size_t cpu = 0; cpu < CPU_SETSIZE; cpu++)
			CPU_SET(cpu, &all);
		CPU_XOR(cpus, &all, &caller);
	}
	remove_isolated(cpus);
}

static int start_thread(pthread_t *out, void *(*run)(void *), void *argument, const cpu_set_t *cpus)
{
	const struct sched_param parameter = { .sched_priority = 0 };
	pthread_attr_t attributes;
	sigset_t all, before;
	int r;

	r = pthread_attr_init(&attributes);
	if (r)
		return -r;
	pthread_attr_setstacksize(&attributes, STACK_BYTES);
	pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
	pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
	pthread_attr_setschedparam(&attributes, &parameter);
	if (cpus)
		pthread_attr_setaffinity_np(&attributes, sizeof(*cpus), cpus);
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	r = pthread_create(out, &attributes, run, argument);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	pthread_attr_destroy(&attributes);
	return -r;
}

int client_thread(pthread_t *out, void *(*run)(void *), void *argument)
{
	cpu_set_t cpus;
	int r;

	choose_cpus(&cpus);
	r = start_thread(out, run, argument, &cpus);
	if (r == -EINVAL) /* none of these CPUs is there for us */
		r = start_thread(out, run, argument, NULL);
	return r;
}

int client_follow_start(struct pokeys_client *client, unsigned int interval_ms)
{
	struct client_follower *follower = &client->follower;
	pthread_condattr_t attributes;
	int r;

	if (follower->running)
		return -EALREADY;
	follower->interval_ms = interval_ms;
	follower->stop = false;
	pthread_mutex_init(&follower->lock, NULL);
	pthread_condattr_init(&attributes);
	pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
	pthread_cond_init(&follower->wake, &attributes);
	pthread_condattr_destroy(&attributes);
	r = client_thread(&follower->thread, follow, client);
	follower->running = !r;
	return r;
}

void client_follow_end(struct pokeys_client *client)
{
	struct client_follower *follower = &client->follower;

	if (!follower->running)
		return;
	pthread_mutex_lock(&follower->lock);
	follower->stop = true;
	pthread_cond_signal(&follower->wake);
	pthread_mutex_unlock(&follower->lock);
	pthread_join(follower->thread, NULL);
	pthread_cond_destroy(&follower->wake);
	pthread_mutex_destroy(&follower->lock);
	follower->running = false;
}
