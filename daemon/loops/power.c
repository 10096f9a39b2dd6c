/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A supply that is overloaded switches everything off, so the heaters get less instead. Each gets
 * the same part of what it asked for, so that none is forgotten; a controller makes up for it
 * later.
 */

#include "daemon/loops/power.h"

#include <math.h>

void power_share(double *power, const double *watts, unsigned int count, double most)
{
	double wanted = 0;

	for (unsigned int i = 0; i < count; i++) {
		/* what is no power is none, and takes nothing from the others */
		power[i] = power[i] > 0 && power[i] <= 1 ? power[i] : 0;
		wanted += power[i] * watts[i];
	}
	if (wanted <= most)
		return;
	for (unsigned int i = 0; i < count; i++)
		power[i] *= most > 0 ? most / wanted : 0;
}

bool fan_step(const struct fan_config *config, bool runs, double temperature)
{
	if (!isfinite(temperature) || temperature > config->above)
		return true;
	return runs && temperature > config->above - config->hysteresis;
}
