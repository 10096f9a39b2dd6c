/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Sensors of temperature.
 *
 * A thermistor with a broken wire reads as very cold and a shorted one as very hot; with
 * platinum it is the other way round. Who heats must not take either for a temperature, so
 * readings at the ends of the converter's range are no temperatures, whatever the sensor.
 *
 * Where a table ends, so does what is known: beyond it is no temperature either.
 */

#include "daemon/loops/sensor.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#define ZERO 273.15 /* 0 degrees Celsius in kelvin */
/* Of a 12-bit converter, 8 steps: what a good one may be off at its ends. */
#define END 0.002
#define STEPS 4096

/* Callendar and Van Dusen, above 0 degrees; at -50 degrees it is off by 0.1. */
#define PLATINUM_A 3.9083e-3
#define PLATINUM_B -5.775e-7

static bool positive(double value)
{
	return isfinite(value) && value > 0;
}

static double kelvin_of(const struct sensor *sensor, double ohm)
{
	const double l = log(ohm);

	return 1 / (sensor->a + sensor->b * l + sensor->c * l * l * l);
}

static const char *init_beta(struct sensor *sensor)
{
	const struct sensor_config *config = &sensor->config;

	if (!positive(config->ohm) || !positive(config->beta) || !positive(config->celsius + ZERO))
		return "ohm, beta and the temperature have to be more than nothing";
	sensor->b = 1 / config->beta;
	sensor->a = 1 / (config->celsius + ZERO) - sensor->b * log(config->ohm);
	return NULL;
}

/* Colder is more, over all that can be read: between the points it may well be so by accident. */
static bool falls(const struct sensor *sensor)
{
	const double pull_up = sensor->config.pull_up;
	double before = INFINITY;

	for (int i = 1; i < STEPS; i++) {
		const double reading = (double)i / STEPS;
		const double now = kelvin_of(sensor, pull_up * reading / (1 - reading));

		if (reading < END || reading > 1 - END)
			continue;
		if (!(now < before) || !(now > 0))
			return false;
		before = now;
	}
	return true;
}

static const char *init_steinhart(struct sensor *sensor)
{
	const struct sensor_point *p = sensor->config.points;
	double l[3], y[3];

	for (int i = 0; i < 3; i++) {
		if (!positive(p[i].at) || !positive(p[i].celsius + ZERO))
			return "each of the three points needs ohm and a temperature";
		if (i && (p[i].at <= p[i - 1].at || p[i].celsius >= p[i - 1].celsius))
			return "the three points have to have rising ohm and falling "
			       "temperatures";
		l[i] = log(p[i].at);
		y[i] = 1 / (p[i].celsius + ZERO);
	}
	const double g2 = (y[1] - y[0]) / (l[1] - l[0]);
	const double g3 = (y[2] - y[0]) / (l[2] - l[0]);

	sensor->c = (g3 - g2) / (l[2] - l[1]) / (l[0] + l[1] + l[2]);
	sensor->b = g2 - sensor->c * (l[0] * l[0] + l[0] * l[1] + l[1] * l[1]);
	sensor->a = y[0] - (sensor->b + l[0] * l[0] * sensor->c) * l[0];
	return falls(sensor) ? NULL : "no thermistor has these three points";
}

static const char *init_table(const struct sensor_config *config)
{
	bool rises = config->points[1].celsius > config->points[0].celsius;

	if (config->count < 2 || config->count > SENSOR_POINTS)
		return "a table has 2 to 32 points";
	for (unsigned int i = 0; i < config->count; i++) {
		const struct sensor_point *p = &config->points[i];

		if (!isfinite(p->at) || p->at < 0 || !isfinite(p->celsius))
			return "a point of the table is no pair of numbers";
		if (!i)
			continue;
		if (p->at <= p[-1].at)
			return "the points of the table have to be in rising order";
		if (p->celsius == p[-1].celsius || (p->celsius > p[-1].celsius) != rises)
			return "the temperatures of the table have to rise, or to fall";
	}
	return NULL;
}

static bool has_volts(const struct sensor_config *config)
{
	return config->kind == SENSOR_LINEAR ||
	       (config->kind == SENSOR_TABLE && config->pull_up == 0);
}

const char *sensor_init(struct sensor *sensor, const struct sensor_config *config)
{
	*sensor = (struct sensor){ .config = *config };
	const bool volts = has_volts(config);

	if (volts && !positive(config->reference))
		return "the reference has to have more than 0 volts";
	if (!volts && !positive(config->pull_up))
		return "the pull-up resistor has to have more than 0 ohm";
	switch (config->kind) {
	case SENSOR_BETA:
		return init_beta(sensor);
	case SENSOR_STEINHART:
		return init_steinhart(sensor);
	case SENSOR_PLATINUM:
		return positive(config->ohm) ? NULL : "a platinum sensor has 100 or 1000 ohm";
	case SENSOR_LINEAR:
		return isfinite(config->volts_at_0) && isfinite(config->volts_per_kelvin) &&
				       config->volts_per_kelvin != 0 ?
			       NULL :
			       "an amplifier needs volts for each kelvin";
	case SENSOR_TABLE:
		return init_table(config);
	}
	return "there is no such sensor";
}

static double platinum(double ohm, double at_0)
{
	const double root = PLATINUM_A * PLATINUM_A - 4 * PLATINUM_B * (1 - ohm / at_0);

	return (sqrt(root) - PLATINUM_A) / (2 * PLATINUM_B);
}

static enum sensor_state look_up(const struct sensor_config *config, double at, double *celsius)
{
	const struct sensor_point *p = config->points;
	unsigned int i = 1;

	if (at < p[0].at)
		return SENSOR_SHORTED;
	if (at > p[config->count - 1].at)
		return SENSOR_OPEN;
	while (at > p[i].at)
		i++;
	*celsius = p[i - 1].celsius +
		   (p[i].celsius - p[i - 1].celsius) * (at - p[i - 1].at) / (p[i].at - p[i - 1].at);
	return SENSOR_GOOD;
}

enum sensor_state sensor_judge(const struct sensor *sensor, double reading)
{
	if (!isfinite(reading) || reading < -END || reading > 1 + END)
		return SENSOR_ODD;
	if (reading > 1 - END)
		return SENSOR_OPEN;
	/* An amplifier may well say 0 volts at 0 degrees; a table says itself where it ends. */
	return reading < END && !has_volts(&sensor->config) ? SENSOR_SHORTED : SENSOR_GOOD;
}

enum sensor_state sensor_read(const struct sensor *sensor, double reading, double *celsius)
{
	const struct sensor_config *config = &sensor->config;
	const enum sensor_state state = sensor_judge(sensor, reading);
	const double volts = reading * config->reference;
	const double ohm = config->pull_up * reading / (1 - reading);
	double found;

	if (state != SENSOR_GOOD)
		return state;
	if (config->kind == SENSOR_TABLE)
		return look_up(config, has_volts(config) ? volts : ohm, celsius);
	if (config->kind == SENSOR_LINEAR)
		found = (volts - config->volts_at_0) / config->volts_per_kelvin;
	else
		found = config->kind == SENSOR_PLATINUM ? platinum(ohm, config->ohm) :
							  kelvin_of(sensor, ohm) - ZERO;
	/* Beyond what the equation can mean. */
	if (!isfinite(found) || (found < -ZERO && config->kind != SENSOR_LINEAR))
		return SENSOR_ODD;
	*celsius = found;
	return SENSOR_GOOD;
}

void sensor_range(const struct sensor *sensor, double *coldest, double *hottest)
{
	*coldest = INFINITY;
	*hottest = -INFINITY;
	for (int i = 0; i <= STEPS; i++) {
		double celsius;

		if (sensor_read(sensor, (double)i / STEPS, &celsius) != SENSOR_GOOD)
			continue;
		*coldest = fmin(*coldest, celsius);
		*hottest = fmax(*hottest, celsius);
	}
}
