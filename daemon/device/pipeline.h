/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How many requests of a kind may be under way at once. Part of struct device; the
 * functions are in internal.h.
 */
#ifndef DEVICE_PIPELINE_H
#define DEVICE_PIPELINE_H

#include <stdbool.h>
#include <stdint.h>

/* Round trips, as a mean over the last ones. */
struct pipeline_mean {
	uint32_t samples;
	uint64_t ns;
	uint64_t off_ns;		/* how far samples are from it */
};

struct pipeline {
	uint32_t depth;
	bool trying;			/* two 0xCC, while everything else has depth 1 */
	bool doubted;			/* the last comparison showed a queue */
	uint64_t since_ns;		/* since then it is 1, or more */
	uint64_t hold_ns;		/* 1 for so long at least */
	struct pipeline_mean alone;	/* of requests that had none of their kind before them */
	struct pipeline_mean behind;	/* ... that had */
};

#endif
