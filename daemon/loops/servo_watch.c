/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A motor that does not do what its output should make it do, and places where it may not go.
 *
 * Stalled: it is pushed hard and does not get anywhere. Runaway: it moves against its output and
 * gets faster. A motor that brakes moves against its output as well, but it gets slower; so what
 * counts is the way during which it has become faster than it was when that began.
 *
 * Who is beyond a soft limit or on a limit switch when the axis is enabled may return from there,
 * but go no further.
 */

#include <math.h>

#include "daemon/loops/servo_part.h"

#define FASTER 1.2		/* than when it began to move against its output */
#define FASTER_COUNTS 2		/* ... and by so many counts from one reading to the next */

void servo_watch_begin(struct servo *servo, const struct servo_input *input, uint64_t now_ns)
{
	servo->counted = false;
	servo->stall_from = servo->position;
	servo->stall_from_ns = now_ns;
	servo->against = 0;
	servo->against_rate = fmax(fabs(servo->rate), fabs(servo->raw_rate));
	servo->low_at = input->low ? servo->position : NAN;
	servo->high_at = input->high ? servo->position : NAN;
	servo->soft_least = fmin(servo->config.least, servo->position);
	servo->soft_most = fmax(servo->config.most, servo->position);
}

static enum servo_fault stalls(struct servo *servo, uint64_t now_ns)
{
	const struct servo_config *config = &servo->config;

	if (fabs(servo->output) < config->stall_output ||
	    fabs(servo->position - servo->stall_from) >= config->stall_move) {
		servo->stall_from = servo->position;
		servo->stall_from_ns = now_ns;
	}
	if (since(servo->stall_from_ns, now_ns) <= config->stall_ns)
		return SERVO_FINE;
	return servo->counted ? SERVO_STALLED : SERVO_SILENT;
}

static bool runs_away(struct servo *servo, const struct servo_way *way)
{
	const struct servo_config *config = &servo->config;
	const double noise = FASTER_COUNTS / fabs(config->scale) / way->seconds;

	if (way->moved * servo->output > 0 || fabs(servo->output) < config->runaway_output) {
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
	if (!servo->homed)
		return false;
	if (wanted < servo->soft_least || wanted > servo->soft_most)
		return true;
	servo->soft_least = fmin(servo->config.least, fmax(servo->soft_least, wanted));
	servo->soft_most = fmax(servo->config.most, fmin(servo->soft_most, wanted));
	return false;
}

static bool hits_switch(struct servo *servo, const struct servo_input *input, double wanted)
{
	const double slack = servo->config.follow_least;

	if ((input->low && !(wanted >= servo->low_at - slack)) ||
	    (input->high && !(wanted <= servo->high_at + slack)))
		return true;
	/* a contact that bounces while it is left is none that is reached */
	if (!input->low && servo->position > servo->low_at + slack)
		servo->low_at = NAN;
	if (!input->high && servo->position < servo->high_at - slack)
		servo->high_at = NAN;
	return false;
}

enum servo_fault servo_watch(struct servo *servo, const struct servo_input *input, double wanted,
			     const struct servo_way *way, uint64_t now_ns)
{
	if (hits_switch(servo, input, wanted))
		return SERVO_SWITCH;
	if (goes_beyond(servo, wanted))
		return SERVO_SOFT_LIMIT;
	if (way->seconds > 0 && runs_away(servo, way))
		return SERVO_RUNAWAY;
	return stalls(servo, now_ns);
}
