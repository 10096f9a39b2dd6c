/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * servo.NN.*: the servo motors that the daemon controls.
 */
#ifndef HALBRIDGE_SERVOS_H
#define HALBRIDGE_SERVOS_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/gains.h"
#include "halbridge/press.h"
#include "halbridge/refusal.h"
#include "halbridge/values.h"

struct servos {
	bool begun;
	uint32_t there; /* bit = pokeysd.conf has it, as far as is known */
	uint32_t busy;  /* bit = what was written of it has not come to rest */
	bool bad[POKEYS_SERVOS], absent[POKEYS_SERVOS]; /* its command */
	bool held[POKEYS_SERVOS]; /* could not be enabled: off until the pin has fallen */
	struct press reset[POKEYS_SERVOS], home[POKEYS_SERVOS];
	struct gains gains[POKEYS_SERVOS];
};

void servos_init(struct servos *servos);

/* What the daemon says of them; `alive`: it still does. Realtime. */
void servos_read(struct servos *servos, struct values *values, const struct one_shot_queue *queue,
		 const struct pokeys_state *state, bool alive);

/* There is no daemon that says anything of them. Realtime. */
void servos_alone(struct values *values);

/*
 * Look at the pins. `read`: somebody reads the positions; if not, no motor is enabled. Returns true
 * if the queue was full (it is tried again). Realtime.
 */
bool servos_write(struct servos *servos, struct values *values, struct one_shot_queue *queue,
		  struct pokeys_command *command, bool fresh, bool read, struct refusals *refusals);

/* The daemon that was asked is gone. Realtime. */
void servos_forget(struct servos *servos, struct values *values);

#endif
