/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A supply that is overloaded switches everything off, so the heaters get less instead. All have
 * the same limit, a part of their own full power, and whoever asks for less than that gets it. So
 * a heater that only stays warm is not starved by one that gets warm, and what a heater gets does
 * not depend on how much it asks for: it is limited as by a limit of its own.
 */

#include "daemon/loops/power.h"

#include <math.h>

double power_limit(const double *power, const double *watts, unsigned int count, double most)
{
	double limit = 0;

	if (!(most > 0))
		return 0;
	/* Each turn, what those at or below the limit do not need raises it for the others. */
	for (unsigned int turn = 0; turn <= count; turn++) {
		double left = most, needed = 0;

		for (unsigned int i = 0; i < count; i++) {
			/* what is no power is none, and takes nothing from the others */
			const double asked = power[i] > 0 && power[i] <= 1 ? power[i] : 0;

			if (asked <= limit)
				left -= asked * watts[i];
			else
				needed += watts[i];
		}
		if (needed <= 0)
			return 1;
		limit = fmax(left, 0) / needed;
	}
	return fmin(limit, 1);
}

bool fan_step(const struct fan_config *config, bool runs, double temperature)
{
	if (!isfinite(temperature) || temperature > config->above)
		return true;
	return runs && temperature > config->above - config->hysteresis;
}
