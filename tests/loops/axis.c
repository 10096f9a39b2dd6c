/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The count that a step sees is that of the end of the cycle before, and its output acts from now
 * on: a controller that is stable here has the delays of a network in its loop.
 */
#include "tests/loops/axis.h"

#include <math.h>

#define SECOND 1e9

const struct servo_config axis_config = {
	.scale = 400,
	.least = -INFINITY,
	.most = INFINITY,
	.speed_most = 300,
	.speed_jump = 800,
	.gains = { .p = 1, .i = 10, .d = 0.01, .velocity = 0.00262, .acceleration = 5.2e-5 },
	.integral_most = 0.5,
	.output_most = 1,
	.smooth = 0.001,
	.follow_least = 0.5,
	.follow_most = 2,
	.stall_output = 0.9,
	.stall_move = 0.1,
	.stall_s = 0.2,
	.silent_output = 0.2,
	.silent_s = 0.02,
	.runaway_output = 0.1,
	.runaway_move = 0.2,
	.stale_ns = UINT64_C(5000000),
};

void axis_init(struct axis *axis, const struct servo_config *config,
	       const struct sim_motor_config *motor)
{
	const char *why;

	*axis = (struct axis){ .now_ns = UINT64_C(1000000000),
			       .input = { .usable = true },
			       .wish = { .alive = true } };
	sim_motor_init(&axis->motor, motor);
	why = servo_init(&axis->servo, config);
	if (why)
		fail_msg("%s", why);
	axis->count_ns = axis->now_ns;
	axis_step(axis);
}

void axis_step(struct axis *axis)
{
	sim_motor_run(&axis->motor, (double)AXIS_CYCLE_NS / SECOND, axis->output);
	axis->now_ns += AXIS_CYCLE_NS;
	axis->input.counts = axis->count;
	axis->input.read_ns = axis->count_ns;
	if (!axis->silent) {
		axis->count = sim_motor_count(&axis->motor);
		axis->count_ns = axis->now_ns;
	}
	axis->output = servo_step(&axis->servo, &axis->input, &axis->wish, axis->now_ns);
	axis->most = fmax(axis->most, fabs(axis->servo.error));
}

void axis_run(struct axis *axis, double seconds)
{
	for (long cycles = lround(seconds * 1000); cycles > 0; cycles--)
		axis_step(axis);
}

void axis_enable(struct axis *axis)
{
	axis->wish.enable = false;
	axis_run(axis, 0.01);
	axis->wish.position = axis->servo.position;
	axis->wish.velocity = 0;
	axis->wish.enable = true;
	axis_step(axis);
	assert_true(axis->servo.enabled);
}

bool axis_reset(struct axis *axis)
{
	return servo_reset(&axis->servo, &axis->input, &axis->wish);
}

void axis_move(struct axis *axis, double to, double speed, double acceleration)
{
	const double direction = to < axis->wish.position ? -1 : 1, dt = 0.001;
	double now = 0, left = fabs(to - axis->wish.position);

	while (left > 0) {
		/* as fast as it can still stop, with what it goes on in this cycle */
		const double stop = sqrt(2 * acceleration * left) - acceleration * dt;

		now = fmin(fmin(now + acceleration * dt, speed), fmax(stop, acceleration * dt));
		left -= now * dt;
		if (left <= 0)
			now = left = 0;
		axis->wish.position = to - direction * left;
		axis->wish.velocity = direction * now;
		axis_step(axis);
	}
	axis_step(axis);
}

double axis_until_fault(struct axis *axis, double seconds)
{
	const uint64_t begun_ns = axis->now_ns;

	while (!axis->servo.fault) {
		axis_step(axis);
		if ((double)(axis->now_ns - begun_ns) > seconds * SECOND)
			return -1;
	}
	/* in the cycle that finds it */
	assert_true(axis->output == 0 && !axis->servo.enabled);
	return (double)(axis->now_ns - begun_ns) / SECOND;
}

void axis_expect_fault(const struct axis *axis, enum servo_fault fault)
{
	assert_int_equal(axis->servo.fault, fault);
}
