/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A heater finds its own gains (Astrom and Hagglund's relay method).
 *
 * The power is switched between everything and nothing whenever the temperature passes the
 * target, and the temperature oscillates. From its height and its period follow the gain and the
 * period at which a controller would just oscillate, and from these the gains of a calm one
 * (Tyreus and Luyben): less than Ziegler and Nichols would take, as a heater cannot cool and pays
 * for each overshoot with minutes.
 *
 * Powers nearer to what the target needs would make it oscillate less. But that is not known yet,
 * and with a guess that is wrong it never passes its target again.
 */

#include <math.h>

#include "daemon/loops/heater_part.h"

#define CYCLES 6 /* until it is done */
#define MEASURED \
	4 /* of these, the last ones: the first ones still have the way from cold in them */
#define STEADY 0.9 /* of the highest power that it got */
#define APART_NS UINT64_C(2000000000) /* noise at the target is no oscillation */
#define LIMIT_NS UINT64_C(3600000000000) /* an oven of 0.2 K/s needs half of it to get hot */

void tune_begin(struct heater *heater)
{
	heater->tune = (struct heater_tune){
		.state = TUNE_RUNS,
		.on = heater->temperature <= heater->target,
		.high = -INFINITY,
		.low = INFINITY,
	};
	pid_reset(&heater->pid);
}

/* A whole cycle is over: it was cold for below_ns, and hot for above_ns. */
static void cycle(struct heater_tune *tune, uint64_t above_ns, uint64_t below_ns)
{
	if (tune->cycles >= CYCLES - MEASURED) {
		tune->height += (tune->high - tune->low) / MEASURED;
		tune->period += (double)(above_ns + below_ns) / SECOND / MEASURED;
	}
	tune->cycles++;
	tune->high = -INFINITY;
	tune->low = INFINITY;
}

/* With a power that varied, the oscillation is not that of one power. */
static void finish(struct heater_tune *tune)
{
	/* 4 / pi: the relay's power has the amplitude most / 2, and a sine in it that is larger
	 * by so much */
	const double ultimate = 4 / M_PI * tune->lowest / tune->height;

	tune->gains.p = ultimate / 3.2;
	tune->gains.i = tune->gains.p / (2.2 * tune->period);
	tune->gains.d = tune->gains.p * tune->period / 6.3;
	tune->gains.smooth = tune->period / 50;
	tune->state = isfinite(tune->gains.p) && tune->gains.p > 0 && tune->period > 0 &&
				      tune->lowest >= STEADY * tune->highest ?
			      TUNE_DONE :
			      TUNE_FAILED;
}

/* What it got in the last period, if its power was on. */
static void look_at_power(struct heater_tune *tune, double power)
{
	if (tune->cycles < CYCLES - MEASURED) {
		tune->lowest = INFINITY;
		tune->highest = 0;
	} else if (tune->on) {
		tune->lowest = fmin(tune->lowest, power);
		tune->highest = fmax(tune->highest, power);
	}
}

double tune_step(struct heater *heater, uint64_t now_ns)
{
	struct heater_tune *tune = &heater->tune;
	const bool hot = heater->temperature > heater->target;
	uint64_t lasted;

	look_at_power(tune, heater->power);

	if (!tune->begun_ns)
		tune->begun_ns = tune->switched_ns = now_ns;
	lasted = since(tune->switched_ns, now_ns);
	tune->high = fmax(tune->high, heater->temperature);
	tune->low = fmin(tune->low, heater->temperature);
	if (since(tune->begun_ns, now_ns) > LIMIT_NS)
		tune->state = TUNE_FAILED;
	if (hot == tune->on && lasted > APART_NS) {
		tune->on = !hot;
		tune->switched_ns = now_ns;
		/* from cold it has come a long way: that was no cycle */
		if (!hot)
			tune->above_ns = lasted;
		else if (tune->above_ns)
			cycle(tune, tune->above_ns, lasted);
		else
			tune->high = -INFINITY, tune->low = INFINITY;
	}
	if (tune->state == TUNE_RUNS && tune->cycles == CYCLES)
		finish(tune);
	return tune->on ? heater->config.power_most : 0;
}
