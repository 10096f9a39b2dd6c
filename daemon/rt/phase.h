/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The phase lock: arithmetic that lays the daemon's ticks before a commander's reads.
 * Pure, all times CLOCK_MONOTONIC ns. Realtime but for phase_init(). See phase.c.
 */
#ifndef RT_PHASE_H
#define RT_PHASE_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/rt/lead.h"

/* What a commander says of its thread. */
struct phase_stamp {
	uint64_t read_ns;  /* it has read the state */
	uint64_t write_ns; /* ... and written its command, not before that */
	uint64_t period_ns;
};

struct phase {
	uint64_t nominal_ns; /* the cycle, of pokeysd.conf */
	bool locked;
	uint32_t losses;    /* times it was lost */
	int32_t error_ns;   /* last read: how much later than the cycle was laid for */
	double jitter_ns;   /* of the reads, mean deviation from what was expected */
	uint64_t period_ns; /* from the tick before to the next one */

	uint64_t thread_ns;   /* the commander's period, as it says; 0 = none yet */
	double drift_ns;      /* ... and how much longer it is */
	double ratio;         /* of a cycle to that period: n or 1 / n */
	uint64_t read_ns;     /* the last read */
	uint64_t expected_ns; /* when it should have been */
	uint64_t write_ns;    /* from that read to the command that came of it */
	int32_t quality;      /* rises with reads that come as expected */
	struct lead lead;
};

/* For cycles of `nominal_ns`. */
void phase_init(struct phase *phase, uint64_t nominal_ns);

/* Can a cycle be laid before the reads of a thread of that period, within 1 %? */
bool phase_fits(const struct phase *phase, uint64_t thread_ns);

/* Nobody is followed: the next cycle is as pokeysd.conf says. */
void phase_free(struct phase *phase);

/*
 * The commander has read, and its period fits. Another period than before, or a long
 * silence, begins anew. The last tick before that was at `tick_ns`, and that cycle's
 * data were published `cost_ns` after it (0 = not known).
 */
void phase_read(struct phase *phase, const struct phase_stamp *stamp, uint64_t tick_ns,
		uint64_t cost_ns);

/* From the tick to the read it is laid for. */
uint64_t phase_lead(const struct phase *phase);

/*
 * Length of the cycle that began at `tick_ns`: never more than 2 % off the nominal
 * one. Once for each cycle.
 */
uint64_t phase_next(struct phase *phase, uint64_t tick_ns);

#endif
