/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The realtime side as a program that a script can question, for those tests
 * that look at it from outside, and for measuring.
 *
 *	probe SIMULATOR TRANSPORT sleep|spin PERIOD_US
 *
 * It says "thread N" when the device runs, and after that answers each line
 * on its standard input with one line of counters and percentiles; "reset"
 * begins the percentiles anew. At the end of its input it ends.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/rt/internal.h"
#include "tests/rt/rig.h"

static double us(const struct pokeys_histogram *h, double p)
{
	return (double)pokeys_histogram_percentile(h, p) / 1e3;
}

/* What `now` has more than `before`. */
static struct pokeys_histogram since(const struct pokeys_histogram *now,
				     const struct pokeys_histogram *before)
{
	struct pokeys_histogram h = *now;

	h.count -= before->count;
	h.sum_ns -= before->sum_ns;
	for (int i = 0; i < POKEYS_HISTOGRAM_BUCKETS; i++)
		h.bucket[i] -= before->bucket[i];
	return h;
}

static void put(const char *name, const struct pokeys_histogram *now,
		const struct pokeys_histogram *before)
{
	const struct pokeys_histogram h = since(now, before);

	printf(" %s_us_p50=%.1f %s_us_p99=%.1f", name, us(&h, 0.5), name, us(&h, 0.99));
	printf(" %s_us_mean=%.1f", name, h.count ? (double)h.sum_ns / (double)h.count / 1e3 : 0.0);
}

static void report(struct rig *rig, const struct pokeys_diag *before)
{
	const struct transport_statistics *t = &rig->loop.transport->statistics;
	struct pokeys_state s;
	struct pokeys_diag d;

	rig_state(rig, &s);
	rig_diag(rig, &d);
	printf("cycles=%" PRIu64 " skipped=%" PRIu64 " calls=%" PRIu64 " received=%" PRIu64
	       " resent=%" PRIu64 " avoided=%" PRIu64 " realtime=%d",
	       atomic_load(&rig->loop.shared.cycles), atomic_load(&rig->loop.shared.skipped),
	       t->system_calls + rig->loop.own->sleeps, t->received, s.statistics.resent,
	       t->waits_avoided, rig->is_realtime);
	put("wakeup", &d.wakeup, &before->wakeup);
	put("round_trip", &d.fast_round_trip, &before->fast_round_trip);
	put("fresh", &d.fresh, &before->fresh);
	put("work", &d.cycle_work, &before->cycle_work);
	put("publish", &d.publish, &before->publish);
	printf("\n");
	fflush(stdout);
}

static int serve(struct rig *rig)
{
	struct pokeys_diag before = { 0 };
	char line[64];

	if (rig_run(rig) < 0 || !rig_await_link(rig, POKEYS_LINK_RUNNING))
		return EXIT_FAILURE;
	printf("thread %d\n", atomic_load(&rig->loop.shared.thread));
	fflush(stdout);
	while (fgets(line, sizeof line, stdin)) {
		if (!strcmp(line, "reset\n"))
			rig_diag(rig, &before);
		report(rig, &before);
	}
	return EXIT_SUCCESS;
}

int main(int argc, char **argv)
{
	struct rig_options options = { .realtime = true, .deadline_floor_ns = 20000000 };
	static struct rig rig;
	int status = EXIT_FAILURE;

	if (argc != 5) {
		fprintf(stderr, "usage: probe SIMULATOR TRANSPORT sleep|spin PERIOD_US\n");
		return 2;
	}
	options.simulator = argv[1];
	options.transport = argv[2];
	options.mode = strcmp(argv[3], "spin") ? LOOP_SLEEP : LOOP_SPIN;
	options.period_ns = strtoull(argv[4], NULL, 10) * 1000;
	if (rig_start(&rig, &options) == 0)
		status = serve(&rig);
	rig_stop(&rig);
	return status;
}
