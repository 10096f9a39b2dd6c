/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Looks for devices by their serial numbers while the loop misses one. */
#ifndef CONTROL_FINDER_H
#define CONTROL_FINDER_H

#include <pthread.h>
#include <stdatomic.h>
#include "daemon/control/config.h"
#include "daemon/rt/loop.h"

struct finder {
	const struct config *config;
	const struct loop_shared *shared;
	/* interface << 48 | ip << 16 | port (struct transport_address), 0 = not yet */
	_Atomic uint64_t found[TRANSPORT_CHANNELS];
	_Atomic bool stop;
	_Atomic int result;		/* of the last search: answers, or -errno */
	bool running;
	uint32_t routed;		/* finder thread's: see finder_take() */
	int told;			/* control thread's: what it has logged */
	pthread_t thread;
};

/* Start the thread if any device is to be found by its serial number. 0 or -errno. */
int finder_start(struct finder *finder, const struct config *config,
		 const struct loop_shared *shared);

/* Log what the searches came to, when it changes. Control thread. */
void finder_report(struct finder *finder);

/* End the thread; takes at most as long as one search. Idempotent. */
void finder_stop(struct finder *finder);

/*
 * One answer to a search: where every device is that has its serial number and is looked for.
 * `routed` are those that have answered the way that their route has, in this search: no
 * interface has to be named for them, though they answer at others, too.
 */
void finder_take(const struct config *config, const struct loop_shared *shared,
		 _Atomic uint64_t found[TRANSPORT_CHANNELS], uint32_t *routed,
		 const uint8_t *data, size_t length, const struct transport_address *from);

#endif
