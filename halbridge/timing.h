/* SPDX-License-Identifier: GPL-2.0-or-later */
/* How long the two functs take of the servo thread's time. */
#ifndef HALBRIDGE_TIMING_H
#define HALBRIDGE_TIMING_H

#include <stdatomic.h>
#include <stdint.h>
#include "halbridge/values.h"

struct timing {
	uint64_t read_ns;         /* of a read whose write has not come yet; 0 = none */
	_Atomic uint32_t last_us; /* of the last period above the threshold */
};

/*
 * A read, or a write, has taken so long: the longest goes to read-time-max and
 * write-time-max, and a period in which both together took longer than time-threshold
 * is counted in time-exceeded-count. Pure. Realtime.
 */
void timing_read(struct timing *timing, struct values *values, uint64_t took_ns);
void timing_write(struct timing *timing, struct values *values, uint64_t took_ns);

#endif
