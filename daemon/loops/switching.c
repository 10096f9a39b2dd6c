/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is owed grows by the power and shrinks while the output is on. The output goes on when a
 * shortest pulse is owed, and off when nothing is. So the mean is that of the power, and no
 * pulse is shorter than a relay likes it, but for one that a stop cuts off: that is never late.
 *
 * Full power begins as soon as the output may change, and owes a shortest pulse as long as it
 * lasts: with a little less the output stays on. When no power is asked for any more, what was
 * owed is forgotten with the end of the pulse, or a controller that has just reached its target
 * would get heat that it does not want.
 */

#include "daemon/loops/switching.h"

#include <math.h>

#define SECOND 1e9
#define OWED_MOST 2 /* shortest pulses */

bool switching_step(struct switching *output, double power, bool stop, uint64_t now_ns)
{
	const double seconds = output->last_ns ? (double)(now_ns - output->last_ns) / SECOND : 0;
	const double least = fmax((double)output->least_ns / SECOND, seconds);
	const bool may_change = !output->since_ns || now_ns - output->since_ns >= output->least_ns;
	bool on = output->on;

	output->last_ns = now_ns;
	output->owed += (power - on) * seconds;
	if (power >= 1)
		output->owed = least;
	if (output->owed > OWED_MOST * least)
		output->owed = OWED_MOST * least;
	if (output->owed < -OWED_MOST * least)
		output->owed = -OWED_MOST * least;
	if (stop) {
		on = false;
		output->owed = 0;
	} else if (may_change) {
		on = power >= 1 || (power > 0 && (on ? output->owed > 0 : output->owed >= least));
		if (output->on && power <= 0)
			output->owed = fmin(output->owed, 0);
	}
	if (on != output->on)
		output->since_ns = now_ns;
	return output->on = on;
}
