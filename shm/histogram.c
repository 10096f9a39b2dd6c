/* SPDX-License-Identifier: MIT */
/*
 * Histograms of durations: quarter octaves from 64 ns up.
 *
 * Buckets of constant relative width say as much about 300 ns as about 3 ms,
 * and finding the bucket is a count of leading zeros and two bits behind the
 * first: no division and no table in the realtime thread. Bucket 0 is [0, 64),
 * then four to each octave: [64, 80), [80, 96), [96, 112), [112, 128), ...
 */
#include <pokeys/shm.h>

enum { FIRST_BIT = 6 }; /* 64 ns */

#define ROUNDING 1e-12		/* 0.07 * 100 is a little more than 7 */

unsigned int pokeys_histogram_bucket(uint64_t ns)
{
	return pokeys_duration_bucket(ns);
}

uint64_t pokeys_histogram_lower(unsigned int bucket)
{
	unsigned int top;

	if (!bucket)
		return 0;
	if (bucket >= POKEYS_HISTOGRAM_BUCKETS)
		bucket = POKEYS_HISTOGRAM_BUCKETS - 1;
	top = FIRST_BIT + (bucket - 1) / 4;
	return (UINT64_C(4) + (bucket - 1) % 4) << (top - 2);
}

uint64_t pokeys_histogram_percentile(const struct pokeys_histogram *histogram, double p)
{
	uint64_t wanted, below = 0;
	unsigned int i;

	if (!histogram->count)
		return 0;
	if (!(p > 0))
		return histogram->min_ns;
	if (p >= 1)
		return histogram->max_ns;
	/* never fewer than that part: of 501 the worst one is beyond p99.8 and not below p99.9 */
	wanted = (uint64_t)((double)histogram->count * p * (1 - ROUNDING));
	wanted++;
	for (i = 0; i < POKEYS_HISTOGRAM_BUCKETS - 1; i++) {
		below += histogram->bucket[i];
		if (below >= wanted)
			break;
	}
	if (i == POKEYS_HISTOGRAM_BUCKETS - 1)
		return histogram->max_ns;
	below = pokeys_histogram_lower(i + 1);
	return below < histogram->max_ns ? below : histogram->max_ns;
}
