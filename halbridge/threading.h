/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * threading.*: the device's own threading.
 */
#ifndef HALBRIDGE_THREADING_H
#define HALBRIDGE_THREADING_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/press.h"
#include "halbridge/refusal.h"
#include "halbridge/values.h"

enum threading_button {
	THREADING_PREPARE,
	THREADING_FORCE,
	THREADING_ARM,
	THREADING_RELEASE,
	THREADING_CANCEL,
	THREADING_BUTTONS,
};

enum { THREADING_NO_DAEMON = 9 }; /* reason: beside enum pokeys_threading_refusal */

struct threading {
	struct press press[THREADING_BUTTONS];
	uint32_t error; /* outcome.h, of the last one */
	uint32_t reason;
	uint32_t ended; /* tasks of the daemon's, as seen last */
	bool begun;
	struct factor time_limit;
	bool limit_bad;
};

void threading_init(struct threading *threading);

/* How it stands; `fresh`: the state image is of now. Realtime. */
void threading_read(struct threading *threading, struct values *values,
		    const struct one_shot_queue *queue, const struct pokeys_state *state,
		    bool fresh);

/* Look at the pins. Returns true if the queue was full (it is tried again). Realtime. */
bool threading_write(struct threading *threading, struct values *values,
		     struct one_shot_queue *queue, struct pokeys_command *command, bool fresh,
		     struct refusals *refusals);

/* The daemon that was asked is gone. Realtime. */
void threading_forget(struct threading *threading, struct values *values);

/*
 * This joint's slots wait for the spindle: where the axis is says nothing of how well
 * it follows. Realtime.
 */
static inline bool threading_leads(const struct pokeys_engine *engine, unsigned int joint)
{
	return engine->task == POKEYS_TASK_THREADING && engine->task_phase != POKEYS_TASK_IDLE &&
	       engine->task_phase != POKEYS_TASK_STOPPING && engine->task_axes >> joint & 1;
}

#endif
