/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * joint.NN.home: homing by the device, joint after joint, groups together.
 */
#ifndef HALBRIDGE_JOINT_HOME_H
#define HALBRIDGE_JOINT_HOME_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/joint.h"
#include "halbridge/press.h"
#include "halbridge/refusal.h"
#include "halbridge/values.h"

struct joint_home {
	uint32_t id;    /* of the one-shot under way */
	uint32_t error; /* outcome.h, of the last one */
	bool open;      /* one is under way */
	uint8_t mask;   /* its joints */
	uint8_t wanted; /* joints that wait for their turn */
	uint8_t up;     /* pins that were seen false since: the next edge is a press */
	struct press cancel;
	struct factor offset[POKEYS_AXES], time_limit;
	bool offset_bad[POKEYS_AXES], limit_bad;
};

void joint_home_init(struct joint_home *home);

/* How they stand; `fresh`: the state image is of now. Realtime. */
void joint_home_read(struct joint_home *home, struct values *values,
		     const struct one_shot_queue *queue, const struct pokeys_state *state,
		     bool fresh);

/*
 * Look at the pins, and ask for what is next. `joint` are those of all axes.
 * Returns true if the queue was full (it is tried again). Realtime.
 */
bool joint_home_write(struct joint_home *home, struct values *values,
		      const struct joint joint[POKEYS_AXES], struct one_shot_queue *queue,
		      struct pokeys_command *command, const struct pokeys_engine *engine,
		      bool fresh, struct refusals *refusals);

/* The daemon that was asked is gone. Realtime. */
void joint_home_forget(struct joint_home *home, struct values *values);

#endif
