/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Was this machine suspended?
 *
 * All times here are CLOCK_MONOTONIC, which stands still meanwhile. So after a minute of
 * it every heartbeat, age and deadline would be as young as before, and the next cycle
 * would go on as if nothing had been: it would switch on again what the device's own
 * failsafe has switched off, and an axis would move on. CLOCK_BOOTTIME goes on, and what
 * it has gained is the time that nobody counted.
 *
 * The two cannot be read at once. Between two readings of the one the other is read: the
 * true difference lies between the two that this gives, however long the thread had no
 * processor in between. The upper one never is too small, so the smallest of them is what
 * a later lower one is compared with; a machine that is merely late is not taken for one
 * that slept.
 *
 * The look comes at the start of each cycle and before any request is resent, because a
 * request that was in flight when the machine was suspended would carry outputs before the
 * next cycle starts.
 */
#include "daemon/rt/internal.h"

#define LEAST_NS	INT64_C(1000000)

static int64_t smaller(int64_t a, int64_t b)
{
	return a < b ? a : b;
}

static void tell(struct loop *loop, uint64_t now_ns, int64_t slept_ns)
{
	const struct event e = {
		.t_ns = now_ns,
		.code = EVENT_SUSPENDED,
		.level = EVENT_WARNING,
		.device = 255,
		.a = slept_ns / 1000000,
	};

	event_push(&loop->events, &e);
}

void suspend_look(struct loop *loop, uint64_t now_ns)
{
	struct loop_suspend *suspend = &loop->own->suspend;
	const uint64_t boot_ns = loop->own->clock.boot(loop->own->clock.context);
	const uint64_t after_ns = loop_now(loop);
	const int64_t least = (int64_t)(boot_ns - after_ns), most = (int64_t)(boot_ns - now_ns);
	const int64_t slept = suspend->begun ? least - suspend->gained_ns : 0;

	suspend->gained_ns = suspend->begun && slept < LEAST_NS ?
				     smaller(suspend->gained_ns, most) :
				     most;
	suspend->begun = true;
	if (slept < LEAST_NS)
		return;
	tell(loop, after_ns, slept);
	for (uint32_t i = 0; i < loop->count; i++)
		device_suspended(loop->devices[i].device, after_ns, (uint64_t)slept);
}
