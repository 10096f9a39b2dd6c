// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What publishing costs while 0, 1, 5 and 20 others read the mirror, as it is in a
 * daemon: one image a millisecond, by a realtime thread that has slept meanwhile, and
 * once more for ANSWER_NS after it took the image's place back, as it does while a device
 * answers; so nothing is in its caches that would not be there. Each reader is a
 * process of its own, on the other cores, that reads a thousand times a second, too. The
 * mirror is written behind the commander's image.
 *
 * All readers are there from the beginning and take turns in being active, so
 * that a drift of the machine's speed touches all counts alike. Their reads are
 * counted: readers that never came to read would flatter the writer.
 */
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include "bench/samples.h"
#include "shm/host.h"

enum { READERS = 20, COUNTS = 4, SLICE = 50, PERIOD_NS = 1000000, ANSWER_NS = 50000 };

static const int counts[COUNTS] = { 0, 1, 5, READERS };

static struct shared {
	_Atomic int active;
	_Atomic int ready;
	_Atomic uint64_t reads[COUNTS];
	_Atomic int which;
} *shared;

static struct pokeys_state image;

static uint64_t now_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

static void sleep_until(uint64_t t)
{
	const struct timespec at = {
		.tv_sec = (time_t)(t / UINT64_C(1000000000)),
		.tv_nsec = (long)(t % UINT64_C(1000000000)),
	};

	clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
}

/* The daemon's core is its own: nobody else may use its caches. */
static void keep_off(int cpu)
{
	cpu_set_t set;

	if (sched_getaffinity(0, sizeof(set), &set) < 0 || CPU_COUNT(&set) < 2)
		return;
	CPU_CLR((size_t)cpu, &set);
	sched_setaffinity(0, sizeof(set), &set);
}

/* A reader, until the writer ends it. */
static void read_on(int number, const char *runtime, int cpu)
{
	uint64_t next = now_ns();
	pokeys_client *client;

	prctl(PR_SET_PDEATHSIG, SIGKILL);
	keep_off(cpu);
	if (pokeys_client_open(&client, runtime, "bench", "reader", 0) < 0 ||
	    pokeys_client_poll(client) != POKEYS_CLIENT_ATTACHED)
		_exit(1);
	atomic_fetch_add(&shared->ready, 1);
	for (;;) {
		sleep_until(next += PERIOD_NS);
		if (number >= atomic_load_explicit(&shared->active, memory_order_relaxed))
			continue;
		if (pokeys_client_read(client, &image) == 0)
			atomic_fetch_add_explicit(&shared->reads[atomic_load(&shared->which)], 1,
						  memory_order_relaxed);
		if (now_ns() > next + 10 * PERIOD_NS)
			next = now_ns();
	}
}

static bool start_readers(const char *runtime, int cpu, pid_t readers[READERS])
{
	for (int i = 0; i < READERS; i++) {
		readers[i] = fork();
		if (readers[i] == 0)
			read_on(i, runtime, cpu);
	}
	while (atomic_load(&shared->ready) < READERS) {
		if (waitpid(-1, NULL, WNOHANG) != 0)
			return false;
		sleep_until(now_ns() + PERIOD_NS);
	}
	return true;
}

static void become_realtime(int cpu)
{
	struct sched_param parameter = { .sched_priority = 80 };
	cpu_set_t set;

	CPU_ZERO(&set);
	CPU_SET((size_t)cpu, &set);
	if (sched_setaffinity(0, sizeof(set), &set) < 0 ||
	    sched_setscheduler(0, SCHED_FIFO, &parameter) < 0 || mlockall(MCL_CURRENT) < 0)
		perror("bench-readers: not realtime");
}

/* Taking the image's lines back, publishing it, and writing the mirror that they read. */
static struct samples taking[COUNTS], publishing[COUNTS], mirroring[COUNTS];

/* A slice of publishing with so many readers; the first is for the change to settle. */
static void publish(struct shm_device *device, int which)
{
	uint64_t next = now_ns();

	atomic_store(&shared->which, which);
	atomic_store(&shared->active, counts[which]);
	for (int i = 0; i < SLICE; i++) {
		uint64_t t, taken, published, mirrored;

		sleep_until(next += PERIOD_NS);
		t = now_ns();
		shm_device_prepare(device); /* as the loop does, before there are answers */
		taken = now_ns() - t;
		sleep_until(next + ANSWER_NS);
		image.cycle++;
		t = now_ns();
		memcpy(shm_device_loan(device), &image, sizeof(image));
		shm_device_commit(device);
		published = now_ns();
		shm_device_mirror(device);
		mirrored = now_ns();
		if (i < SLICE / 10)
			continue;
		samples_add(&publishing[which], published - t);
		samples_add(&mirroring[which], mirrored - published);
		samples_add(&taking[which], taken);
	}
}

int main(int argc, char **argv)
{
	pid_t readers[READERS];
	struct shm_device *device;
	struct shm_host *host;
	char why[256] = "";
	bool good;
	int slices;

	if (argc != 4 || (slices = atoi(argv[2])) < 1) {
		fprintf(stderr, "usage: bench-readers RUNTIME_FOLDER SLICES CPU\n");
		return 2;
	}
	shared = mmap(NULL, sizeof(*shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1,
		      0);
	if (shared == MAP_FAILED ||
	    shm_host_open(&host, argv[1], NULL, NULL, why, sizeof(why)) < 0 ||
	    shm_host_add(host, "bench", &device, why, sizeof(why)) < 0 ||
	    shm_host_publish(host, why, sizeof(why)) < 0) {
		fprintf(stderr, "bench-readers: %s: %s\n", argv[1], why);
		return 1;
	}
	shm_device_write(device, &image);
	for (int i = 0; i < COUNTS; i++)
		if (samples_init(&publishing[i], (size_t)slices * SLICE) < 0 ||
		    samples_init(&mirroring[i], (size_t)slices * SLICE) < 0 ||
		    samples_init(&taking[i], (size_t)slices * SLICE) < 0)
			return 1;
	good = start_readers(argv[1], atoi(argv[3]), readers);
	become_realtime(atoi(argv[3]));
	for (int slice = 0; good && slice < slices; slice++)
		for (int i = 0; i < COUNTS; i++)
			publish(device, i);
	for (int i = 0; i < READERS; i++)
		if (readers[i] > 0)
			kill(readers[i], SIGKILL);
	printf("{");
	for (int i = 0; i < COUNTS; i++) {
		char name[24];

		snprintf(name, sizeof(name), "%d", counts[i]);
		samples_print(&publishing[i], name);
		printf(", ");
		snprintf(name, sizeof(name), "mirroring %d", counts[i]);
		samples_print(&mirroring[i], name);
		printf(", ");
		snprintf(name, sizeof(name), "taking %d", counts[i]);
		samples_print(&taking[i], name);
		printf(", ");
	}
	printf("\"reads\": [%llu, %llu, %llu, %llu]}\n", (unsigned long long)shared->reads[0],
	       (unsigned long long)shared->reads[1], (unsigned long long)shared->reads[2],
	       (unsigned long long)shared->reads[3]);
	return good ? 0 : 1;
}
