/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A duration into its bucket, in a few instructions and without a logarithm.
 *
 * The position of the highest bit gives the octave, and the two bits below it
 * the quarter. That makes the quarters equally wide within an octave instead
 * of equally wide in the logarithm, which no reader of a percentile can tell,
 * and it makes the lower bound of every bucket exact in integers.
 */

#include "daemon/device/histogram.h"

enum { LOWEST_OCTAVE = 6 };	/* 2^6 = 64 ns */

unsigned int histogram_bucket(uint64_t ns)
{
	unsigned int octave, bucket;

	if (ns < UINT64_C(1) << LOWEST_OCTAVE)
		return 0;
	octave = 63u - (unsigned int)__builtin_clzll(ns);
	bucket = (octave - LOWEST_OCTAVE) * 4 + (unsigned int)(ns >> (octave - 2) & 3);
	return bucket < POKEYS_HISTOGRAM_BUCKETS ? bucket : POKEYS_HISTOGRAM_BUCKETS - 1;
}

void histogram_add(struct pokeys_histogram *histogram, uint64_t ns)
{
	if (!histogram->count || ns < histogram->min_ns)
		histogram->min_ns = ns;
	if (ns > histogram->max_ns)
		histogram->max_ns = ns;
	histogram->count++;
	histogram->sum_ns += ns;
	histogram->bucket[histogram_bucket(ns)]++;
}
