// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * How well the daemon's controllers control, with LinuxCNC's own `pid` beside them: the same plant,
 * the same gains, the same readings, in virtual time. So a figure is the same in each run.
 *
 *	bench-control [PID_MODULE]
 */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include "tests/loops/axis.h"
#include "tests/loops/oven.h"
#ifdef HAVE_HAL
#include "tests/halbridge/fake_hal.h"
#endif

#define SCREW 5.0		/* mm a turn */
#define SPEED 200.0		/* mm/s */
#define ACCELERATION 2000.0	/* mm/s^2 */
#define WAY 100.0		/* mm */
#define TORQUE 0.05		/* newton metres, from outside */
#define SETTLED_MM 0.02
#define SETTLED_K 1.0

enum { HEAT_S = 1200, FAN_S = 600 };

/* LinuxCNC's component, one loop of it. */
static struct {
	bool there;
	double *command, *feedback, *output;
	void (*run)(void *argument, long period);
	void *argument;
} other;

#ifdef HAVE_HAL
static void *value(const char *name)
{
	void *at = fake_hal_value(name);

	if (!at) {
		fprintf(stderr, "bench-control: LinuxCNC's pid has no pin %s\n", name);
		exit(1);
	}
	return at;
}

static void set(const char *name, double to)
{
	*(double *)value(name) = to;
}

static void load(const char *path)
{
	static struct fake_module module;
	struct fake_funct funct;

	if (fake_hal_load_plain(&module, path)) {
		fprintf(stderr, "bench-control: %s cannot be loaded\n", path);
		exit(1);
	}
	funct = fake_hal_funct("pid.0.do-pid-calcs");
	other.run = funct.run;
	other.argument = funct.argument;
	other.command = value("pid.0.command");
	other.feedback = value("pid.0.feedback");
	other.output = value("pid.0.output");
	other.there = true;
}

/* An integral that is limited as ours is, in units of the output. */
static void prepare(double p, double i, double d, double ff1, double ff2, double integral_most)
{
	set("pid.0.Pgain", p);
	set("pid.0.Igain", i);
	set("pid.0.Dgain", d);
	set("pid.0.FF1", ff1);
	set("pid.0.FF2", ff2);
	set("pid.0.maxoutput", 1);
	set("pid.0.maxerrorI", i > 0 ? integral_most / i : 0);
	*(volatile bool *)value("pid.0.enable") = true;
}
#else
static void load(const char *path)
{
	(void)path;
	fprintf(stderr, "bench-control: built without LinuxCNC's headers\n");
	exit(1);
}

static void prepare(double p, double i, double d, double ff1, double ff2, double integral_most)
{
	(void)p;
	(void)i;
	(void)d;
	(void)ff1;
	(void)ff2;
	(void)integral_most;
}
#endif

static double ask_other(double command, double feedback, long period_ns)
{
	*other.command = command;
	*other.feedback = feedback;
	other.run(other.argument, period_ns);
	return *other.output;
}

/* What a controller made of it. */
struct result {
	double worst, square, overshoot, settled_s, disturbed, recovered_s;
	long samples;
};

/* Servo motor. */

static double place(const struct axis *axis)
{
	return axis->motor.angle / (2 * M_PI) * SCREW;
}

/* A cycle. Ours goes on beside the other, as it takes the readings, but does not drive. */
static void cycle(struct axis *axis, bool ours)
{
	axis_step(axis);
	if (!ours)
		axis->output = ask_other(axis->wish.position, axis->servo.position, 1000000);
}

static void begin_axis(struct axis *axis, bool ours)
{
	struct servo_config config = axis_config;

	/* what watches it is no part of this */
	config.follow_least = config.follow_most = 50;
	config.stall_s = config.silent_s = 1;
	config.silent_output = 1;
	config.runaway_move = 50;
	axis_init(axis, &config, &sim_motor_small);
	if (!ours)
		prepare(config.gains.p, config.gains.i, config.gains.d, config.gains.velocity,
			config.gains.acceleration, config.integral_most);
	axis_enable(axis);
	for (int k = 0; k < 100; k++)
		cycle(axis, ours);
}

/* Until it is settled for half a second; when that began. */
static double settle_axis(struct axis *axis, bool ours, struct result *result, double from)
{
	double last = 0;

	for (int k = 1; k <= 2000; k++) {
		const double off = place(axis) - axis->wish.position;

		cycle(axis, ours);
		if (fabs(place(axis) - axis->wish.position) > SETTLED_MM)
			last = k * 0.001;
		result->overshoot = fmax(result->overshoot,
					 from < axis->wish.position ? off : -off);
		result->disturbed = fmax(result->disturbed, fabs(off));
	}
	return last;
}

static struct result move_axis(bool ours)
{
	struct result result = { .samples = 0 };
	struct axis axis;
	double left = WAY, now = 0;

	begin_axis(&axis, ours);
	while (left > 0) {
		const double stop = sqrt(2 * ACCELERATION * left) - ACCELERATION * 0.001;
		double off;

		now = fmin(fmin(now + ACCELERATION * 0.001, SPEED),
			   fmax(stop, ACCELERATION * 0.001));
		left = fmax(left - now * 0.001, 0);
		axis.wish.position = WAY - left;
		axis.wish.velocity = now;
		cycle(&axis, ours);
		off = place(&axis) - axis.wish.position;
		result.worst = fmax(result.worst, fabs(off));
		result.square += off * off;
		result.samples++;
	}
	axis.wish.velocity = 0;
	result.settled_s = settle_axis(&axis, ours, &result, 0);
	result.disturbed = 0;
	axis.motor.torque = TORQUE;
	result.recovered_s = settle_axis(&axis, ours, &(struct result){ 0 }, 0);
	axis.motor.torque = 0;
	settle_axis(&axis, ours, &result, 0);
	return result;
}

/* Heater. */

/* Ours measures in any case. */
static void period(struct oven *oven, bool ours)
{
	oven_step(oven);
	if (!ours)
		oven->power = fmax(ask_other(oven->target, oven->heater.temperature, 100000000), 0);
}

static struct pid_gains gains_for(const struct sim_heat_config *plant, double target)
{
	static struct oven oven;
	struct heater_config config = heater_usual;

	config.gains = (struct pid_gains){ .p = 1, .i = 1 };
	oven_init(&oven, &config, plant);
	heater_tune(&oven.heater, target);
	for (int k = 0; k < 40000 && oven.heater.tune.state == TUNE_RUNS; k++)
		oven_step(&oven);
	return oven.heater.tune.gains;
}

static double settle_oven(struct oven *oven, bool ours, int seconds, double *most, double *least)
{
	double last = 0;

	*most = -INFINITY;
	*least = INFINITY;
	for (int k = 1; k <= seconds * 10; k++) {
		period(oven, ours);
		if (fabs(oven->heat.sensor - oven->target) > SETTLED_K)
			last = k * 0.1;
		*most = fmax(*most, oven->heat.sensor);
		*least = fmin(*least, oven->heat.sensor);
	}
	return last;
}

static struct result heat(const struct sim_heat_config *plant, double target, bool ours)
{
	static struct oven oven;
	struct heater_config config = heater_usual;
	struct result result = { .samples = HEAT_S * 10 };
	double most, least;

	config.gains = gains_for(plant, target);
	oven_init(&oven, &config, plant);
	if (!ours)
		prepare(config.gains.p, config.gains.i, config.gains.d, 0, 0, 1);
	for (int k = 0; k < 10; k++)
		period(&oven, ours);
	oven.target = target;
	result.settled_s = settle_oven(&oven, ours, HEAT_S, &most, &least);
	result.overshoot = fmax(most - target, 0);
	oven.fan = true;
	result.recovered_s = settle_oven(&oven, ours, FAN_S, &most, &least);
	result.disturbed = target - least;
	return result;
}

static void print_servo(const char *name, bool ours)
{
	const struct result result = move_axis(ours);

	printf("\"%s\": {\"worst_mm\": %.4f, \"rms_mm\": %.4f, \"overshoot_mm\": %.4f, "
	       "\"settled_s\": %.3f, \"disturbed_mm\": %.4f, \"recovered_s\": %.3f, "
	       "\"samples\": %ld}",
	       name, result.worst, sqrt(result.square / (double)result.samples), result.overshoot,
	       result.settled_s, result.disturbed, result.recovered_s, result.samples);
}

static void print_heater(const char *name, const struct sim_heat_config *plant, double target,
			 bool ours)
{
	const struct result result = heat(plant, target, ours);

	printf("\"%s\": {\"overshoot_k\": %.2f, \"settled_s\": %.1f, \"disturbed_k\": %.2f, "
	       "\"recovered_s\": %.1f, \"samples\": %ld}",
	       name, result.overshoot, result.settled_s, result.disturbed, result.recovered_s,
	       result.samples);
}

int main(int argc, char **argv)
{
	static const struct {
		const char *name;
		const struct sim_heat_config *plant;
		double target;
	} heaters[] = { { "hotend", &sim_heat_hotend, 210 }, { "bed", &sim_heat_bed, 90 } };

	if (argc > 1)
		load(argv[1]);
	printf("{\"servo\": {");
	print_servo("ours", true);
	if (other.there) {
		printf(", ");
		print_servo("linuxcnc", false);
	}
	for (size_t i = 0; i < sizeof(heaters) / sizeof(heaters[0]); i++) {
		printf("}, \"%s\": {", heaters[i].name);
		print_heater("ours", heaters[i].plant, heaters[i].target, true);
		if (other.there) {
			printf(", ");
			print_heater("linuxcnc", heaters[i].plant, heaters[i].target, false);
		}
	}
	printf("}}\n");
	return 0;
}
