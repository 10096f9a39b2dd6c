/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The pins that are pressed: set the clock, zero the counters, clear a fault,
 * save the settings, jog by hand wheels.
 */
#ifndef HALBRIDGE_BUTTONS_H
#define HALBRIDGE_BUTTONS_H

#include <stdbool.h>
#include "halbridge/press.h"
#include "halbridge/refusal.h"
#include "halbridge/values.h"

struct buttons {
	struct press clock, counters, fault, save, jog, jog_end;
	bool was_fresh;
};

/* How those under way have ended. Realtime. */
void buttons_read(struct buttons *buttons, struct values *values,
		  const struct one_shot_queue *queue, const struct pokeys_state *state);

/*
 * Look at the pins. `fresh`: somebody is there to begin it. Returns true if the
 * queue was full (it is tried again in the next period). Realtime.
 */
bool buttons_write(struct buttons *buttons, struct values *values, struct one_shot_queue *queue,
		   struct pokeys_command *command, bool fresh, struct refusals *refusals);

/* The daemon that was asked is gone. Realtime. */
void buttons_forget(struct buttons *buttons, struct values *values);

#endif
