/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A pin that is pressed like a button: each rising edge is one one-shot.
 */
#ifndef HALBRIDGE_PRESS_H
#define HALBRIDGE_PRESS_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/one_shot.h"

enum press_state { PRESS_IDLE, PRESS_WAITING, PRESS_QUEUED };

struct press {
	uint32_t id;
	uint8_t state;   /* enum press_state */
	uint8_t outcome; /* enum pokeys_outcome, of the last one */
	bool up;         /* the pin was seen false since: the next edge is a press */
	struct pokeys_one_shot shot;
};

/* What came of it. */
struct press_news {
	bool full, failed;
};

/* How the last one ended, if it has. Realtime. Returns true if it ended badly. */
bool press_read(struct press *press, const struct one_shot_queue *queue,
		const struct pokeys_state *state);

/*
 * Look at the pin; at a rising edge, `shot` is what is asked for, or NULL if
 * it cannot be now (then the outcome is POKEYS_OUTCOME_REFUSED, unless an earlier press is
 * under way, whose outcome is still to come). Realtime.
 */
struct press_news press_write(struct press *press, bool pin, const struct pokeys_one_shot *shot,
			      struct one_shot_queue *queue, struct pokeys_command *command);

/* It is up and nothing is under way: as long as its pin is up, nothing has to be done for it. */
static inline bool press_rests(const struct press *press)
{
	return press->state == PRESS_IDLE && press->up;
}

/* The daemon that was asked is gone. Realtime. Returns true if something was under way. */
bool press_forget(struct press *press);

#endif
