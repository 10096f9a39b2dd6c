/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A servo motor's life: off, enabled, stopped by a fault.
 *
 * The output is PID, with feed-forward of what is commanded. A new target makes no kick, because
 * whoever commands it commands a path and its speed; and an axis is enabled only where it is. What
 * a limit cuts off does not fill the integral (as in pid.c).
 *
 * A fault is latched, and the output is 0 in the step that finds it. Off has to be commanded before
 * the axis is enabled again: a program that knows nothing of the fault commands "on" all the time.
 * While it is off, a lost device or an emergency stop is no fault: the axis only cannot be enabled.
 */

#include "daemon/loops/servo.h"

#include <math.h>
#include <stddef.h>

#include "daemon/loops/servo_part.h"

#define GAIN_MOST 1e6
#define STALE_MOST_NS UINT64_C(100000000)
#define STALL_MOST_NS UINT64_C(10000000000)
#define LONGEST 0.1		/* no step integrates more than this, seconds */

const struct servo_config servo_usual = {
	.scale = 1000, .least = -INFINITY, .most = INFINITY, .speed_most = 100,
	.speed_jump = 500, .gains = { .p = 1, .d = 0.01 }, .integral_most = 0.5, .output_most = 1,
	.smooth = 0.002, .follow_least = 0.5, .follow_most = 2,
	.stall_output = 0.9, .stall_move = 0.1, .stall_ns = UINT64_C(300000000),
	.runaway_output = 0.1, .runaway_move = 0.2, .stale_ns = UINT64_C(5000000),
};

static bool is_gain(double value)
{
	return value >= 0 && value <= GAIN_MOST;
}

static const char *judge_gains(const struct servo_gains *gains)
{
	if (!is_gain(gains->p) || !is_gain(gains->i) || !is_gain(gains->d) ||
	    !is_gain(gains->velocity) || !is_gain(gains->acceleration))
		return "pid-p, pid-i, pid-d, velocity-gain and acceleration-gain have to be "
		       "numbers from 0 to 1000000";
	if (gains->p == 0 && gains->i == 0)
		return "pid-p and pid-i are both 0: nothing would hold the axis";
	return NULL;
}

static bool is_part(double value)
{
	return value > 0 && value <= 1;
}

static bool is_way(double value)
{
	return value > 0 && isfinite(value);
}

static const char *judge_watch(const struct servo_config *config)
{
	if (!is_way(config->follow_least) || !is_way(config->follow_most) ||
	    config->follow_most < config->follow_least)
		return "min-following-error has to be above 0, max-following-error at least that";
	if (!is_part(config->stall_output) || !is_way(config->stall_move) || !config->stall_ns ||
	    config->stall_ns > STALL_MOST_NS)
		return "stall-output has to be above 0 and at most 1, stall-distance above 0, "
		       "stall-s above 0 and at most 10";
	if (config->stall_output > config->output_most)
		return "stall-output is above max-output: it would never be reached";
	if (!(config->runaway_output >= 0 && config->runaway_output < config->output_most) ||
	    !is_way(config->runaway_move))
		return "runaway-output has to be 0 or more and below max-output, "
		       "runaway-distance above 0";
	if (!config->stale_ns || config->stale_ns > STALE_MOST_NS)
		return "max-age-ms has to be above 0 and at most 100";
	return NULL;
}

static const char *judge(const struct servo_config *config)
{
	if (!isfinite(config->scale) || config->scale == 0)
		return "counts-per-unit has to be a number other than 0";
	if (!(config->least < config->most))
		return "min-position has to be below max-position";
	if (!is_way(config->speed_most) || !is_way(config->speed_jump) ||
	    config->speed_jump <= config->speed_most)
		return "max-speed has to be above 0, impossible-speed above max-speed";
	if (!(config->deadband >= 0 && config->deadband < config->follow_least))
		return "deadband has to be 0 or more, and below min-following-error";
	if (!is_part(config->output_most))
		return "max-output has to be above 0 and at most 1";
	if (!(config->integral_most >= 0 && config->integral_most <= config->output_most))
		return "max-integral has to be 0 or more, and at most max-output";
	if (!(config->smooth >= 0 && config->smooth <= 1))
		return "smooth-s has to be 0 to 1";
	return judge_watch(config);
}

const char *servo_init(struct servo *servo, const struct servo_config *config)
{
	const char *why = judge(config);

	*servo = (struct servo){ .config = *config, .condition = SERVO_STALE,
				 .low_at = NAN, .high_at = NAN };
	return why ? why : judge_gains(&config->gains);
}

static double limited(double value, double most)
{
	return value < -most ? -most : value > most ? most : value;
}

static void stop(struct servo *servo)
{
	servo->enabled = false;
	servo->armed = false;
	servo->output = servo->integral = servo->error = 0;
	servo->wanted_rate = servo->wanted_acceleration = 0;
}

/* The error stays to be seen, until off is commanded. */
static void fail(struct servo *servo, enum servo_fault fault)
{
	const double error = servo->error;

	if (!servo->fault)
		servo->fault = fault;
	stop(servo);
	servo->error = error;
}

/* May it be enabled here and now? */
static enum servo_refusal judge_enable(const struct servo *servo, const struct servo_wish *wish)
{
	if (servo->fault)
		return SERVO_AFTER_FAULT;
	if (servo->condition)
		return SERVO_NOT_READY;
	/* written so that no number is refused */
	if (!(fabs(wish->position - servo->position) <= servo->config.follow_least))
		return SERVO_ELSEWHERE;
	return SERVO_TAKEN;
}

static void look_at_enable(struct servo *servo, const struct servo_input *input,
			   const struct servo_wish *wish, uint64_t now_ns)
{
	if (!wish->alive) {
		stop(servo);
		return;
	}
	if (!wish->enable) {
		stop(servo);
		servo->armed = true;
		servo->refusal = SERVO_TAKEN;
		return;
	}
	if (servo->enabled)
		return;
	if (!servo->armed) {
		servo->refusal = servo->refusal ? servo->refusal : SERVO_OFF_FIRST;
		return;
	}
	servo->armed = false;
	servo->refusal = judge_enable(servo, wish);
	if (servo->refusal)
		return;
	servo->enabled = true;
	servo->wanted = wish->position;
	servo_watch_begin(servo, input, now_ns);
}

/* Speed and acceleration that are commanded. */
static void follow_command(struct servo *servo, const struct servo_wish *wish, double seconds)
{
	const double part = seconds / (servo->config.smooth + seconds);
	const double before = servo->wanted_rate;

	if (!(seconds > 0))
		return;
	if (!isnan(wish->velocity))
		servo->wanted_rate = wish->velocity;
	else
		servo->wanted_rate += ((wish->position - servo->wanted) / seconds -
				       servo->wanted_rate) * part;
	servo->wanted_acceleration += ((servo->wanted_rate - before) / seconds -
				       servo->wanted_acceleration) * part;
	servo->wanted = wish->position;
}

/* No axis can do what it says. An unknown speed is none of that. */
static bool is_odd(const struct servo *servo, const struct servo_wish *wish)
{
	return !isfinite(wish->position) || fabs(wish->velocity) > servo->config.speed_jump;
}

static bool is_too_far(const struct servo *servo)
{
	const struct servo_config *config = &servo->config;
	const double part = fmin(fabs(servo->wanted_rate) / config->speed_most, 1);

	return fabs(servo->error) > fmax(config->follow_least, config->follow_most * part);
}

/* The output but for the integral; `error`: what is counted as one. */
static double unintegrated(const struct servo *servo, const struct servo_gains *gains, double error)
{
	return gains->p * error + gains->d * (servo->wanted_rate - servo->rate) +
	       gains->velocity * servo->wanted_rate +
	       gains->acceleration * servo->wanted_acceleration;
}

static double counted_error(const struct servo *servo)
{
	return fabs(servo->error) <= servo->config.deadband ? 0 : servo->error;
}

static double controlled(struct servo *servo, double seconds)
{
	const struct servo_config *config = &servo->config;
	const double error = counted_error(servo);
	const double more = config->gains.i * error * seconds;
	const double rest = unintegrated(servo, &config->gains, error);
	const double output = rest + servo->integral + more;

	if (!(output > config->output_most && more > 0) &&
	    !(output < -config->output_most && more < 0))
		servo->integral = limited(servo->integral + more, config->integral_most);
	return limited(rest + servo->integral, config->output_most);
}

/* What is wrong while it is enabled. */
static enum servo_fault run(struct servo *servo, const struct servo_input *input,
			    const struct servo_wish *wish, const struct servo_way *way,
			    uint64_t now_ns)
{
	const double seconds = fmin((double)since(servo->step_ns, now_ns) / SECOND, LONGEST);
	enum servo_fault found = servo->condition;

	if (!found && is_odd(servo, wish))
		found = SERVO_ODD;
	if (!found)
		found = servo_watch(servo, input, wish->position, way, now_ns);
	if (found)
		return found;
	follow_command(servo, wish, seconds);
	servo->error = wish->position - servo->position;
	if (is_too_far(servo))
		return SERVO_FOLLOWING;
	servo->output = controlled(servo, seconds);
	return isfinite(servo->output) ? SERVO_FINE : SERVO_ODD;
}

double servo_step(struct servo *servo, const struct servo_input *input,
		  const struct servo_wish *wish, uint64_t now_ns)
{
	struct servo_way way;

	servo->condition = servo_measure(servo, input, &way, now_ns);
	look_at_enable(servo, input, wish, now_ns);
	if (servo->enabled) {
		const enum servo_fault found = run(servo, input, wish, &way, now_ns);

		if (found)
			fail(servo, found);
	}
	servo->step_ns = now_ns;
	return servo->output;
}

bool servo_reset(struct servo *servo)
{
	if (servo->condition)
		return false;
	servo->fault = SERVO_FINE;
	return true;
}

void servo_another(struct servo *servo)
{
	stop(servo);
	servo->refusal = SERVO_TAKEN;
}

bool servo_place(struct servo *servo, double position, bool homed)
{
	if (servo->enabled || !servo->primed || !isfinite(position))
		return false;
	servo->offset += position - servo->position;
	servo->position = position;
	servo->homed = homed;
	return true;
}

bool servo_regain(struct servo *servo, const struct servo_gains *gains)
{
	const double error = counted_error(servo);
	const double before = unintegrated(servo, &servo->config.gains, error);

	if (judge_gains(gains))
		return false;
	/* At a limit nothing goes on, and the integral would be filled with what was cut off. */
	if (servo->enabled && fabs(before + servo->integral) < servo->config.output_most)
		servo->integral = limited(servo->integral + before -
					  unintegrated(servo, gains, error),
					  servo->config.integral_most);
	servo->config.gains = *gains;
	return true;
}
