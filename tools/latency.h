/* SPDX-License-Identifier: GPL-2.0-or-later */
/* pokeysctl latency: how late threads wake up, on several cores and in the daemon. */
#ifndef TOOLS_LATENCY_H
#define TOOLS_LATENCY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <pokeys/state.h>
#include "tools/view.h"

enum { LATENCY_SERIES = 3, LATENCY_PARTS = 16 };

/* One thread that wakes up each period, or the daemon's. */
struct latency_series {
	char title[40];
	int cpu; /* -1 = any, or not known */
	struct pokeys_histogram histogram;
};

/* What else the daemon has measured in the same seconds. */
struct latency_part {
	const char *key, *title;
	struct pokeys_histogram histogram;
};

struct latency_run {
	char kernel[96];
	int is_virtual; /* 1 yes, 0 no sign of it, -1 not known */
	int priority;   /* SCHED_FIFO, 0 = not realtime */
	double seconds;
	uint64_t period_ns;
	uint64_t phase_ns; /* ticks lie at this + n * period, CLOCK_MONOTONIC */
	char note[288];    /* what to know when reading it; empty */
	size_t count;
	struct latency_series series[LATENCY_SERIES];
	size_t parts;
	struct latency_part part[LATENCY_PARTS];
};

/*
 * Wake up threads on the cores of the first `count` series, all at once, for
 * run->seconds; ^C ends it early. Blocks. 0, or -errno with one line in `why`:
 * -EPERM no right to the priority or to locked memory, -EINVAL no such core.
 */
int latency_measure(struct latency_run *run, size_t count, char *why, size_t size);

/*
 * A device of the daemon in this folder with histograms from after this call, or NULL
 * with what is missing in `why`, one line. Any sign of a daemon is waited for, up to 5 s.
 * `view` is all zero at first, and to be closed.
 */
const struct view_device *latency_daemon(struct view *view, const char *runtime_directory,
					 char *why, size_t size);

/* What was added to a histogram between two readings. Pure. */
void latency_since(const struct pokeys_histogram *before, const struct pokeys_histogram *after,
		   struct pokeys_histogram *out);

/* Side by side, for a person; for a script; as a picture. */
void latency_print(const struct latency_run *run, FILE *to);
void latency_print_json(const struct latency_run *run, FILE *to);
void latency_plot(const struct latency_run *run, FILE *to);

#endif
