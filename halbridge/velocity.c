/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Velocity from steps, not from differences per period.
 *
 * The difference of two counts divided by the period is useless at low speed:
 * at 100 counts/s and a 1 ms period it reads 0, 0, … 1000, 0, 0. What is
 * known well is *when the count changed*: at such a step of one count the
 * encoder stood exactly on the edge between the two, within the time between
 * two samples. So the last steps are kept, and the velocity is the slope from
 * the newest step back to the oldest one that a constant velocity can still
 * explain, given what is uncertain: the time of a step (half the distance of
 * its samples), the position inside a jump of several counts (half a count),
 * and the jitter of the time stamps. Steady motion thus is averaged over up
 * to 16 steps, a change of speed shortens the window by itself (first-order
 * adaptive windowing).
 *
 * Between steps the rate is bounded by what the silence proves: no step for a
 * time T means less than one count in T, in either direction. After half a
 * second the encoder stands. An encoder that dithers on an edge steps up and
 * down at the same place: slope 0.
 */
#include "halbridge/velocity.h"
#include <math.h>
#include <string.h>

#define STANDSTILL_NS	500e6	/* no step for this long: velocity 0 */
#define JITTER_NS	100e3	/* of the time stamps */

void velocity_reset(struct velocity *v)
{
	memset(v, 0, sizeof(*v));
}

void velocity_rebase(struct velocity *v, int64_t count, uint64_t t_ns)
{
	v->used = 0;
	v->started = true;
	v->count = count;
	v->t_ns = t_ns;
	v->quiet_ns = t_ns;
}

static const struct velocity_step *step_back(const struct velocity *v, uint32_t back)
{
	return &v->step[(v->newest + VELOCITY_STEPS - back) % VELOCITY_STEPS];
}

static void add_step(struct velocity *v, int64_t count, uint64_t t_ns)
{
	struct velocity_step *step;

	v->newest = (v->newest + 1) % VELOCITY_STEPS;
	v->used += v->used < VELOCITY_STEPS;
	step = &v->step[v->newest];
	step->twice_position = v->count + count + 1;
	step->half_ns = 0.5 * (double)(t_ns - v->t_ns);
	step->t_ns = v->t_ns + (t_ns - v->t_ns) / 2;
	step->single = count - v->count == 1 || v->count - count == 1;
	v->quiet_ns = t_ns;
}

/* Least and most counts/ns that lead from one step to the other. */
struct span {
	double low, high;
};

static double over(double counts, double ns)
{
	if (counts == 0)
		return 0;
	return ns > 0 ? counts / ns : copysign(INFINITY, counts);
}

static struct span span_between(const struct velocity_step *from, const struct velocity_step *to)
{
	double counts = 0.5 * (double)(to->twice_position - from->twice_position);
	double ns = (double)(to->t_ns - from->t_ns);
	double doubt = (from->single ? 0 : 0.5) + (to->single ? 0 : 0.5);
	double doubt_ns = (from->single ? from->half_ns : 0) + (to->single ? to->half_ns : 0) +
			  JITTER_NS;
	double least = counts - doubt, most = counts + doubt;

	return (struct span){
		.low = over(least, least > 0 ? ns + doubt_ns : ns - doubt_ns),
		.high = over(most, most < 0 ? ns + doubt_ns : ns - doubt_ns),
	};
}

/* Slope over the longest window that one constant velocity can explain, counts/s. */
static double fit(const struct velocity *v)
{
	const struct velocity_step *last = step_back(v, 0), *first = NULL;
	double low = -INFINITY, high = INFINITY;

	for (uint32_t back = 1; back < v->used; back++) {
		const struct velocity_step *step = step_back(v, back);
		struct span span = span_between(step, last);

		low = span.low > low ? span.low : low;
		high = span.high < high ? span.high : high;
		if (low > high)
			break;
		first = step;
	}
	if (!first)
		return 0;
	return 0.5e9 * (double)(last->twice_position - first->twice_position) /
	       (double)(last->t_ns - first->t_ns);
}

/* What the time since the last step still permits: less than one count. */
static double bounded(struct velocity *v)
{
	double silent_ns, most;

	if (v->slope == 0)
		return 0;
	silent_ns = (double)(v->t_ns - v->quiet_ns) - JITTER_NS;
	if (silent_ns <= 0)
		return v->slope;
	if (silent_ns > STANDSTILL_NS)
		v->slope = 0;
	most = 1e9 / silent_ns;
	return fmin(fmax(v->slope, -most), most);
}

double velocity_sample(struct velocity *v, int64_t count, uint64_t t_ns)
{
	if (v->started && t_ns <= v->t_ns)
		return v->rate;
	if (!v->started || t_ns - v->t_ns > VELOCITY_GAP_NS) {
		v->slope = 0;
		v->rate = 0;
		velocity_rebase(v, count, t_ns);
		return 0;
	}
	if (count != v->count) {
		add_step(v, count, t_ns);
		if (v->used > 1)
			v->slope = fit(v);
	}
	v->count = count;
	v->t_ns = t_ns;
	v->rate = bounded(v);
	return v->rate;
}
