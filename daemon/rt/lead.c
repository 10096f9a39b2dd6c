/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a cycle costs is known as a distribution with a long tail, and what is wanted
 * of it is a point far out: the time within which all but a few cycles in a thousand
 * have published. An average with a multiple of the deviation added guesses the tail;
 * here it is counted.
 *
 * Two halves of LEAD_SAMPLES are kept, the one that is filled and the full one before:
 * nothing is ever scaled down, which would lose the tail first, and a machine that
 * has become faster or slower is known in a few seconds. The walk over the buckets
 * is done for every 32nd sample only.
 */
#include <stdbool.h>
#include <string.h>
#include "daemon/rt/lead.h"

enum { WALK_EVERY = 32, LATE_IN = 200 }; /* one cycle in 200 may be later */

void lead_init(struct lead *lead, uint64_t range_ns)
{
	memset(lead, 0, sizeof(*lead));
	lead->width_ns = range_ns / LEAD_BUCKETS ? range_ns / LEAD_BUCKETS : 1;
	lead->value_ns = range_ns / 4;
}

/* The upper end of the bucket with the sample that all but 1 in LATE_IN do not exceed. */
static uint64_t quantile(const struct lead *lead)
{
	uint32_t above = (lead->count + lead->count_before) / LATE_IN, seen = 0;
	unsigned int i = LEAD_BUCKETS;

	while (i > 1) {
		seen += (uint32_t)lead->bucket[0][i - 1] + lead->bucket[1][i - 1];
		if (seen > above)
			break;
		i--;
	}
	return i * lead->width_ns;
}

void lead_add(struct lead *lead, int64_t ns)
{
	uint64_t i = ns > 0 ? (uint64_t)ns / lead->width_ns : 0;

	lead->bucket[lead->half][i < LEAD_BUCKETS ? i : LEAD_BUCKETS - 1]++;
	if (++lead->count % WALK_EVERY == 0)
		lead->value_ns = quantile(lead);
	if (lead->count < LEAD_SAMPLES)
		return;
	lead->half ^= 1;
	lead->count_before = lead->count;
	lead->count = 0;
	memset(lead->bucket[lead->half], 0, sizeof(lead->bucket[0]));
}
