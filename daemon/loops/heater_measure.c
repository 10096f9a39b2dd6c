/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The temperature of a period, and whether it can be one.
 *
 * The temperature is the median of the good readings, so one disturbed reading does not matter.
 * A median would also hide a loose wire, so bad readings are counted as well. One reading that is
 * not a number is a fault, and so are two at an end of the range, whatever the others are.
 *
 * A temperature may not jump from one period to the next, nor within a second, or steps of a little
 * less than is allowed would be a fall that no heater has.
 */

#include <math.h>

#include "daemon/loops/heater_part.h"

/* What noise and rounding may add to the fastest change, K. */
#define NOISE 2
#define BEFORE_NS UINT64_C(1000000000)
#define ENDS_MOST 1	/* readings at an end of the range, of a period with others */

/* One that was measured: the lower one of the two in the middle. */
static double median(double *sample, unsigned int count)
{
	for (unsigned int i = 1; i < count; i++) {
		const double value = sample[i];
		unsigned int at = i;

		for (; at && sample[at - 1] > value; at--)
			sample[at] = sample[at - 1];
		sample[at] = value;
	}
	return sample[(count - 1) / 2];
}

static enum heater_fault of_state(enum sensor_state state)
{
	switch (state) {
	case SENSOR_GOOD:
		return HEATER_FINE;
	case SENSOR_OPEN:
		return HEATER_OPEN;
	case SENSOR_SHORTED:
		return HEATER_SHORTED;
	case SENSOR_ODD:
		break;
	}
	return HEATER_ODD;
}

/* Are there readings of this period that no good ones make up for? */
static enum heater_fault of_readings(const unsigned int *count)
{
	if (count[SENSOR_ODD])
		return HEATER_ODD;
	for (enum sensor_state state = SENSOR_OPEN; state <= SENSOR_SHORTED; state++)
		if (count[state] > ENDS_MOST || (count[state] && !count[SENSOR_GOOD]))
			return of_state(state);
	return HEATER_FINE;
}

static bool jumps(const struct heater *heater, double celsius, double from, uint64_t from_ns)
{
	const double seconds = (double)since(from_ns, heater->sampled_ns) / SECOND;

	return from_ns && fabs(celsius - from) > heater->config.rate_most * seconds + NOISE;
}

/* A good temperature of this period: is it possible? */
static enum heater_fault judge(struct heater *heater, double celsius)
{
	const struct heater_config *config = &heater->config;
	const bool jumped = jumps(heater, celsius, heater->temperature, heater->good_ns) ||
			    jumps(heater, celsius, heater->before, heater->before_ns);

	heater->temperature = celsius;
	heater->good_ns = heater->sampled_ns;
	if (!heater->before_ns || jumped ||
	    since(heater->before_ns, heater->sampled_ns) >= BEFORE_NS) {
		heater->before = celsius;
		heater->before_ns = heater->sampled_ns;
	}
	if (celsius > config->most)
		return HEATER_OVER;
	if (celsius < config->least)
		return HEATER_UNDER;
	return jumped ? HEATER_JUMP : HEATER_FINE;
}

static enum heater_fault of_period(struct heater *heater, unsigned int good)
{
	enum sensor_state state;
	double celsius;

	if (!good)
		return heater->sensed; /* nothing new */
	state = sensor_read(&heater->sensor, median(heater->sample, good), &celsius);
	return state == SENSOR_GOOD ? judge(heater, celsius) : of_state(state);
}

enum heater_fault measure(struct heater *heater, uint64_t now_ns)
{
	const bool lost = heater->lost || !heater->device;
	const unsigned int good = heater->samples;
	enum heater_fault found = of_readings(heater->count);

	heater->samples = 0;
	for (enum sensor_state state = SENSOR_GOOD; state <= SENSOR_ODD; state++)
		heater->count[state] = 0;
	heater->lost = !heater->device;
	/* One from the future would never be old. */
	if (!heater->sampled_ns || heater->sampled_ns > now_ns + HEATER_PERIOD_NS ||
	    since(heater->sampled_ns, now_ns) > heater->config.stale_ns)
		found = HEATER_STALE;
	/* The temperature is of use to others as well, such as a fan. */
	else if (!found)
		found = of_period(heater, good);
	heater->sensed = found;
	/* What is too hot has to be seen, whatever else is wrong. */
	return lost && found != HEATER_OVER ? HEATER_DEVICE : found;
}
