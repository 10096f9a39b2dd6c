/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Receive stamps: the kernel stamps packets with the wall clock, everything
 * here lives on the monotonic clock.
 *
 * The difference of the two clocks is constant except when somebody sets the
 * wall clock (slewing moves both alike). So it is read with every packet,
 * which costs three vDSO reads and no system call, and a change means a
 * step. A packet stamped before the step and converted after it would be
 * wrong by the step: an hour, a leap second. Therefore a stamp counts only if
 * its conversion lies between the moment the present difference was first
 * seen and now. All others give 0, "unknown", and the engine uses the time at
 * which it got the packet. A wrong stamp can therefore never make a round
 * trip longer than the step was small (STEP_NS).
 */
#include <time.h>
#include "daemon/transport/stamp.h"

enum {
	STEP_NS = 50000,  /* a difference that changed by more has been set */
	LOOSE_NS = 20000, /* clocks read further apart than this say nothing */
	READ_TRIES = 3,
};

static uint64_t clock_read(clockid_t clock)
{
	struct timespec t;

	clock_gettime(clock, &t);
	return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

uint64_t stamp_now(void)
{
	return clock_read(CLOCK_MONOTONIC);
}

void stamp_sample(struct stamp *stamp, uint64_t before_ns, uint64_t real_ns, uint64_t after_ns)
{
	int64_t offset = (int64_t)(real_ns - before_ns - (after_ns - before_ns) / 2);
	int64_t change = offset - stamp->offset;

	stamp->fresh = after_ns - before_ns <= LOOSE_NS;
	if (!stamp->fresh)
		return;
	if (!stamp->known || change > STEP_NS || change < -STEP_NS)
		stamp->since_ns = before_ns;
	stamp->offset = offset;
	stamp->known = true;
}

uint64_t stamp_convert(const struct stamp *stamp, uint64_t real_ns, uint64_t now_ns)
{
	uint64_t mono = real_ns - (uint64_t)stamp->offset;

	if (!stamp->fresh || mono < stamp->since_ns)
		return 0;
	/* the two readings are never quite at the same moment */
	if (mono > now_ns)
		return mono - now_ns <= LOOSE_NS ? now_ns : 0;
	return mono;
}

uint64_t stamp_read(struct stamp *stamp)
{
	uint64_t before, real, after;
	int tries = READ_TRIES;

	do {
		before = clock_read(CLOCK_MONOTONIC);
		real = clock_read(CLOCK_REALTIME);
		after = clock_read(CLOCK_MONOTONIC);
	} while (after - before > LOOSE_NS && --tries > 0);
	stamp_sample(stamp, before, real, after);
	return after;
}
