/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * heater.NN.*: the heaters that the daemon controls.
 */
#ifndef HALBRIDGE_HEATERS_H
#define HALBRIDGE_HEATERS_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/gains.h"
#include "halbridge/press.h"
#include "halbridge/refusal.h"
#include "halbridge/values.h"

struct heaters {
	bool begun;
	uint32_t there; /* bit = pokeysd.conf has it, as far as is known */
	uint32_t busy;  /* bit = what was written of it has not come to rest */
	bool bad[POKEYS_HEATERS], absent[POKEYS_HEATERS]; /* its target */
	struct press reset[POKEYS_HEATERS];
	struct gains gains[POKEYS_HEATERS];
};

void heaters_init(struct heaters *heaters);

/* What the daemon says of them; `alive`: it still does. Realtime. */
void heaters_read(struct heaters *heaters, struct values *values,
		  const struct one_shot_queue *queue, const struct pokeys_state *state, bool alive);

/* Look at the pins. Returns true if the queue was full (it is tried again). Realtime. */
bool heaters_write(struct heaters *heaters, struct values *values, struct one_shot_queue *queue,
		   struct pokeys_command *command, bool fresh, struct refusals *refusals);

/* The daemon that was asked is gone. Realtime. */
void heaters_forget(struct heaters *heaters, struct values *values);

#endif
