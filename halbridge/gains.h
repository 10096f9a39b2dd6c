/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * heater.NN and servo.NN: the gains, as parameters.
 */
#ifndef HALBRIDGE_GAINS_H
#define HALBRIDGE_GAINS_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/loop.h>
#include "halbridge/one_shot.h"
#include "halbridge/refusal.h"

/* Those of one loop. */
struct gains {
	double shown[POKEYS_GAINS]; /* each parameter as it was seen last */
	float have[POKEYS_GAINS];   /* what the daemon uses */
	uint32_t id;                /* of the one-shot that is under way */
	uint8_t which, count;
	uint8_t operation, index; /* of its one-shots */
	uint8_t set;              /* bit = somebody has set it */
	uint8_t refused;          /* bit = the daemon has refused that */
	bool asked;               /* a one-shot is under way */
	double value;             /* ... for this value */
};

/* `count` gains of the loop `index`, of which nobody has set any. */
void gains_init(struct gains *gains, enum pokeys_one_shot_operation operation, unsigned int index,
		unsigned int count);

/* What the daemon uses: into the parameters that nobody has set. Realtime. */
void gains_read(struct gains *gains, double parameter[], const float have[],
		const struct one_shot_queue *queue, const struct pokeys_state *state);

/*
 * Look at the parameters, the first of which is at `offset` in struct values, and ask for what was
 * set. Returns true if the queue was full. Realtime.
 */
bool gains_write(struct gains *gains, const double parameter[], size_t offset,
		 struct one_shot_queue *queue, struct pokeys_command *command,
		 struct refusals *refusals);

/* The daemon that was asked is gone; the next one is asked again. Realtime. */
void gains_forget(struct gains *gains);

#endif
