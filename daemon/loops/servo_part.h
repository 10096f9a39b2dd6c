/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the files of a servo share.
 */
#ifndef LOOPS_SERVO_PART_H
#define LOOPS_SERVO_PART_H

#include "daemon/loops/duration.h"
#include "daemon/loops/servo.h"

/* What this step has learnt. */
struct servo_way {
	double moved;   /* since the reading before, units */
	double seconds; /* between the two; 0: there is no newer one */
	bool contact;   /* a limit switch has closed */
};

/* What stops it from outside, whatever it does itself. */
enum servo_fault servo_stopped(const struct servo_input *input);

/* Take the encoder's count. What is wrong with it, or with the device, at this moment. */
enum servo_fault servo_measure(struct servo *servo, const struct servo_input *input,
			       struct servo_way *way, uint64_t now_ns);

/* In each step, enabled or not: what its output did for so many seconds; where switches are. */
void servo_track(struct servo *servo, const struct servo_input *input, struct servo_way *way,
		 double seconds);

/* It is enabled now, to be there. */
void servo_watch_begin(struct servo *servo, double wanted);

/* It is commanded to be there: what is beyond the soft limits is allowed up to there. */
void servo_watch_soft(struct servo *servo, double wanted);

/* While it is enabled: does it do what its output should make it do, and may it go there? */
enum servo_fault servo_watch(struct servo *servo, const struct servo_input *input, double wanted,
			     const struct servo_way *way);

#endif
