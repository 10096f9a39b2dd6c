/* SPDX-License-Identifier: GPL-2.0-or-later */
/* How long before a read the cycle has to begin: a quantile of the recent past. See lead.c. */
#ifndef RT_LEAD_H
#define RT_LEAD_H

#include <stdint.h>

enum { LEAD_BUCKETS = 256, LEAD_SAMPLES = 2048 };

struct lead {
	uint64_t width_ns;            /* of a bucket */
	uint32_t count, count_before; /* samples in this half and in the one before */
	uint64_t value_ns;            /* the quantile, as it was computed last */
	uint16_t bucket[2][LEAD_BUCKETS];
	uint8_t half; /* which one is being filled */
};

/* Nothing is known; samples up to `range_ns` are told apart. Any thread. */
void lead_init(struct lead *lead, uint64_t range_ns);

/* One sample, ns; below 0 counts as 0. Realtime. */
void lead_add(struct lead *lead, int64_t ns);

#endif
