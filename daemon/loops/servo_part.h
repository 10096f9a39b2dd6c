/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the files of a servo share.
 */
#ifndef LOOPS_SERVO_PART_H
#define LOOPS_SERVO_PART_H

#include "daemon/loops/duration.h"
#include "daemon/loops/servo.h"

/* What the newest reading tells of the motion since the one before. */
struct servo_way {
	double moved;		/* units */
	double seconds;		/* 0: there is no newer one */
};

/* Take the encoder's count. What is wrong with it, or with the device, at this moment. */
enum servo_fault servo_measure(struct servo *servo, const struct servo_input *input,
			       struct servo_way *way, uint64_t now_ns);

/* It is enabled now: nothing of before counts. */
void servo_watch_begin(struct servo *servo, const struct servo_input *input, uint64_t now_ns);

/* While it is enabled: does it do what its output should make it do, and may it go there? */
enum servo_fault servo_watch(struct servo *servo, const struct servo_input *input, double wanted,
			     const struct servo_way *way, uint64_t now_ns);

#endif
