/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The commander's end of the one-shot ring inside the command image.
 */
#ifndef HALBRIDGE_ONE_SHOT_H
#define HALBRIDGE_ONE_SHOT_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/state.h>

struct one_shot_queue {
	uint32_t session; /* ours, never 0 */
	uint32_t head;    /* the next id; this many have been queued */
	uint32_t ack;     /* the daemon has taken those below */
	bool open;        /* the daemon knows the session */
};

enum one_shot_push {
	ONE_SHOT_QUEUED = 0,
	ONE_SHOT_NOT_YET, /* the daemon does not know our session yet */
	ONE_SHOT_FULL,    /* 64 wait already */
};

/* Begin a session: empty ring, ids from 0. Realtime. */
void one_shot_begin(struct one_shot_queue *queue, struct pokeys_command *command, uint32_t session);

/*
 * Queue a copy of `shot`; its id is filled in and stored in *id. Realtime.
 */
enum one_shot_push one_shot_push(struct one_shot_queue *queue, struct pokeys_command *command,
				 const struct pokeys_one_shot *shot, uint32_t *id);

/* Learn from a state image how far the daemon is. Realtime. */
void one_shot_acknowledge(struct one_shot_queue *queue, const struct pokeys_state *state);

/* How `id` ended; POKEYS_OUTCOME_NONE = not yet. Realtime. */
enum pokeys_outcome one_shot_outcome(const struct one_shot_queue *queue,
				     const struct pokeys_state *state, uint32_t id);

#endif
