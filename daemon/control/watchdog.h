/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Tells the service manager that the daemon lives. */
#ifndef CONTROL_WATCHDOG_H
#define CONTROL_WATCHDOG_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

struct watchdog {
	uint64_t interval_ns; /* 0 = nobody watches */
	uint64_t next_ns;
	uint64_t seen; /* cycles at the last look */
	const _Atomic uint64_t *cycles;
	_Atomic bool stop;
	bool running;
	pthread_t thread;
};

/* `limit_ns`: silent for longer, and the service manager acts; 0 = it does not. */
void watchdog_init(struct watchdog *watchdog, uint64_t limit_ns, uint64_t cycles, uint64_t now_ns);

/* True = give a sign of life now. Call often, but not twice within a cycle. */
bool watchdog_due(struct watchdog *watchdog, uint64_t cycles, uint64_t now_ns);

/*
 * Watch over `cycles`, which the realtime thread counts up, in a thread of its own until
 * watchdog_stop(). Without a service manager that watches there is none. 0 or -errno. The
 * control thread.
 */
int watchdog_start(struct watchdog *watchdog, uint64_t limit_ns, const _Atomic uint64_t *cycles);
void watchdog_stop(struct watchdog *watchdog);

#endif
