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

void velocity_rebase(struct velocity *v, int64_t count, uint64_t t_ns)
{
	v->used = 0;
	v->started = true;
	v->count = count;
	v->t_ns = t_ns;
	v->quiet_ns = t_ns;
}

/* Where the next step belongs; the newest are taken to the front when there is no room. */
static uint32_t next_place(struct velocity *v)
{
	const size_t kept = VELOCITY_STEPS - 1, size = kept * sizeof(double);
	struct velocity_steps *step = &v->step;

	if (!v->used)
		return 1; /* steps are looked at in pairs: there is one in front of each */
	if (v->newest + 1 < VELOCITY_ROOM)
		return v->newest + 1;
	memcpy(&step->position[1], &step->position[VELOCITY_ROOM - kept], size);
	memcpy(&step->t_ns[1], &step->t_ns[VELOCITY_ROOM - kept], size);
	memcpy(&step->doubt[1], &step->doubt[VELOCITY_ROOM - kept], size);
	memcpy(&step->doubt_ns[1], &step->doubt_ns[VELOCITY_ROOM - kept], size);
	return (uint32_t)kept + 1;
}

static void add_step(struct velocity *v, int64_t count, uint64_t t_ns)
{
	const bool single = count - v->count == 1 || v->count - count == 1;
	const double half_ns = 0.5 * (double)(t_ns - v->t_ns);
	const uint32_t at = next_place(v);

	v->newest = at;
	v->used += v->used < VELOCITY_STEPS;
	v->step.position[at] = 0.5 * (double)(v->count + count);
	v->step.t_ns[at] = (double)(int64_t)v->t_ns + half_ns;
	v->step.doubt[at] = single ? 0 : 0.5;
	v->step.doubt_ns[at] = single ? half_ns : 0;
	v->quiet_ns = t_ns;
}

/*
 * For each encoder that moves, in each period, as many slopes are bounded as there are
 * steps, so two at once. GCC and Clang do that on every processor.
 */
typedef double pair __attribute__((vector_size(16)));
typedef int64_t pair_mask __attribute__((vector_size(16)));

static inline pair load(const double *from)
{
	pair value;

	memcpy(&value, from, sizeof(value));
	return value;
}

/* Least and most counts/ns that lead from two steps to the newest one. */
struct spans {
	pair low, high;
};

/*
 * `way` is +1 or -1, so that the newest count went up. Then the least slope is the one
 * that took longest, and the most the one that took shortest; two steps that may have
 * been at the same moment bound nothing: a time of 0 gives infinity.
 */
static inline struct spans spans_from(const struct velocity_steps *step, uint32_t at,
				      uint32_t newest, double way)
{
	const pair counts = way * (step->position[newest] - load(&step->position[at]));
	const pair ns = step->t_ns[newest] - load(&step->t_ns[at]);
	const pair doubt = step->doubt[newest] + load(&step->doubt[at]);
	const pair doubt_ns = step->doubt_ns[newest] + JITTER_NS + load(&step->doubt_ns[at]);
	const pair shortest = ns - doubt_ns;

	return (struct spans){
		.low = (counts - doubt) / (ns + doubt_ns),
		.high = (counts + doubt) / (pair)((pair_mask)shortest & (shortest > 0)),
	};
}

static inline double most_of(double a, double b)
{
	return a > b ? a : b;
}

static inline double least_of(double a, double b)
{
	return a < b ? a : b;
}

/* Slope over the longest window that one constant velocity can explain, counts/s. */
static double fit(const struct velocity *v)
{
	const uint32_t newest = v->newest, oldest = newest + 1 - v->used;
	const double *position = v->step.position, *t_ns = v->step.t_ns;
	const double way = position[newest] < position[newest - 1] ? -1 : 1;
	double low = -INFINITY, high = INFINITY;
	uint32_t first = newest;

	for (uint32_t at = newest - 1; at >= oldest; at -= 2) {
		const struct spans spans = spans_from(&v->step, at - 1, newest, way);

		low = most_of(spans.low[1], low);
		high = least_of(spans.high[1], high);
		if (low > high)
			break;
		first = at;
		low = most_of(spans.low[0], low);
		high = least_of(spans.high[0], high);
		if (at == oldest || low > high)
			break;
		first = at - 1;
	}
	if (first == newest)
		return 0;
	return 1e9 * (position[newest] - position[first]) / (t_ns[newest] - t_ns[first]);
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
