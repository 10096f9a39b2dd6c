/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Which joints home, in which order, and which of them together.
 */
#ifndef HALBRIDGE_HOME_PLAN_H
#define HALBRIDGE_HOME_PLAN_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/home_talk.h"

enum {
	HOME_JOINTS = 16,         /* as LinuxCNC has */
	HOME_SEQUENCE_NONE = 999, /* [JOINT_N] has no HOME_SEQUENCE */
};

struct home_plan {
	unsigned int joints;
	int sequence[HOME_JOINTS]; /* HOME_SEQUENCE; below 0: never without the others of it */
	bool stay[HOME_JOINTS];    /* no final move */
	uint32_t wanted;           /* bit = joint that is still to be homed */
	uint32_t group;            /* being homed now, all of one sequence */
	struct home_talk talk[HOME_JOINTS];
};

struct home_result {
	uint32_t done, failed; /* in this period, bit = joint */
};

void home_plan_init(struct home_plan *plan, unsigned int joints);

/* Joints that "home all" means: those with a sequence. */
uint32_t home_plan_all(const struct home_plan *plan);

/* What homing this joint takes: itself, or all of a sequence below 0. */
uint32_t home_plan_with(const struct home_plan *plan, unsigned int joint);

/* Home these as well, in order of their sequences. */
void home_plan_ask(struct home_plan *plan, uint32_t joints);

/* Nobody is homed any more: the device stops all of its axes at once. */
void home_plan_cancel(struct home_plan *plan);

/* A period; state[] is AxesState of each joint. Realtime. */
struct home_result home_plan_step(struct home_plan *plan, const uint32_t *state, double period_s);

bool home_plan_active(const struct home_plan *plan);

#endif
