// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What publishing and reading cost, beside the least they could cost: memcpy
 * of the same bytes, and a bare seqlock over them. shm_write and shm_loan write the
 * mirror as well; mirror_write is what that adds. shm_read is a commander's, mirror_read
 * that of all others. One process, one thread,
 * each figure the median of many batches, the contenders taking turns so that
 * a drift of the machine touches all of them alike.
 *
 * The seqlock is here only to be held against; a reader that meets a writer
 * stopped in mid-update spins in it without bound, which is why the images do
 * not use one.
 */
#include <fcntl.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "bench/samples.h"
#include "shm/host.h"
#include "shm/mirror.h"

enum { BATCH = 64, BATCHES = 4000, CONTENDERS = 8 };

static struct {
	_Atomic uint64_t sequence;
	struct pokeys_state state;
} seqlock;

static struct pokeys_state source, copy;
static struct shm_device *device;
static pokeys_client *commander, *monitor;
static struct mirror mirror;

static void barrier(void)
{
	__asm__ volatile("" ::: "memory");
}

static void do_memcpy(void)
{
	memcpy(&copy, &source, sizeof(copy));
	barrier();
}

static void do_seqlock_write(void)
{
	uint64_t s = atomic_load_explicit(&seqlock.sequence, memory_order_relaxed);

	atomic_store_explicit(&seqlock.sequence, s + 1, memory_order_relaxed);
	atomic_thread_fence(memory_order_release);
	memcpy(&seqlock.state, &source, sizeof(source));
	atomic_store_explicit(&seqlock.sequence, s + 2, memory_order_release);
}

static void do_seqlock_read(void)
{
	uint64_t before, after;

	do {
		before = atomic_load_explicit(&seqlock.sequence, memory_order_acquire);
		memcpy(&copy, &seqlock.state, sizeof(copy));
		atomic_thread_fence(memory_order_acquire);
		after = atomic_load_explicit(&seqlock.sequence, memory_order_relaxed);
	} while (before != after || before & 1);
	barrier();
}

static void do_write(void)
{
	shm_device_write(device, &source);
}

static void do_loan(void)
{
	struct pokeys_state *cell = shm_device_loan(device);

	memcpy(cell, &source, sizeof(*cell));
	shm_device_commit(device);
}

static void do_mirror_write(void)
{
	mirror_write(&mirror, MIRROR_STATE, &source);
}

static void read_as(pokeys_client *client)
{
	if (pokeys_client_read(client, &copy) < 0)
		abort();
	barrier();
}

static void do_read(void)
{
	read_as(commander);
}

static void do_mirror_read(void)
{
	read_as(monitor);
}

static const struct {
	const char *name;
	void (*run)(void);
} contender[CONTENDERS] = {
	{ "memcpy", do_memcpy },
	{ "seqlock_write", do_seqlock_write },
	{ "shm_write", do_write },
	{ "shm_loan", do_loan },
	{ "mirror_write", do_mirror_write },
	{ "seqlock_read", do_seqlock_read },
	{ "shm_read", do_read },
	{ "mirror_read", do_mirror_read },
};

static uint64_t now_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

static bool attach_as(pokeys_client **client, const char *runtime, unsigned int flags)
{
	return !pokeys_client_open(client, runtime, "bench", "bench-shm", flags) &&
	       pokeys_client_poll(*client) == POKEYS_CLIENT_ATTACHED;
}

/* One that nobody reads, beside the device's own. */
static bool make_mirror(const char *runtime)
{
	const int fd = open(runtime, O_RDONLY | O_DIRECTORY);

	return fd >= 0 && !mirror_make(&mirror, fd, (gid_t)-1, "other", 1, 1);
}

static bool attach(const char *runtime)
{
	char why[256] = "";
	struct shm_host *host;

	if (shm_host_open(&host, runtime, NULL, NULL, why, sizeof(why)) < 0 ||
	    shm_host_add(host, "bench", &device, why, sizeof(why)) < 0 ||
	    shm_host_publish(host, why, sizeof(why)) < 0 ||
	    !attach_as(&commander, runtime, POKEYS_CLIENT_COMMANDER) ||
	    !attach_as(&monitor, runtime, 0) || !make_mirror(runtime)) {
		fprintf(stderr, "bench-shm: cannot attach in %s: %s\n", runtime, why);
		return false;
	}
	do_write();
	return true;
}

int main(int argc, char **argv)
{
	static struct samples samples[CONTENDERS];

	if (argc != 2) {
		fprintf(stderr, "usage: bench-shm RUNTIME_FOLDER\n");
		return 2;
	}
	if (!attach(argv[1]))
		return 1;
	for (int i = 0; i < CONTENDERS; i++)
		if (samples_init(&samples[i], BATCHES) < 0)
			return 1;
	for (int batch = 0; batch < BATCHES; batch++)
		for (int i = 0; i < CONTENDERS; i++) {
			uint64_t t = now_ns();

			for (int k = 0; k < BATCH; k++)
				contender[i].run();
			samples_add(&samples[i], (now_ns() - t) / BATCH);
		}
	printf("{\"bytes\": %zu, ", sizeof(source));
	for (int i = 0; i < CONTENDERS; i++) {
		samples_print(&samples[i], contender[i].name);
		printf("%s", i + 1 < CONTENDERS ? ", " : "}\n");
	}
	return 0;
}
