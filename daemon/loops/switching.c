/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is owed grows by the power and shrinks while the output is on. The output goes on when a
 * shortest pulse is owed, and off when nothing is. So the mean is that of the power, and no
 * pulse is shorter than a relay likes it, but for one that a stop cuts off: that is never late.
 *
 * What is owed is limited, or a minute at full power without an effect, behind a relay that may
 * not change yet, would be followed by another minute.
 */

#include "daemon/loops/switching.h"

#include <math.h>

#define SECOND 1e9
#define OWED_MOST 2 /* shortest pulses */

bool switching_step(struct switching *output, double power, bool stop, uint64_t now_ns)
{
	const double seconds = output->last_ns ? (double)(now_ns - output->last_ns) / SECOND : 0;
	const double least = fmax((double)output->least_ns / SECOND, seconds);
	const bool may_change =
		!output->since_ns || now_ns - output->since_ns >= output->least_ns;
	bool on = output->on;

	output->last_ns = now_ns;
	output->owed += (power - on) * seconds;
	if (output->owed > OWED_MOST * least)
		output->owed = OWED_MOST * least;
	if (output->owed < -OWED_MOST * least)
		output->owed = -OWED_MOST * least;
	if (stop) {
		on = false;
		output->owed = 0;
	} else if (may_change) {
		on = on ? output->owed > 0 || power >= 1 : output->owed >= least && power > 0;
	}
	if (on != output->on)
		output->since_ns = now_ns;
	return output->on = on;
}
