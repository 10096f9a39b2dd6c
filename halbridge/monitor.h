/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The module's own thread: finds a device that was not named, and says what
 * the servo thread may not say.
 */
#ifndef HALBRIDGE_MONITOR_H
#define HALBRIDGE_MONITOR_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include "halbridge/callers.h"
#include "halbridge/instance.h"
#include "halbridge/table.h"

enum { MONITOR_LINE = 512 };

struct monitor_memory {
	char seen[MONITOR_LINE]; /* how attaching stood at the last round */
	char said[MONITOR_LINE]; /* and what was said about it last */
	unsigned int rounds;     /* for so many it has stood like that */
	bool was_connected;
	unsigned int quiet;  /* rounds in which a lost connection is not said again */
	unsigned int credit; /* refusals that may still be printed */
	struct callers callers;
	uint32_t exceeded;       /* periods that took too long, when that was said last */
	unsigned int slow_quiet; /* rounds in which that is not said again */
};

struct monitor {
	const char *runtime; /* NULL = the default */
	struct instance *const *instances;
	size_t count;
	pthread_t thread;
	pthread_mutex_t lock;
	pthread_cond_t wake;
	bool running, stop;
	struct monitor_memory memory[TABLE_DEVICES];
};

/*
 * Open a client for the instance's device and let the library follow the
 * daemon. 0, -EINVAL (device name or runtime folder), -errno. Cold.
 */
int monitor_open_client(struct instance *instance, const char *runtime);

/* Start the thread; runtime, instances and count are set. 0 or -errno. Cold. */
int monitor_start(struct monitor *monitor);

/* End and join it. Cold; nothing happens if it does not run. */
void monitor_stop(struct monitor *monitor);

#endif
