/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One-shots: each is executed at most once and its end is always learnt.
 *
 * The ring lives in the command image that is overwritten every period, so a
 * queued one-shot simply stays there until the daemon's acknowledgement has
 * passed it; nothing is lost if an image is never read. The full test is
 * local: ids given out minus ids taken. Nothing is queued before the daemon
 * shows our session, because it would not be executed.
 *
 * A session is one commander's run against one run of the daemon. When the
 * daemon has been started anew a new session begins with an empty ring: what
 * the dead daemon had not reported may or may not have happened, and is for
 * the caller to decide again, never for the new daemon to execute.
 *
 * The daemon keeps the results of 16 ids, each in a place of its own. One that goes on for
 * minutes (homing) has its place taken by others meanwhile, and takes it back when it ends.
 * So a newer result in a place means that the older one was missed only where nothing
 * goes on.
 */
#include "halbridge/one_shot.h"
#include <string.h>

void one_shot_begin(struct one_shot_queue *queue, struct pokeys_command *command, uint32_t session)
{
	*queue = (struct one_shot_queue){ .session = session ? session : 1 };
	command->session = queue->session;
	command->one_shot_head = 0;
	memset(command->one_shot, 0, sizeof(command->one_shot));
}

enum one_shot_push one_shot_push(struct one_shot_queue *queue, struct pokeys_command *command,
				 const struct pokeys_one_shot *shot, uint32_t *id)
{
	struct pokeys_one_shot *slot = &command->one_shot[queue->head % POKEYS_ONE_SHOTS];

	if (!queue->open)
		return ONE_SHOT_NOT_YET;
	if (queue->head - queue->ack >= POKEYS_ONE_SHOTS)
		return ONE_SHOT_FULL;
	*id = queue->head;
	*slot = *shot;
	slot->id = queue->head;
	queue->head++;
	command->one_shot_head = queue->head;
	return ONE_SHOT_QUEUED;
}

void one_shot_acknowledge(struct one_shot_queue *queue, const struct pokeys_state *state)
{
	uint32_t ahead = state->one_shot_ack - queue->ack;

	queue->open = state->one_shot_session == queue->session;
	if (queue->open && ahead <= queue->head - queue->ack)
		queue->ack = state->one_shot_ack;
}

enum pokeys_outcome one_shot_outcome(const struct one_shot_queue *queue,
				     const struct pokeys_state *state, uint32_t id)
{
	const struct pokeys_one_shot_result *result =
		&state->one_shot[id % POKEYS_ONE_SHOT_RESULTS];

	if (state->one_shot_session != queue->session || (int32_t)(result->id - id) < 0)
		return POKEYS_OUTCOME_NONE;
	if (result->id != id) /* what goes on may be this one, and will tell */
		return state->engine.task_phase == POKEYS_TASK_IDLE ? POKEYS_OUTCOME_UNKNOWN :
								      POKEYS_OUTCOME_NONE;
	if (result->outcome > POKEYS_OUTCOME_REFUSED)
		return POKEYS_OUTCOME_UNKNOWN;
	return (enum pokeys_outcome)result->outcome;
}
