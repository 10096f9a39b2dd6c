/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A commander that does not know that the axis was moved commands the position of before, and one
 * that passes by the place of the axis does not mean it. To let go of the axis too early would be a
 * jump; to hold it for longer costs nothing.
 */

#include "daemon/loops/handover.h"

#include <math.h>

#include "daemon/loops/duration.h"

#define STAYS_NS UINT64_C(100000000)	/* a commander that means it */
#define COUNTS 2

void handover_begin(struct handover *handover)
{
	*handover = (struct handover){ .asked = NAN };
}

/* It does not draw the axis away from where it is, or is kept. */
static bool is_near(const struct servo *servo, double wanted, double place)
{
	return fabs(wanted - place) <= servo->config.follow_least / 2 ||
	       fabs((wanted - servo->position) * servo->config.scale) <= COUNTS;
}

bool handover_step(struct handover *handover, const struct servo *servo,
		   const struct servo_wish *wish, double step, double *place, uint64_t now_ns)
{
	const double rest = wish->position - *place;

	if (!(wish->position == handover->asked) || fabs(wish->velocity) > 0) {
		handover->asked = wish->position;
		handover->asked_ns = now_ns;
	}
	if (since(handover->asked_ns, now_ns) < STAYS_NS || !is_near(servo, wish->position, *place))
		return false;
	*place += fmax(-step, fmin(rest, step));
	return *place == wish->position || fabs(rest) <= step;
}
