/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How fast a commanded position moves on, by its own changes. Each image counts when it is
 * seen: the times that its commander writes into it may be anything. As images and cycles have
 * different clocks, sometimes two come in the time of one, or none. So changes are counted over
 * several milliseconds, in two spans that follow each other. A position that jumps once has
 * changed in one of them only.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/axis_wish.h"

#define MS UINT64_C(1000000)
#define MARK_NS (4 * MS)
#define FOLLOW_NS (100 * MS)	/* between changes of a position that moves on */
#define LIKELY 1.5f		/* a velocity above so many times what is seen is a limit */

static float speed_between(const struct axis_mark *from, const struct axis_mark *to)
{
	const double pulses = (double)to->position - from->position;

	return to->ns > from->ns ? (float)(pulses * 1e9 / (double)(to->ns - from->ns)) : 0;
}

static float slower(float a, float b)
{
	if (a * b <= 0)
		return 0;
	return fabsf(a) < fabsf(b) ? a : b;
}

void axis_wish_move(struct axis_wish *wish, int32_t position, uint64_t now_ns)
{
	const struct axis_mark now = { position, now_ns };
	struct axis_mark *mark = wish->mark;

	if (position != wish->position) {
		wish->moved_before_ns = wish->moved_ns;
		wish->moved_ns = now_ns;
	}
	wish->position = position;
	if (now_ns - mark[2].ns >= MARK_NS) {
		memmove(mark, mark + 1, 2 * sizeof(*mark));
		mark[2] = now;
	}
	wish->forward = 0;
	if (mark[0].ns && now_ns - mark[0].ns < FOLLOW_NS)
		wish->forward = slower(speed_between(&mark[0], &mark[1]),
				       speed_between(&mark[1], &now));
}

void axis_wish_rest(struct axis_wish *wish)
{
	wish->velocity = 0;
	wish->forward = 0;
}

bool axis_wish_moves_on(const struct axis_wish *wish, uint64_t now_ns)
{
	return wish->moved_before_ns && wish->moved_ns - wish->moved_before_ns < FOLLOW_NS &&
	       now_ns - wish->moved_ns < FOLLOW_NS;
}

float axis_wish_speed(const struct axis_wish *wish)
{
	const float said = fabsf(wish->velocity), seen = fabsf(wish->forward);

	return said > 0 && said < LIKELY * seen ? copysignf(said, wish->forward) : wish->forward;
}
