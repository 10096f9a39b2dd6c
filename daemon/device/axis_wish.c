/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The speed of a commanded position by its changes, because the commanded velocity may be only
 * a limit. Time is counted in images, and not by when they are seen: cycles and images are not
 * synchronised, and a late commander continues from where it was. The period of the images is
 * the one that the commander states, unless the observed one is more than twice as long.
 *
 * Two spans of four periods have to agree on the direction, and the slower one counts, so a jump
 * within one span is not taken for a speed. They have to agree for several images in a row, so
 * steps now and then are not taken for a speed either. While the position gets faster or slower,
 * the commanded velocity is more exact. It is used up to the limit that the spans give.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/axis_wish.h"

#define FOLLOW_NS UINT64_C(100000000)	/* between changes of a position that moves on */

enum {
	SPAN = AXIS_PAST / 2, /* images */
	MANY = 100,
	STEADY = 8,
};

void axis_wish_position(struct axis_wish *wish, int32_t position, uint64_t now_ns)
{
	if (position != wish->position) {
		wish->moved_before_ns = wish->moved_ns;
		wish->moved_ns = now_ns;
	}
	wish->position = position;
}

bool axis_wish_moves_on(const struct axis_wish *wish, uint64_t now_ns)
{
	return wish->moved_before_ns && wish->moved_ns - wish->moved_before_ns < FOLLOW_NS &&
	       now_ns - wish->moved_ns < FOLLOW_NS;
}

static void push(struct axis_wish *wish, double position, uint64_t seen_ns)
{
	memmove(wish->past + 1, wish->past, sizeof(wish->past) - sizeof(wish->past[0]));
	memmove(wish->past_ns + 1, wish->past_ns, sizeof(wish->past_ns) - sizeof(wish->past_ns[0]));
	wish->past[0] = (int32_t)lrint(position);
	wish->past_ns[0] = seen_ns;
	if (wish->known < AXIS_PAST)
		wish->known++;
}

/* Images that were not seen had positions in between. Of many, only a steady motion is likely. */
static void remember(struct axis_wish *wish, const struct axis_images *images)
{
	const double from = wish->past[0], change = wish->position - from;
	const double since_ns = (double)(images->seen_ns - wish->past_ns[0]);
	const double each = change / (double)images->count;
	const double before = ((double)from - wish->past[SPAN]) / SPAN;
	const uint64_t from_ns = wish->past_ns[0];
	uint64_t i = 1;

	if (!wish->known ||
	    (images->count >= AXIS_PAST && (!wish->forward || images->count > MANY ||
					    each * before <= 0 || fabs(each) > 2 * fabs(before)))) {
		wish->known = 0;
		i = images->count;
	} else if (images->count > AXIS_PAST) {
		i = images->count - AXIS_PAST;
	}
	for (; i <= images->count; i++)
		push(wish, from + each * (double)i,
		     from_ns + (uint64_t)(since_ns * (double)i / (double)images->count));
	wish->past[0] = wish->position;
}

/* A commander that was late once is late in one of the spans. */
static double apart_ns(const struct axis_wish *wish, const struct axis_images *images)
{
	const double after = (double)(wish->past_ns[0] - wish->past_ns[SPAN]) / SPAN;
	const double before = (double)(wish->past_ns[SPAN] - wish->past_ns[2 * SPAN]) / SPAN;

	if (!images->apart_ns)
		return (after + before) / 2;
	/* it may be seen earlier or later by a cycle, which is no reason to doubt what it says */
	return fmin(after, before) > 2 * (double)images->apart_ns ? fmin(after, before) :
								    (double)images->apart_ns;
}

/* Pulses in a span, of the slower one, and what they would be now; 0 if they do not agree. */
static double slower_span(const struct axis_wish *wish, double *now)
{
	const double before = (double)wish->past[SPAN] - wish->past[2 * SPAN];
	const double after = (double)wish->past[0] - wish->past[SPAN];

	if (wish->known < AXIS_PAST || before * after <= 0)
		return 0;
	if (fabs(before) >= fabs(after))
		return *now = after;
	*now = fabs(after) < 2 * fabs(before) ? after + (after - before) / 2 : 2 * before;
	return before;
}

void axis_wish_follow(struct axis_wish *wish, const struct axis_images *images)
{
	const double said = fabs((double)wish->velocity);
	double pulses, now = 0, apart, per_second;

	remember(wish, images);
	pulses = slower_span(wish, &now);
	wish->forward = 0;
	apart = pulses == 0 ? 0 : apart_ns(wish, images);
	if (!(apart > 0)) {
		wish->steady = 0;
		return;
	}
	if (wish->steady < STEADY) {
		wish->steady++;
		return;
	}
	per_second = 1e9 / (SPAN * apart);
	if (said > 0)
		wish->forward = (float)copysign(fmin(said, fabs(now) * per_second), pulses);
	else
		wish->forward = (float)(pulses * per_second);
}

void axis_wish_rest(struct axis_wish *wish)
{
	wish->known = wish->steady = 0;
	wish->forward = wish->way = 0;
}
