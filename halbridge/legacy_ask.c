/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One-shots that an older name asks for. None of these names tells how they end, so each
 * that ended badly is counted as one of a pin that was pressed is (press.c); several may
 * be on their way at once, for a mask or a preset does not wait for the one before.
 */
#include "halbridge/exchange.h"
#include "halbridge/legacy.h"

bool legacy_ask(struct exchange *exchange, const struct pokeys_one_shot *shot, uint32_t *id)
{
	struct legacy *own = &exchange->legacy;

	if (one_shot_push(&exchange->queue, &exchange->command, shot, id) != ONE_SHOT_QUEUED)
		return false;
	own->asked |= UINT64_C(1) << *id % POKEYS_ONE_SHOTS;
	own->asked_session = exchange->queue.session;
	return true;
}

/*
 * The newest id that has this place in the ring, in which no two are on their way at once. Of
 * one that was taken and goes on for minutes (homing) the end is not known any more when as
 * many others have ended meanwhile as the daemon keeps results of; it is counted then.
 */
static uint32_t id_at(const struct one_shot_queue *queue, unsigned int place)
{
	const uint32_t newest = queue->head - 1;

	return newest - (newest - place) % POKEYS_ONE_SHOTS;
}

uint32_t legacy_failed(struct exchange *exchange)
{
	const struct one_shot_queue *queue = &exchange->queue;
	struct legacy *own = &exchange->legacy;
	uint32_t failed = 0;

	for (uint64_t asked = own->asked; asked; asked &= asked - 1) {
		const unsigned int place = (unsigned int)__builtin_ctzll(asked);
		enum pokeys_outcome outcome = POKEYS_OUTCOME_UNKNOWN;	/* another daemon */

		if (own->asked_session == queue->session)
			outcome = one_shot_outcome(queue, &exchange->state, id_at(queue, place));
		if (outcome == POKEYS_OUTCOME_NONE)
			continue;
		own->asked &= ~(UINT64_C(1) << place);
		failed += outcome != POKEYS_OUTCOME_DONE;
	}
	return failed;
}
