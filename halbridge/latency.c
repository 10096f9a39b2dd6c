/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Of a hundred bars of a histogram a person asks two things: what holds nearly
 * always, and what was the worst. Both stand here since the daemon's start, in
 * the module's own thread, for percentiles are a walk over all bars and the
 * daemon publishes ten times a second at most.
 */
#include "halbridge/latency.h"

#define NEARLY_ALWAYS	0.99

static void fill(struct value_latency *value, const struct pokeys_histogram *histogram)
{
	value->p99_us = (double)pokeys_histogram_percentile(histogram, NEARLY_ALWAYS) / 1e3;
	value->max_us = (double)histogram->max_ns / 1e3;
}

void latency_round(struct values *values, pokeys_client *client, struct pokeys_diag *diag)
{
	struct value_diagnostics *value = &values->diagnostics;

	if (pokeys_client_read_diag(client, diag))
		return;
	fill(&value->wakeup, &diag->wakeup);
	fill(&value->round_trip, &diag->round_trip);
	fill(&value->data, &diag->fresh);
	fill(&value->age, &diag->age_at_read);
	value->cycles_skipped = (uint32_t)diag->cycles_skipped;
}
