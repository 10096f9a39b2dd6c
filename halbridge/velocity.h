/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Velocity of an encoder from counts and the times they were sampled.
 */
#ifndef HALBRIDGE_VELOCITY_H
#define HALBRIDGE_VELOCITY_H

#include <stdbool.h>
#include <stdint.h>

enum { VELOCITY_STEPS = 16 };

#define VELOCITY_GAP_NS	UINT64_C(100000000)	/* no sample for longer: what was is unknown */

/* Between two samples the count changed: where and when, as exactly as one can know. */
struct velocity_step {
	int64_t twice_position;		/* half counts: the middle between before and after */
	uint64_t t_ns;			/* the middle between the two samples */
	double half_ns;			/* it happened within +- this */
	bool single;			/* one count: the position is exact, the time is not */
};

struct velocity {
	bool started;
	uint32_t newest, used;
	int64_t count;			/* at the last sample */
	uint64_t t_ns;
	uint64_t quiet_ns;		/* certainly no step since then */
	double slope;			/* counts per second, from the steps */
	double rate;			/* and bounded by the silence since the last one */
	struct velocity_step step[VELOCITY_STEPS];
};

/* Forget everything; the rate is 0. */
void velocity_reset(struct velocity *v);

/*
 * The count jumped without motion (index, device reboot): the history goes,
 * the rate stays until the next counts say otherwise.
 */
void velocity_rebase(struct velocity *v, int64_t count, uint64_t t_ns);

/*
 * One sample: `count` (continuous, not wrapping) at `t_ns`. A sample not newer
 * than the last one is ignored. Returns counts per second, always finite.
 * Realtime.
 */
double velocity_sample(struct velocity *v, int64_t count, uint64_t t_ns);

/*
 * True if the sample changes nothing, as it does for an encoder that stands:
 * most do, most of the time. It is remembered as velocity_sample() would.
 */
static inline bool velocity_stands(struct velocity *v, int64_t count, uint64_t t_ns)
{
	if (count != v->count || v->slope != 0 || v->rate != 0 || !v->started ||
	    t_ns <= v->t_ns || t_ns - v->t_ns > VELOCITY_GAP_NS)
		return false;
	v->t_ns = t_ns;
	return true;
}

#endif
