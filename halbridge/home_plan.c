/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Joints of one sequence home by one request to the device, which numbers the
 * axes of a request and not the requests; the next sequence begins when all of
 * this one stand at home. Within a group nobody goes on to the next thing that
 * is told to the whole device (homing is over) or that must not happen beside a
 * searching neighbour (the final move) before the others have come as far.
 *
 * One joint that fails ends it for all: the device's cancel stops the engine.
 */
#include "halbridge/home_plan.h"
#include <stdlib.h>
#include <string.h>

static uint32_t bit(unsigned int joint)
{
	return UINT32_C(1) << joint;
}

void home_plan_init(struct home_plan *plan, unsigned int joints)
{
	memset(plan, 0, sizeof(*plan));
	plan->joints = joints < HOME_JOINTS ? joints : HOME_JOINTS;
	for (unsigned int i = 0; i < HOME_JOINTS; i++)
		plan->sequence[i] = HOME_SEQUENCE_NONE;
}

static uint32_t of_sequence(const struct home_plan *plan, uint32_t among, int sequence)
{
	uint32_t joints = 0;

	for (unsigned int i = 0; i < plan->joints; i++) {
		if (among & bit(i) && abs(plan->sequence[i]) == abs(sequence))
			joints |= bit(i);
	}
	return joints;
}

uint32_t home_plan_all(const struct home_plan *plan)
{
	const uint32_t every = bit(plan->joints) - 1;

	return every & ~of_sequence(plan, every, HOME_SEQUENCE_NONE);
}

uint32_t home_plan_with(const struct home_plan *plan, unsigned int joint)
{
	if (joint >= plan->joints)
		return 0;
	return plan->sequence[joint] < 0 ? of_sequence(plan, UINT32_MAX, plan->sequence[joint]) :
					   bit(joint);
}

void home_plan_ask(struct home_plan *plan, uint32_t joints)
{
	plan->wanted |= joints & (bit(plan->joints) - 1) & ~plan->group;
}

void home_plan_cancel(struct home_plan *plan)
{
	plan->wanted = 0;
	for (unsigned int i = 0; i < plan->joints; i++)
		home_talk_give_up(&plan->talk[i]);
}

/* The lowest sequence of those wanted. */
static void next_group(struct home_plan *plan)
{
	int lowest = -1;

	for (unsigned int i = 0; i < plan->joints; i++) {
		int sequence = abs(plan->sequence[i]);

		if (plan->wanted & bit(i) && (lowest < 0 || sequence < lowest))
			lowest = sequence;
	}
	plan->group = of_sequence(plan, plan->wanted, lowest);
	plan->wanted &= ~plan->group;
	for (unsigned int i = 0; i < plan->joints; i++) {
		if (plan->group & bit(i))
			home_talk_begin(&plan->talk[i], plan->stay[i]);
	}
}

/* The stage that all of the group have reached, by what was so before this period. */
static unsigned int reached(const struct home_plan *plan)
{
	unsigned int least = HOME_STAGES;

	for (unsigned int i = 0; i < plan->joints; i++) {
		unsigned int stage = plan->talk[i].stage;

		/* one that is done already waits for nobody */
		if (plan->group & bit(i) && stage != HOME_STAGE_IDLE && stage < least)
			least = stage;
	}
	return least;
}

struct home_result home_plan_step(struct home_plan *plan, const uint32_t *state, double period_s)
{
	struct home_result result = { 0, 0 };
	unsigned int least = reached(plan);

	if (!plan->group && plan->wanted)
		next_group(plan);
	for (unsigned int i = 0; i < plan->joints; i++) {
		struct home_talk *talk = &plan->talk[i];
		enum home_news news = home_talk_step(talk, state[i], talk->stage <= least,
						     period_s);

		result.done |= news == HOME_NEWS_DONE ? bit(i) : 0;
		result.failed |= news == HOME_NEWS_FAILED ? bit(i) : 0;
	}
	if (result.failed)
		home_plan_cancel(plan);
	for (unsigned int i = 0; i < plan->joints; i++) {
		if (plan->talk[i].stage == HOME_STAGE_IDLE)
			plan->group &= ~bit(i);
	}
	/* at once: motion cancels only joints that say they are homing */
	if (!plan->group && plan->wanted)
		next_group(plan);
	return result;
}

bool home_plan_active(const struct home_plan *plan)
{
	return plan->group || plan->wanted;
}
