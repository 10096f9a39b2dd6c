/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The daemon has moved a servo motor by itself, and holds it where it has brought it until the
 * commander's position is there too: that may be one from before. Pure. Realtime thread only.
 */
#ifndef LOOPS_HANDOVER_H
#define LOOPS_HANDOVER_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/loops/servo.h"

struct handover {
	double asked;      /* the commander's position; NAN: not seen yet */
	uint64_t asked_ns; /* ... since then */
};

void handover_begin(struct handover *handover);

/*
 * One cycle. The commander's position has to be at rest for 0.1 s. It has to be nearer to `*place`,
 * where the axis is held, than half of what it may be off at rest, or to be that of its encoder.
 * Then `*place` goes there, by no more than `step` (units) at once. True: it is there, and the axis
 * is the commander's.
 */
bool handover_step(struct handover *handover, const struct servo *servo,
		   const struct servo_wish *wish, double step, double *place, uint64_t now_ns);

#endif
