/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Velocity of an encoder from counts and the times they were sampled.
 */
#ifndef HALBRIDGE_VELOCITY_H
#define HALBRIDGE_VELOCITY_H

#include <stdbool.h>
#include <stdint.h>

enum {
	VELOCITY_STEPS = 16,
	/* the steps lie in a row, and begin anew at the front when it is full */
	VELOCITY_ROOM = 32,
};

#define VELOCITY_GAP_NS	UINT64_C(100000000)	/* no sample for longer: what was is unknown */

/*
 * Between two samples the count changed: where and when, as exactly as one can know. A
 * step of one count has an exact position and an uncertain time, one of several the
 * other way round. Nanoseconds as double: after a hundred days they are 2 ns coarse.
 */
struct velocity_steps {
	double position[VELOCITY_ROOM]; /* counts: the middle between before and after */
	double t_ns[VELOCITY_ROOM];     /* the middle between the two samples */
	double doubt[VELOCITY_ROOM];    /* the position is right to +- so many counts */
	double doubt_ns[VELOCITY_ROOM]; /* and the time to +- so many */
};

struct velocity {
	bool started;
	uint32_t newest, used; /* place of the newest step; how many there are */
	int64_t count;         /* at the last sample */
	uint64_t t_ns;
	uint64_t quiet_ns; /* certainly no step since then */
	double slope;      /* counts per second, from the steps */
	double rate;       /* and bounded by the silence since the last one */
	struct velocity_steps step;
};

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
 * True if a sample of the same count, within VELOCITY_GAP_NS, changes nothing but t_ns,
 * as with an encoder that stands: most do, most of the time. Realtime.
 */
static inline bool velocity_rests(const struct velocity *v, int64_t count, uint64_t t_ns)
{
	return v->started && v->slope == 0 && v->rate == 0 && v->count == count && v->t_ns == t_ns;
}

#endif
