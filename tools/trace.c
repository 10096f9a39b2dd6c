// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl trace: watch the realtime thread for some seconds, then tell of its
 * slowest cycles where their time went.
 *
 * The daemon is not touched: what it knows of its cycles is read from the
 * recorder's ring, and the kernel's tracepoints cost the watched core a few hundred
 * nanoseconds for each switch and interrupt, no more.
 */
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include "daemon/recorder/read.h"
#include "tools/pokeysctl.h"
#include "tools/ring.h"
#include "tools/trace_collect.h"
#include "tools/view.h"

#define LATE_NS UINT64_C(200000000)	/* after so long everything of a moment has come */
#define JUDGE_NS UINT64_C(500000000)

enum { POLL_MS = 20, CHUNK = 512, FIRST_MS = 20 };

static _Atomic bool stopped;

static void stop(int number)
{
	(void)number;
	atomic_store(&stopped, true);
}

/* Of a daemon whose cycles can be watched. */
static bool runs(const struct recorder_file *ring, const struct options *options)
{
	if (recorder_lives(ring))
		return true;
	complain("%s: the daemon's realtime thread does not run", options->runtime_directory);
	return false;
}

static void take_slots(const struct recorder_file *ring, uint64_t *next, struct collect *collect)
{
	static struct recorder_slot slot[CHUNK];
	size_t n;

	while ((n = recorder_read(ring, next, slot, CHUNK)))
		for (size_t i = 0; i < n; i++)
			collect_slot(collect, &slot[i]);
}

/* Until `end_ns`, ^C, or the daemon's end. Returns when that was. */
static uint64_t watch(const struct recorder_file *ring, struct collect *collect, uint64_t end_ns,
		      struct trace_report *report)
{
	uint64_t next = recorder_written(ring), judge_ns = 0;

	for (uint64_t now = view_now(); now < end_ns + LATE_NS; now = view_now()) {
		report->dropped = trace_kernel_poll(POLL_MS);
		take_slots(ring, &next, collect);
		if (now >= judge_ns) {
			collect_judge(collect, now - LATE_NS);
			judge_ns = now + JUDGE_NS;
			report->died |= now < end_ns && !recorder_lives(ring);
		}
		if ((atomic_load(&stopped) || report->died) && now < end_ns)
			end_ns = now;
	}
	collect_judge(collect, end_ns);
	return end_ns;
}

/* What it was that nothing, or not all of it, was seen. */
static void explain(const struct trace_report *report)
{
	if (report->died)
		complain("the daemon ended after %.1f s", report->seconds);
	else if (!report->cycles && atomic_load(&stopped))
		complain("ended before the first cycle was seen");
	else if (!report->cycles)
		complain("the daemon has done no cycle meanwhile");
}

static int trace(const struct options *options, const struct recorder_file *ring)
{
	static struct collect collect;
	struct trace_report report = { .period_ns = ring->head.period_ns };
	char why[256];
	uint64_t end_ns;
	int status;

	collect.spins = ring->head.spins;
	collect.wanted = options->slowest;
	collect.threshold_ns = (uint64_t)(options->threshold_us * 1e3);
	if (collect_begin(&collect)) {
		collect_end(&collect);
		complain("no memory");
		return STATUS_FAILED;
	}
	status = trace_kernel_begin(ring->head.thread, collect_event, &collect, why, sizeof(why));
	if (status) {
		collect_end(&collect);
		complain("%s", why);
		return status;
	}
	/* the kernel's side wants to see the thread switch before it knows anything */
	collect.begin_ns = view_now() + FIRST_MS * UINT64_C(1000000);
	end_ns = watch(ring, &collect, collect.begin_ns + (uint64_t)(options->seconds * 1e9),
		       &report);
	if (end_ns > collect.begin_ns) /* ^C may come before it has begun */
		report.seconds = (double)(end_ns - collect.begin_ns) / 1e9;
	trace_kernel_end();
	collect_report(&collect, &report);
	(options->json ? trace_print_json : trace_print)(&report, stdout);
	explain(&report);
	collect_end(&collect);
	return report.cycles ? STATUS_OK : STATUS_FAILED;
}

int command_trace(const struct options *options)
{
	struct sigaction action = { .sa_handler = stop };
	struct recorder_file ring;
	int status = STATUS_FAILED;

	if (ring_open(options, &ring))
		return STATUS_FAILED;
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	if (runs(&ring, options))
		status = trace(options, &ring);
	recorder_release(&ring);
	return status;
}
