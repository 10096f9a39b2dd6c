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
#define COUNTS_MOST 1e8		/* a second: what no encoder has */
#define PLACE_MOST 1125899906842624.0	/* counts; a double has room for parts of one */
#define WAY_LEAST 4		/* counts: less is noise */
#define STALL_MOST 10.0		/* seconds */
#define BRIDGE_S 0.1		/* time constant, from old gains to new ones */
#define LONGEST_NS UINT64_C(100000000)	/* between two commanded positions of one motion */

const struct servo_config servo_usual = {
	.scale = 1000,
	.least = -INFINITY,
	.most = INFINITY,
	.speed_most = 100,
	.speed_jump = 500,
	.gains = { .p = 1, .d = 0.01 },
	.integral_most = 0.5,
	.output_most = 1,
	.smooth = 0.002,
	.follow_least = 0.5,
	.follow_most = 2,
	.stall_output = 0.9,
	.stall_move = 0.1,
	.stall_s = 0.3,
	.silent_output = 0.2,
	.silent_s = 0.02,
	.runaway_output = 0.1,
	.runaway_move = 0.2,
	.stale_ns = UINT64_C(10000000),
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

static bool is_above(double value)
{
	return value > 0 && isfinite(value);
}

/* Far enough that counts tell it. */
static bool is_way(const struct servo_config *config, double value)
{
	return isfinite(value) && value * fabs(config->scale) >= WAY_LEAST;
}

static const char *judge_motion(const struct servo_config *config)
{
	if (!is_way(config, config->follow_least) || !isfinite(config->follow_most) ||
	    config->follow_most < config->follow_least)
		return "min-following-error has to be 4 counts or more, and max-following-error "
		       "at least that";
	if (!is_part(config->stall_output) || !is_way(config, config->stall_move) ||
	    !(config->stall_s > 0 && config->stall_s <= STALL_MOST))
		return "stall-output has to be above 0 and at most 1, stall-distance 4 counts or "
		       "more, stall-s above 0 and at most 10";
	if (config->stall_output > config->output_most)
		return "stall-output is above max-output: it would never be reached";
	if (!is_part(config->silent_output) || !is_part(config->silent_s))
		return "silent-output and silent-s have to be above 0 and at most 1";
	if (!(config->runaway_output >= 0 && config->runaway_output < config->output_most) ||
	    !is_way(config, config->runaway_move))
		return "runaway-output has to be 0 or more and below max-output, and "
		       "runaway-distance 4 counts or more";
	if (!config->stale_ns || config->stale_ns > SERVO_STALE_MOST_NS)
		return "max-age-ms has to be above 0 and at most 100";
	return NULL;
}

static const char *judge(const struct servo_config *config)
{
	if (!isnormal(config->scale))
		return "counts-per-unit has to be a number other than 0";
	if (!(config->least < config->most))
		return "min-position has to be below max-position";
	if (!is_above(config->speed_most) || !is_above(config->speed_jump) ||
	    config->speed_jump <= config->speed_most)
		return "max-speed has to be above 0, and impossible-speed above max-speed";
	if (!(config->speed_jump * fabs(config->scale) <= COUNTS_MOST))
		return "impossible-speed is more than 100000000 counts a second";
	if (!(config->deadband >= 0 && config->deadband < config->follow_least))
		return "deadband has to be 0 or more, and below min-following-error";
	if (!is_part(config->output_most))
		return "max-output has to be above 0 and at most 1";
	if (!(config->integral_most >= 0 && config->integral_most <= config->output_most))
		return "max-integral has to be 0 or more, and at most max-output";
	if (!(config->smooth >= 0 && config->smooth <= 1))
		return "smooth-s has to be 0 to 1";
	return judge_motion(config);
}

const char *servo_init(struct servo *servo, const struct servo_config *config)
{
	const char *why = judge(config);

	*servo = (struct servo){
		.config = *config, .condition = SERVO_STALE, .low_at = NAN, .high_at = NAN
	};
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
	servo->output = servo->integral = servo->bridge = servo->error = servo->rate_error = 0;
	servo->wanted_rate = servo->wanted_acceleration = 0;
}

/* The error stays to be seen, until off is commanded. */
static void fail(struct servo *servo, enum servo_fault fault)
{
	const double error = servo->error;

	servo->fault = fault;
	stop(servo);
	servo->error = error;
}

/* May it be enabled here and now? */
static enum servo_refusal judge_enable(const struct servo *servo, const struct servo_wish *wish)
{
	if (servo->fault)
		return SERVO_AFTER_FAULT;
	if (wish->blind)
		return SERVO_UNREAD;
	if (servo->condition)
		return SERVO_NOT_READY;
	if (fabs(wish->position - servo->position) > servo->config.follow_least)
		return SERVO_ELSEWHERE;
	return SERVO_TAKEN;
}

static void look_at_enable(struct servo *servo, const struct servo_wish *wish, uint64_t now_ns)
{
	/* a commander repeats what was refused as unread, but not after a stop or a loss */
	if (servo->refusal == SERVO_UNREAD && (!wish->alive || servo->condition))
		servo->refusal = SERVO_OFF_FIRST;
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
	servo->changed_ns = now_ns;
	servo->interval_ns = 0;
	servo_watch_begin(servo, wish->position);
}

/*
 * The commander may be slower than the cycle. Its speed is that from one position to the next, and
 * goes on until the next one would have been there for as long again.
 */
static void estimate_rate(struct servo *servo, double position, uint64_t now_ns)
{
	const uint64_t passed_ns = since(servo->changed_ns, now_ns);

	servo->wanted_acceleration = 0;
	if (position != servo->wanted && passed_ns) {
		servo->interval_ns = passed_ns < LONGEST_NS ? passed_ns : 0;
		servo->changed_ns = now_ns;
		/* a jump is no speed, and must not be fed forward as one */
		servo->wanted_rate = servo->interval_ns ?
					     limited((position - servo->wanted) /
							     ((double)passed_ns / SECOND),
						     servo->config.speed_most) :
					     0;
	} else if (passed_ns >= 2 * servo->interval_ns) {
		servo->wanted_rate = 0;
	}
}

/* Speed and acceleration that are commanded. */
static void follow_command(struct servo *servo, const struct servo_wish *wish, double seconds,
			   uint64_t now_ns)
{
	const double part = seconds / (servo->config.smooth + seconds);
	const double before = servo->wanted_rate;

	if (!(seconds > 0))
		return;
	if (isnan(wish->velocity)) {
		estimate_rate(servo, wish->position, now_ns);
	} else {
		servo->wanted_rate = wish->velocity;
		servo->wanted_acceleration += ((servo->wanted_rate - before) / seconds -
					       servo->wanted_acceleration) *
					      part;
	}
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

/*
 * What was commanded when the encoder was read: the axis has moved on since then, as the command
 * has. So one that does as it is commanded has no error, however old its count is. Its speed is
 * that between two readings, and comes later by the time constant that smooths it.
 */
static void compare(struct servo *servo, const struct servo_wish *wish, uint64_t now_ns)
{
	const double age_s = (double)since(servo->read_ns, now_ns) / SECOND;
	const double lag_s = age_s + servo->config.smooth + servo->span / 2;
	const double rate = limited(servo->wanted_rate, servo->config.speed_most);

	servo->error = wish->position - rate * age_s - servo->position;
	servo->rate_error = servo->wanted_rate - servo->wanted_acceleration * lag_s - servo->rate;
}

/* The output but for the integral; `error`: what is counted as one. */
static double unintegrated(const struct servo *servo, const struct servo_gains *gains, double error)
{
	return gains->p * error + gains->d * servo->rate_error +
	       gains->velocity * servo->wanted_rate +
	       gains->acceleration * servo->wanted_acceleration;
}

/* The encoder has steps: an error of one is not known to be any. */
static double counted_error(const struct servo *servo)
{
	const double none = fmax(servo->config.deadband, 1.001 / fabs(servo->config.scale));

	return fabs(servo->error) <= none ? 0 : servo->error;
}

static double controlled(struct servo *servo, double seconds)
{
	const struct servo_config *config = &servo->config;
	const double error = counted_error(servo);
	const double more = config->gains.i * error * seconds;
	double rest, output;

	servo->bridge -= servo->bridge * seconds / (BRIDGE_S + seconds);
	rest = unintegrated(servo, &config->gains, error) + servo->bridge;
	output = rest + servo->integral + more;
	if (!(output > config->output_most && more > 0) &&
	    !(output < -config->output_most && more < 0))
		servo->integral = limited(servo->integral + more, config->integral_most);
	return limited(rest + servo->integral, config->output_most);
}

void servo_force(struct servo *servo, double output)
{
	servo->forced = true;
	servo->force = limited(output, servo->config.output_most);
}

void servo_forget_output(struct servo *servo)
{
	servo->idle_output = servo->idle_push = 0;
}

void servo_off(struct servo *servo)
{
	stop(servo);
}

/* It is commanded to be where it is. No speed is as commanded: what runs away is found. */
static void follow_itself(struct servo *servo)
{
	servo->wanted = servo->position;
	servo->wanted_rate = servo->wanted_acceleration = 0;
	servo->error = servo->rate_error = servo->integral = servo->bridge = 0;
}

/* What is wrong while it is enabled. */
static enum servo_fault run(struct servo *servo, const struct servo_input *input,
			    const struct servo_wish *wish, const struct servo_way *way,
			    double seconds, uint64_t now_ns)
{
	const double wanted = servo->forced ? servo->position : wish->position;
	const enum servo_fault found = servo->condition ? servo->condition :
							  servo_watch(servo, input, wanted, way);

	if (found)
		return found;
	if (servo->forced) {
		follow_itself(servo);
		servo->output = servo->force;
		return SERVO_FINE;
	}
	follow_command(servo, wish, seconds, now_ns);
	servo->span = way->seconds > 0 ? way->seconds : servo->span;
	compare(servo, wish, now_ns);
	if (is_too_far(servo))
		return SERVO_FOLLOWING;
	servo->output = controlled(servo, seconds);
	return isfinite(servo->output) ? SERVO_FINE : SERVO_ODD;
}

double servo_step(struct servo *servo, const struct servo_input *input,
		  const struct servo_wish *wish, uint64_t now_ns)
{
	const uint64_t passed_ns = servo->step_ns ? since(servo->step_ns, now_ns) : 0;
	const double seconds = (double)passed_ns / SECOND;
	struct servo_way way;

	servo->condition = servo_measure(servo, input, &way, now_ns);
	/* nobody has watched it meanwhile */
	if (!servo->condition && passed_ns > servo->config.stale_ns)
		servo->condition = SERVO_STALE;
	if (!servo->condition && wish->alive && is_odd(servo, wish))
		servo->condition = SERVO_ODD;
	if (servo->condition == servo_stopped(input))
		servo_track(servo, input, &way, seconds);
	look_at_enable(servo, wish, now_ns);
	if (servo->enabled) {
		const enum servo_fault found = run(servo, input, wish, &way, seconds, now_ns);

		if (found)
			fail(servo, found);
	}
	servo->forced = false;
	servo->step_ns = now_ns;
	return servo->output;
}

/* These are looked at last: without them, nothing else was wrong. */
static enum servo_fault commanded_now(const struct servo *servo, const struct servo_input *input,
				      const struct servo_wish *wish)
{
	if (servo->condition != SERVO_EMERGENCY && servo->condition != SERVO_HEATER &&
	    servo->condition != SERVO_ODD)
		return servo->condition;
	if (servo_stopped(input))
		return servo_stopped(input);
	return wish->alive && is_odd(servo, wish) ? SERVO_ODD : SERVO_FINE;
}

bool servo_reset(struct servo *servo, const struct servo_input *input,
		 const struct servo_wish *wish)
{
	servo->condition = commanded_now(servo, input, wish);
	if (servo->condition)
		return false;
	servo->fault = SERVO_FINE;
	servo->stalled = 0;
	return true;
}

void servo_another(struct servo *servo)
{
	stop(servo);
	servo->refusal = SERVO_TAKEN;
}

/* Places on the machine have another number now; those that are none stay so. */
static void shift_places(struct servo *servo, double shift)
{
	servo->low_at += shift;
	servo->high_at += shift;
	servo->stall_from += shift;
}

void servo_renumber(struct servo *servo, double shift, bool homed)
{
	shift_places(servo, shift);
	servo->offset += shift;
	servo->position += shift;
	servo->wanted += shift;
	servo->low_stop += shift;
	servo->high_stop += shift;
	servo->homed = homed;
	servo_watch_soft(servo, servo->wanted);
}

bool servo_place(struct servo *servo, double position, bool homed)
{
	const double scale = servo->config.scale, shift = position - servo->position;

	if (servo->enabled || !servo->primed || !isfinite(position) ||
	    fabs(position * scale) > PLACE_MOST)
		return false;
	servo->offset = position - (double)servo->counts / scale;
	servo->position = position;
	servo->homed = homed;
	shift_places(servo, shift);
	return true;
}

bool servo_regain(struct servo *servo, const struct servo_gains *gains)
{
	const double error = counted_error(servo);
	const double before = unintegrated(servo, &servo->config.gains, error) + servo->integral +
			      servo->bridge;

	if (judge_gains(gains))
		return false;
	if (servo->enabled) {
		if (gains->i == 0)
			servo->integral = 0;
		servo->bridge = limited(before, servo->config.output_most) - servo->integral -
				unintegrated(servo, gains, error);
	}
	servo->config.gains = *gains;
	return true;
}
