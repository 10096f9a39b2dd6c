/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Sensors against the figures of their makers and of IEC 60751, and what is no temperature.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/loops/sensor.h"

static const struct sensor_config beta = {
	.kind = SENSOR_BETA,
	.pull_up = 4700,
	.ohm = 100e3,
	.celsius = 25,
	.beta = 3950,
};

static double reading_of(double pull_up, double ohm)
{
	return ohm / (ohm + pull_up);
}

static void expect(const struct sensor *sensor, double reading, double celsius, double within)
{
	double found = NAN;

	assert_int_equal(sensor_read(sensor, reading, &found), SENSOR_GOOD);
	if (!(fabs(found - celsius) <= within))
		fail_msg("a reading of %g is %g degrees, not %g", reading, found, celsius);
}

static void expect_none(const struct sensor *sensor, double reading, enum sensor_state state)
{
	double found = 12345;

	assert_int_equal(sensor_read(sensor, reading, &found), state);
	assert_true(found == 12345);
}

static void beta_thermistors_follow_their_equation(void **state)
{
	struct sensor sensor;

	(void)state;
	assert_null(sensor_init(&sensor, &beta));
	expect(&sensor, reading_of(4700, 100e3), 25, 1e-9);
	for (double celsius = -10; celsius <= 300; celsius += 10) {
		const double ohm = 100e3 * exp(3950 * (1 / (celsius + 273.15) - 1 / 298.15));

		expect(&sensor, reading_of(4700, ohm), celsius, 1e-6);
	}
}

/* Semitec 104GT-2: 100 kohm at 25 degrees, beta from 25 to 85 degrees 4267 K. */
static void three_points_are_a_thermistor(void **state)
{
	static const struct sensor_config config = {
		.kind = SENSOR_STEINHART,
		.pull_up = 4700,
		.points = { { 80.65, 300 }, { 1360, 150 }, { 126800, 20 } },
	};
	struct sensor sensor;

	(void)state;
	assert_null(sensor_init(&sensor, &config));
	for (int i = 0; i < 3; i++)
		expect(&sensor, reading_of(4700, config.points[i].at), config.points[i].celsius,
		       1e-6);
	/* between the points */
	expect(&sensor, reading_of(4700, 100e3), 25, 0.5);
	expect(&sensor, reading_of(4700, 100e3 * exp(4267 * (1 / 358.15 - 1 / 298.15))), 85, 1);
}

/* IEC 60751, table 1 */
static void platinum_is_that_of_the_standard(void **state)
{
	static const double table[][2] = {
		{ -50, 80.306 },  { 0, 100 },       { 50, 119.397 },
		{ 100, 138.506 }, { 200, 175.856 }, { 300, 212.052 },
		{ 400, 247.092 }, { 600, 313.708 }, { 850, 390.481 },
	};
	struct sensor_config config = { .kind = SENSOR_PLATINUM };
	struct sensor sensor;

	(void)state;
	for (config.ohm = 100; config.ohm <= 1000; config.ohm *= 10) {
		config.pull_up = config.ohm * 4.7;
		assert_null(sensor_init(&sensor, &config));
		for (size_t i = 0; i < sizeof(table) / sizeof(table[0]); i++)
			expect(&sensor, reading_of(config.pull_up, table[i][1] * config.ohm / 100),
			       table[i][0], 0.15);
	}
}

static void amplifiers_and_tables(void **state)
{
	static const struct sensor_config amplifier = {
		.kind = SENSOR_LINEAR, .reference = 3.3, .volts_at_0 = 1.25,
		.volts_per_kelvin = 0.005,
	}, volts = {
		.kind = SENSOR_TABLE, .reference = 5, .count = 3,
		.points = { { 0.5, -40 }, { 1, 0 }, { 4, 400 } },
	}, ohm = {
		.kind = SENSOR_TABLE, .pull_up = 1000, .count = 2,
		.points = { { 100, 200 }, { 9000, 20 } },
	};
	struct sensor sensor;

	(void)state;
	assert_null(sensor_init(&sensor, &amplifier));
	expect(&sensor, 1.25 / 3.3, 0, 1e-9);
	expect(&sensor, 2.25 / 3.3, 200, 1e-9);
	expect(&sensor, 0, -250, 1e-9);
	expect_none(&sensor, 0.999, SENSOR_OPEN);
	assert_null(sensor_init(&sensor, &volts));
	expect(&sensor, 0.1, -40, 1e-6);
	expect(&sensor, 0.2, 0, 1e-6);
	expect(&sensor, 0.5, 200, 1e-6);
	expect(&sensor, 0.8, 400, 1e-6);
	expect_none(&sensor, 0.05, SENSOR_SHORTED);
	expect_none(&sensor, 0.81, SENSOR_OPEN);
	assert_null(sensor_init(&sensor, &ohm));
	expect(&sensor, reading_of(1000, 4550), 110, 1e-6);
	expect_none(&sensor, reading_of(1000, 99), SENSOR_SHORTED);
	expect_none(&sensor, reading_of(1000, 9001), SENSOR_OPEN);
}

static void what_is_no_temperature(void **state)
{
	static const double none[] = { NAN, INFINITY, -INFINITY, -0.01, 1.01, 1e300 };
	static const struct sensor_config platinum = { .kind = SENSOR_PLATINUM,
						       .pull_up = 4700,
						       .ohm = 1000 };
	struct sensor sensor;
	double celsius;

	(void)state;
	for (int kind = 0; kind < 2; kind++) {
		assert_null(sensor_init(&sensor, kind ? &platinum : &beta));
		for (size_t i = 0; i < sizeof(none) / sizeof(none[0]); i++)
			expect_none(&sensor, none[i], SENSOR_ODD);
		expect_none(&sensor, 1, SENSOR_OPEN);
		expect_none(&sensor, 0.9995, SENSOR_OPEN);
		expect_none(&sensor, 0, SENSOR_SHORTED);
		expect_none(&sensor, 0.0005, SENSOR_SHORTED);
		/* whatever is read, it is a number or it is none */
		for (int i = -10; i <= 4200; i++)
			if (sensor_read(&sensor, i / 4095.0, &celsius) == SENSOR_GOOD)
				assert_true(isfinite(celsius) && celsius >= -273.15);
	}
}

static void configurations_are_judged(void **state)
{
	static const struct {
		struct sensor_config config;
		const char *says;
	} bad[] = {
		{ { .kind = SENSOR_BETA, .ohm = 1, .beta = 1 }, "pull-up" },
		{ { .kind = SENSOR_BETA, .pull_up = NAN, .ohm = 1, .beta = 1 }, "pull-up" },
		{ { .kind = SENSOR_BETA, .pull_up = 1, .ohm = 1 }, "beta" },
		{ { .kind = SENSOR_BETA, .pull_up = 1, .beta = 1, .ohm = 1, .celsius = -300 },
		  "temperature" },
		{ { .kind = SENSOR_STEINHART, .pull_up = 1, .points = { { 1, 2 }, { 2, 1 } } },
		  "each of the three" },
		{ { .kind = SENSOR_STEINHART,
		    .pull_up = 1,
		    .points = { { 1, 3 }, { 2, 2 }, { 2, 1 } } },
		  "rising ohm" },
		{ { .kind = SENSOR_STEINHART,
		    .pull_up = 1,
		    .points = { { 1, 3 }, { 2, 2 }, { 3, 2 } } },
		  "rising ohm" },
		/* the middle one is nowhere near the others */
		{ { .kind = SENSOR_STEINHART,
		    .pull_up = 1,
		    .points = { { 100, 300 }, { 90e3, 299 }, { 100e3, 25 } } },
		  "no thermistor" },
		{ { .kind = SENSOR_PLATINUM, .pull_up = 1 }, "platinum" },
		{ { .kind = SENSOR_LINEAR, .volts_per_kelvin = 1 }, "reference" },
		{ { .kind = SENSOR_LINEAR, .reference = 5 }, "each kelvin" },
		{ { .kind = SENSOR_LINEAR, .reference = 5, .volts_per_kelvin = NAN },
		  "each kelvin" },
		{ { .kind = SENSOR_TABLE, .reference = 5, .count = 1 }, "2 to 32" },
		{ { .kind = SENSOR_TABLE, .reference = 5, .count = 33 }, "2 to 32" },
		{ { .kind = SENSOR_TABLE,
		    .reference = 5,
		    .count = 2,
		    .points = { { 1, 1 }, { 1, 2 } } },
		  "rising order" },
		{ { .kind = SENSOR_TABLE,
		    .reference = 5,
		    .count = 2,
		    .points = { { 1, 1 }, { 2, 1 } } },
		  "rise, or" },
		{ { .kind = SENSOR_TABLE,
		    .reference = 5,
		    .count = 3,
		    .points = { { 1, 1 }, { 2, 3 }, { 3, 2 } } },
		  "rise, or" },
		{ { .kind = SENSOR_TABLE,
		    .reference = 5,
		    .count = 2,
		    .points = { { NAN, 1 }, { 2, 3 } } },
		  "no pair" },
	};
	struct sensor sensor;

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		const char *why = sensor_init(&sensor, &bad[i].config);

		if (!why || !strstr(why, bad[i].says))
			fail_msg("configuration %zu: %s", i, why ? why : "it was taken");
	}
}

static void its_range_is_known(void **state)
{
	static const struct sensor_config table = {
		.kind = SENSOR_TABLE,
		.reference = 5,
		.count = 2,
		.points = { { 0.5, -40 }, { 4, 270 } },
	};
	struct sensor sensor;
	double coldest, hottest;

	(void)state;
	assert_null(sensor_init(&sensor, &beta));
	sensor_range(&sensor, &coldest, &hottest);
	assert_true(coldest < -30 && hottest > 400);
	assert_null(sensor_init(&sensor, &table));
	sensor_range(&sensor, &coldest, &hottest);
	assert_true(fabs(coldest + 40) < 1 && fabs(hottest - 270) < 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(beta_thermistors_follow_their_equation),
		cmocka_unit_test(three_points_are_a_thermistor),
		cmocka_unit_test(platinum_is_that_of_the_standard),
		cmocka_unit_test(amplifiers_and_tables),
		cmocka_unit_test(what_is_no_temperature),
		cmocka_unit_test(its_range_is_known),
		cmocka_unit_test(configurations_are_judged),
	};

	return cmocka_run_group_tests_name("sensor", tests, NULL, NULL);
}
