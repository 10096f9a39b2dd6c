/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A motor that does not do what its output should make it do, and places where it may not go.
 *
 * Silent: the output has changed, and the encoder has not counted. What matters is how much the
 * output has changed since the last count, not how much there is: an axis that hangs on its motor
 * is held by the same output for hours. Stalled: it is pushed hard, and what it moves leads
 * nowhere. Runaway: it moves against its output and gets faster. A motor that brakes moves against
 * its output as well, but gets slower, and a weight that is let down is as fast as it shall be.
 *
 * Who is beyond a soft limit or on a limit switch when the axis is enabled may return from there,
 * but go no further. On a switch that is so until it is left, however often the axis is enabled.
 */

#include <math.h>

#include "daemon/loops/servo_part.h"

#define FASTER 1.2		/* than when it began to move against its output */
#define FASTER_COUNTS 2		/* ... and by so many counts from one reading to the next */
#define NOISE_COUNTS 4		/* by which a command may differ from the position read */

static double noise_of(const struct servo *servo)
{
	return NOISE_COUNTS / fabs(servo->config.scale);
}

void servo_watch_soft(struct servo *servo, double wanted)
{
	servo->soft_least = fmin(servo->config.least, fmin(servo->position, wanted));
	servo->soft_most = fmax(servo->config.most, fmax(servo->position, wanted));
}

void servo_watch_switch(struct servo *servo, double wanted, bool low)
{
	const double slack = servo->config.follow_least, noise = noise_of(servo);

	if (low)
		servo->low_stop = fmin(servo->low_at - slack, wanted - noise);
	else
		servo->high_stop = fmax(servo->high_at + slack, wanted + noise);
}

void servo_watch_begin(struct servo *servo, double wanted)
{
	const double slack = servo->config.follow_least, noise = noise_of(servo);

	servo->idle_output = servo->idle_push = 0;
	servo->against = 0;
	servo->against_rate = fmax(fabs(servo->rate), fabs(servo->raw_rate));
	servo->low_stop = fmin(servo->low_at - slack, servo->position - noise);
	servo->high_stop = fmax(servo->high_at + slack, servo->position + noise);
	servo_watch_soft(servo, wanted);
}

/* A moment of less output forgives as much time, not all of it. */
static void track_stall(struct servo *servo, double seconds)
{
	const struct servo_config *config = &servo->config;

	if (fabs(servo->position - servo->stall_from) >= config->stall_move) {
		servo->stall_from = servo->position;
		servo->stalled = 0;
	}
	if (fabs(servo->output) >= config->stall_output)
		servo->stalled += seconds;
	else
		servo->stalled = fmax(servo->stalled - seconds, 0);
}

/*
 * What braked the axis to a stop is gone when it stands, and nothing moves: that part of the output
 * is none that has to be seen.
 */
static void track_silence(struct servo *servo, const struct servo_way *way, double seconds)
{
	const double brakes = servo->wanted_acceleration * servo->wanted_rate <= 0 ?
				      servo->config.gains.acceleration *
					      servo->wanted_acceleration :
				      0;
	const double holds = servo->output - brakes;
	const double more = fabs(holds - servo->idle_output) - servo->config.silent_output;

	if (way->moved != 0) {
		servo->idle_output = holds;
		servo->idle_push = 0;
	} else if (more > 0) {
		servo->idle_push += more * seconds;
	}
}

/* While the axis leaves a switch, the contact may bounce. That is no new contact. */
static void track_switches(struct servo *servo, const struct servo_input *input,
			   struct servo_way *way)
{
	const double slack = servo->config.follow_least;

	way->contact = (input->low && !input->seeks_low && isnan(servo->low_at)) ||
		       (input->high && !input->seeks_high && isnan(servo->high_at));
	/* fmax() and fmin() take the number if the other one is none */
	if (input->low)
		servo->low_at = fmax(servo->low_at, servo->position);
	else if (servo->position > servo->low_at + slack)
		servo->low_at = NAN;
	if (input->high)
		servo->high_at = fmin(servo->high_at, servo->position);
	else if (servo->position < servo->high_at - slack)
		servo->high_at = NAN;
}

void servo_track(struct servo *servo, const struct servo_input *input, struct servo_way *way,
		 double seconds)
{
	track_stall(servo, seconds);
	track_silence(servo, way, seconds);
	track_switches(servo, input, way);
}

static bool runs_away(struct servo *servo, const struct servo_way *way)
{
	const struct servo_config *config = &servo->config;
	const double noise = FASTER_COUNTS / fabs(config->scale) / way->seconds;
	const bool as_wanted = servo->rate * servo->wanted_rate > 0 &&
			       fabs(servo->rate) <= FASTER * fabs(servo->wanted_rate) + noise;

	if (way->moved * servo->output > 0 || fabs(servo->output) <= config->runaway_output ||
	    as_wanted) {
		servo->against = 0;
		servo->against_rate = fmax(fabs(servo->rate), fabs(servo->raw_rate));
		return false;
	}
	servo->against += fabs(way->moved);
	return servo->against > config->runaway_move &&
	       fabs(servo->rate) > FASTER * servo->against_rate + noise;
}

/* Who returns from beyond may not go there again. */
static bool goes_beyond(struct servo *servo, double wanted)
{
	const double noise = noise_of(servo);

	if (!servo->homed)
		return false;
	if (wanted < servo->soft_least || wanted > servo->soft_most)
		return true;
	servo->soft_least = fmin(servo->config.least, fmax(servo->soft_least, wanted - noise));
	servo->soft_most = fmax(servo->config.most, fmin(servo->soft_most, wanted + noise));
	return false;
}

/* The same on a limit switch, where it may have run on beyond when it was stopped. */
static bool goes_onto_switch(struct servo *servo, const struct servo_input *input, double wanted)
{
	const double slack = servo->config.follow_least, noise = noise_of(servo);

	if ((input->low && !input->seeks_low && wanted < servo->low_stop) ||
	    (input->high && !input->seeks_high && wanted > servo->high_stop))
		return true;
	servo->low_stop = fmax(servo->low_stop, fmin(servo->low_at - slack, wanted - noise));
	servo->high_stop = fmin(servo->high_stop, fmax(servo->high_at + slack, wanted + noise));
	return false;
}

enum servo_fault servo_watch(struct servo *servo, const struct servo_input *input, double wanted,
			     const struct servo_way *way)
{
	if (way->contact || goes_onto_switch(servo, input, wanted))
		return SERVO_SWITCH;
	if (goes_beyond(servo, wanted))
		return SERVO_SOFT_LIMIT;
	if (way->seconds > 0 && runs_away(servo, way))
		return SERVO_RUNAWAY;
	if (servo->idle_push > servo->config.silent_s)
		return SERVO_SILENT;
	return servo->stalled > servo->config.stall_s ? SERVO_STALLED : SERVO_FINE;
}
