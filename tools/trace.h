/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysctl trace: where the time of a slow cycle went.
 *
 * Two witnesses with one clock: the kernel's scheduler and interrupts, and what the
 * daemon's recorder has of its cycles and packets. They meet in a line of marks.
 */
#ifndef TOOLS_TRACE_H
#define TOOLS_TRACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include "tools/trace_event.h"

enum trace_where {
	TRACE_TIMER, /* the tick has come, the timer has not */
	TRACE_INTERRUPT,
	TRACE_SOFTIRQ,
	TRACE_WAKE_UP, /* runnable, and nobody else runs on the core */
	TRACE_BEHIND,  /* runnable, but somebody else runs there */
	TRACE_PLAN,    /* from wishes and commands to requests */
	TRACE_SEND,    /* requests into the kernel */
	TRACE_DEVICE,  /* network and device, until the kernel has the reply */
	TRACE_RECEIVE, /* from the kernel to waking the thread */
	TRACE_RUN,     /* replies decoded, images published, all else */
	TRACE_WHERES
};

enum { TRACE_REQUESTS = 16 * 256 }; /* devices of the recorder, ids */

enum trace_mark_kind {
	MARK_KERNEL, /* `event` says what */
	MARK_SENT,   /* a request was queued */
	MARK_GOT,    /* the kernel has taken a good reply in */
};

struct trace_mark {
	uint64_t t_ns;
	uint64_t order;   /* of those with one time */
	uint32_t request; /* sent, got: device * 256 + id */
	enum trace_mark_kind kind;
	struct trace_event event;
};

enum { TRACE_PARTS = 24 };

/* Time that is somebody's: an interrupt's, a softirq's, another thread's. */
struct trace_part {
	enum trace_where where;
	char who[16];
	uint64_t ns;
};

struct trace_cycle {
	/* from the recorder */
	uint64_t cycle;
	uint64_t tick_ns, woke_ns, asked_ns, published_ns;
	uint32_t skipped;
	bool spins; /* the thread polls instead of sleeping */
	/* by trace_attribute() */
	uint64_t ns[TRACE_WHERES]; /* their sum is published_ns - tick_ns */
	struct trace_part part[TRACE_PARTS];
	size_t parts;
	bool whole; /* the kernel's witness was there all the time */
};

static inline uint64_t trace_length(const struct trace_cycle *cycle)
{
	return cycle->published_ns - cycle->tick_ns;
}

/*
 * Where the time from the tick to the last image went. `mark`s in the order of time,
 * beginning some while before the tick, so that it is known how things stood then. Pure.
 */
void trace_attribute(struct trace_cycle *cycle, const struct trace_mark *mark, size_t marks);

/* A word for each: "wake-up". */
const char *trace_where_name(enum trace_where where);

/* For a person; for a script (the whole document). */
struct trace_report {
	double seconds;
	bool died; /* the daemon, before the time was over */
	uint64_t period_ns, cycles, dropped;
	uint64_t median_ns, p99_ns, max_ns; /* tick to data, of all cycles */
	const struct trace_cycle *cycle;    /* the slowest, slowest first */
	size_t count;
};

void trace_print(const struct trace_report *report, FILE *to);
void trace_print_json(const struct trace_report *report, FILE *to);

/* What the kernel has to say. */

enum { TRACE_UNAVAILABLE = 69, TRACE_NO_RIGHT = 77 }; /* exit statuses, sysexits(3) */

/* Each event, in the order of time of each core. */
typedef void (*trace_take)(void *context, const struct trace_event *event);

/*
 * Begin to watch a thread, by its number as /proc has it here. 0, or an exit status
 * (TRACE_UNAVAILABLE, TRACE_NO_RIGHT) with one line in `why`.
 */
int trace_kernel_begin(int thread, trace_take take, void *context, char *why, size_t size);

/* Wait for so long, then take what has come. The events that were lost so far. */
uint64_t trace_kernel_poll(int timeout_ms);
void trace_kernel_end(void);

#endif
