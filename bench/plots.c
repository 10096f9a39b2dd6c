// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What gains do to a motor and to a heater: the curves of docs/servos.md and docs/loops.md, in
 * virtual time. For bench/plots.gp; each curve is a block of its own.
 *
 *	bench-plots servo | heater
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "tests/loops/axis.h"
#include "tests/loops/oven.h"

#define SPEED 100.0		/* mm/s */
#define ACCELERATION 1000.0	/* mm/s^2 */
#define WAY 20.0		/* mm */
#define PULL 0.06		/* newton metres, from outside */

enum { MOVE_MS = 700, PULL_MS = 450, HEAT_S = 900 };

/* A move, and at its end a pull on the shaft: seconds, commanded speed in mm/s, error in mm. */
static void plot_move(const struct servo_gains *gains)
{
	struct servo_config config = axis_config;
	double left = WAY, now = 0;
	struct axis axis;

	config.gains = *gains;
	config.follow_least = config.follow_most = 50;
	axis_init(&axis, &config, &sim_motor_small);
	axis_enable(&axis);
	axis_run(&axis, 0.1);
	for (int k = 0; k < MOVE_MS; k++) {
		const double stop = sqrt(2 * ACCELERATION * left) - ACCELERATION * 0.001;

		now = fmin(fmin(now + ACCELERATION * 0.001, SPEED),
			   fmax(stop, ACCELERATION * 0.001));
		now = left > 0 ? now : 0;
		left = fmax(left - now * 0.001, 0);
		axis.wish.position = WAY - left;
		axis.wish.velocity = now;
		axis.motor.torque = k >= PULL_MS ? PULL : 0;
		axis_step(&axis);
		printf("%.3f %.1f %.5f\n", k * 0.001, now, axis.servo.error);
	}
	printf("\n\n");
}

static void plot_servo(void)
{
	const struct servo_gains all = axis_config.gains;
	const struct servo_gains curves[] = {
		{ .p = all.p },
		{ .p = all.p, .d = all.d },
		{ .p = all.p, .d = all.d, .velocity = all.velocity },
		{ .p = all.p,
		  .d = all.d,
		  .velocity = all.velocity,
		  .acceleration = all.acceleration },
		all,
	};

	for (size_t i = 0; i < sizeof(curves) / sizeof(curves[0]); i++)
		plot_move(&curves[i]);
}

static struct pid_gains found_for(double target)
{
	struct heater_config config = heater_usual;
	static struct oven oven;

	config.gains = (struct pid_gains){ .p = 1, .i = 1 };
	oven_init(&oven, &config, &sim_heat_bed);
	heater_tune(&oven.heater, target);
	for (int k = 0; k < 40000 && oven.heater.tune.state == TUNE_RUNS; k++)
		oven_step(&oven);
	return oven.heater.tune.gains;
}

/* Heated up, and a fan from two thirds of the time on: seconds, degrees C, power in %. */
static void plot_heat(const struct pid_gains *gains, double target)
{
	struct heater_config config = heater_usual;
	static struct oven oven;

	config.gains = *gains;
	oven_init(&oven, &config, &sim_heat_bed);
	oven_run(&oven, 1);
	oven.target = target;
	for (int k = 0; k < HEAT_S * 10; k++) {
		oven.fan = k >= HEAT_S * 10 * 2 / 3;
		oven_step(&oven);
		if (k % 10 == 0)
			printf("%d %.2f %.1f\n", k / 10, oven.heat.sensor, oven.power * 100);
	}
	printf("\n\n");
}

static void plot_heater(void)
{
	const double target = 60;
	const struct pid_gains found = found_for(target);
	struct pid_gains much_i = found, little = found;

	much_i.p /= 4;
	much_i.i *= 2;
	much_i.d = 0;
	little.p /= 8;
	little.i /= 8;
	little.d /= 8;
	plot_heat(&found, target);
	plot_heat(&much_i, target);
	plot_heat(&little, target);
}

int main(int argc, char **argv)
{
	if (argc == 2 && !strcmp(argv[1], "servo")) {
		plot_servo();
		return 0;
	}
	if (argc == 2 && !strcmp(argv[1], "heater")) {
		plot_heater();
		return 0;
	}
	fprintf(stderr, "usage: bench-plots servo | heater\n");
	return 64;
}
