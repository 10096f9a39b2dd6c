/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pressed once, done at most once. A pin that is true from the start has not been
 * pressed: it hangs, or is wired the wrong way round.
 *
 * A press while nobody is there to do it is refused, not kept: zeroing the
 * counters when the daemon comes back minutes later is not what the person
 * wanted. The same if the daemon ends in between: it may or may not have done
 * it, and says so as "unknown". Only a press that meets a full queue, or a
 * daemon that is about to know our session, waits for the next period.
 *
 * What cancels something is asked for with data that are stale as well: they often are
 * for a moment, the daemon is there all the same, and who cancels does not press twice.
 * Where it is not, the press is forgotten and counted when the next daemon comes.
 */
#include "halbridge/press.h"
#include <stddef.h>

bool press_read(struct press *press, const struct one_shot_queue *queue,
		const struct pokeys_state *state)
{
	enum pokeys_outcome outcome;

	if (press->state != PRESS_QUEUED)
		return false;
	outcome = one_shot_outcome(queue, state, press->id);
	if (outcome == POKEYS_OUTCOME_NONE)
		return false;
	press->state = PRESS_IDLE;
	press->outcome = (uint8_t)outcome;
	return outcome != POKEYS_OUTCOME_DONE;
}

struct press_news press_write(struct press *press, bool pin, const struct pokeys_one_shot *shot,
			      struct one_shot_queue *queue, struct pokeys_command *command)
{
	struct press_news news = { .failed = false };
	bool edge = pin && press->up;
	enum one_shot_push pushed;

	press->up = !pin;
	if (edge && !shot && press->state == PRESS_QUEUED) {
		news.failed = true; /* this one; how the one under way ends is still to come */
	} else if (edge) {
		press->state = shot ? PRESS_WAITING : PRESS_IDLE;
		press->outcome = shot ? POKEYS_OUTCOME_NONE : POKEYS_OUTCOME_REFUSED;
		news.failed = !shot;
		if (shot)
			press->shot = *shot;
	}
	if (press->state != PRESS_WAITING)
		return news;
	pushed = one_shot_push(queue, command, &press->shot, &press->id);
	if (pushed == ONE_SHOT_QUEUED)
		press->state = PRESS_QUEUED;
	news.full = pushed == ONE_SHOT_FULL;
	return news;
}

bool press_forget(struct press *press)
{
	bool under_way = press->state != PRESS_IDLE;

	if (under_way)
		press->outcome = POKEYS_OUTCOME_UNKNOWN;
	press->state = PRESS_IDLE;
	return under_way;
}
