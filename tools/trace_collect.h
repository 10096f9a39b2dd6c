/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Marks and cycles, as they come, and the slowest of them. No thread but one. */
#ifndef TOOLS_TRACE_COLLECT_H
#define TOOLS_TRACE_COLLECT_H

#include "daemon/recorder/ring.h"
#include "tools/trace.h"

enum { COLLECT_SLOWEST = 100, COLLECT_MARKS = 1 << 18, COLLECT_CYCLES = 1 << 14 };

struct collect {
	/* set before */
	bool spins;
	size_t wanted;         /* slowest to keep, at most COLLECT_SLOWEST */
	uint64_t threshold_ns; /* shorter ones are not kept */
	uint64_t begin_ns;     /* cycles that began before are not judged */
	/* the rest is its own */
	struct trace_mark *mark; /* of the latest while */
	size_t marks;
	struct trace_cycle *waiting; /* until all marks of their time are there */
	size_t waitings;
	uint64_t order, lost;
	struct trace_cycle slowest[COLLECT_SLOWEST]; /* slowest first */
	size_t count;
	uint64_t *length; /* of each cycle, for the median */
	size_t lengths, room;
};

/* 0 or -ENOMEM. */
int collect_begin(struct collect *collect);
void collect_end(struct collect *collect);

/* As a trace_take, and a slot of the recorder. */
void collect_event(void *collect, const struct trace_event *event);
void collect_slot(struct collect *collect, const struct recorder_slot *slot);

/* Judge all cycles that ended before `until_ns`; all that happened until then is there. */
void collect_judge(struct collect *collect, uint64_t until_ns);

/* What came of it: fills count, cycles, median_ns, p99_ns, max_ns, dropped and cycle. */
void collect_report(struct collect *collect, struct trace_report *report);

#endif
