/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * From the reading of an analog input to a temperature. Pure: nothing is kept between two readings.
 *
 * A reading is a fraction of the input's range, 0 to 1. A resistive sensor lies between the input
 * and ground, and a pull-up resistor between the input and the converter's reference, so the
 * reference's voltage does not matter.
 */
#ifndef LOOPS_SENSOR_H
#define LOOPS_SENSOR_H

enum sensor_kind {
	SENSOR_BETA,      /* thermistor: its resistance at one temperature, and beta */
	SENSOR_STEINHART, /* thermistor: three points, Steinhart and Hart's equation */
	SENSOR_PLATINUM,  /* PT100, PT1000 (IEC 60751) */
	SENSOR_LINEAR,    /* an amplifier: volts at 0 degrees, and for each kelvin */
	SENSOR_TABLE,     /* points, straight lines between them */
};

#define SENSOR_POINTS 32

struct sensor_point {
	double at; /* ohm if there is a pull-up resistor, else volts */
	double celsius;
};

struct sensor_config {
	enum sensor_kind kind;
	double pull_up;            /* ohm; of a table: 0 if it has volts */
	double reference;          /* volts of a reading of 1; LINEAR, and a TABLE with volts */
	double ohm, celsius, beta; /* BETA; PLATINUM: ohm at 0 degrees */
	double volts_at_0, volts_per_kelvin;
	/* STEINHART: the first three; both by `at`, rising */
	struct sensor_point points[SENSOR_POINTS];
	unsigned int count; /* of a table */
};

struct sensor {
	struct sensor_config config;
	double a, b, c; /* 1/T = a + b ln R + c (ln R)^3, T in kelvin, R in ohm */
};

enum sensor_state {
	SENSOR_GOOD,
	SENSOR_OPEN,    /* the reading is at the upper end: a broken wire */
	SENSOR_SHORTED, /* ... at the lower end */
	SENSOR_ODD,     /* it is no number */
};

/* Judge a configuration and take it. NULL, or what is wrong, in words. Not for realtime. */
const char *sensor_init(struct sensor *sensor, const struct sensor_config *config);

/* What a reading can be before its temperature is computed: cheap, for each of many. Realtime. */
enum sensor_state sensor_judge(const struct sensor *sensor, double reading);

/* Degrees Celsius of a reading; *celsius is set only if it is good. Realtime. */
enum sensor_state sensor_read(const struct sensor *sensor, double reading, double *celsius);

/* The coldest and the hottest temperature that a 12-bit converter can read. Not for realtime. */
void sensor_range(const struct sensor *sensor, double *coldest, double *hottest);

#endif
