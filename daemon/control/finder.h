/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Looks for devices by their serial numbers while the loop misses one. */
#ifndef CONTROL_FINDER_H
#define CONTROL_FINDER_H

#include <pthread.h>
#include <stdatomic.h>
#include "daemon/control/tell.h"
#include "daemon/rt/loop.h"
#include "daemon/transport/discovery.h"

enum { FINDER_OTHERS = 4, FINDER_WHY = POKEYS_EVENT_TEXT_MAX };

/* Who has answered one search. */
struct finder_answers {
	uint64_t routed; /* bit = device; the way that its route has */
	uint64_t ours;   /* bit = device */
	unsigned int others;
	uint32_t other[FINDER_OTHERS]; /* the lowest serial numbers, in order */
	bool more_others;              /* than these */
};

struct finder {
	const struct teller *teller;
	const struct loop_shared *shared;
	/* interface << 48 | ip << 16 | port (struct transport_address), 0 = not yet */
	_Atomic uint64_t found[TRANSPORT_CHANNELS];
	_Atomic bool stop;
	_Atomic int result; /* of the last search: answers, or -errno */
	bool running;
	struct finder_answers answers; /* finder thread's */
	struct discovery_report report;
	unsigned int misses;  /* searches in a row that have not found all */
	pthread_mutex_t lock; /* of why */
	char why[FINDER_WHY]; /* they have not, "" = they have */
	int told;             /* control thread's: what it has logged */
	char told_why[FINDER_WHY];
	uint64_t minute_ns; /* the first line of this minute, 0 = never */
	unsigned int minute_lines;
	pthread_t thread;
};

/* Start the thread if any device is to be found by its serial number. 0 or -errno. */
int finder_start(struct finder *finder, const struct teller *teller,
		 const struct loop_shared *shared);

/* Tell what the searches came to, when it changes. now_ns: CLOCK_MONOTONIC. Control thread. */
void finder_report(struct finder *finder, uint64_t now_ns);

/* End the thread; takes at most as long as one search. Idempotent. */
void finder_stop(struct finder *finder);

/*
 * One answer to a search: where every device is that has its serial number and is looked for.
 * For those in `answers->routed` no interface has to be named, though they answer at others, too.
 */
void finder_take(const struct config *config, const struct loop_shared *shared,
		 _Atomic uint64_t found[TRANSPORT_CHANNELS], struct finder_answers *answers,
		 const uint8_t *data, size_t length, const struct transport_address *from);

/*
 * One line on a search that has not found the devices `missing` (bits): where it asked, who has
 * answered instead, and what to do.
 */
void finder_why(const struct config *config, uint64_t missing, const struct finder_answers *answers,
		const struct discovery_report *report, char text[FINDER_WHY]);

#endif
