/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * probe.*: probing by the device, and the probe's contact for LinuxCNC's.
 */
#ifndef HALBRIDGE_PROBE_H
#define HALBRIDGE_PROBE_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/joint.h"
#include "halbridge/press.h"
#include "halbridge/refusal.h"
#include "halbridge/values.h"

struct probe {
	struct press start, cancel;
	uint32_t error; /* outcome.h, of the last one */
	bool done;      /* the last one touched */
	struct factor speed, time_limit;
	bool speed_bad, limit_bad, terminal_bad, input_bad;
};

void probe_init(struct probe *probe);

/* How it stands; `fresh`: the state image is of now. Realtime. */
void probe_read(struct probe *probe, struct values *values, const struct one_shot_queue *queue,
		const struct pokeys_state *state, bool fresh);

/* Look at the pins. Returns true if the queue was full (it is tried again). Realtime. */
bool probe_write(struct probe *probe, struct values *values, const struct joint joint[POKEYS_AXES],
		 struct one_shot_queue *queue, struct pokeys_command *command, bool fresh,
		 struct refusals *refusals);

/* The daemon that was asked is gone. Realtime. */
void probe_forget(struct probe *probe, struct values *values);

#endif
