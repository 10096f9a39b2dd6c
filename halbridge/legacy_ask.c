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
	unsigned int place;

	if (own->asked == UINT64_MAX ||
	    one_shot_push(&exchange->queue, &exchange->command, shot, id) != ONE_SHOT_QUEUED)
		return false;
	place = (unsigned int)__builtin_ctzll(~own->asked);
	own->asked |= UINT64_C(1) << place;
	own->asked_id[place] = *id;
	own->asked_session = exchange->queue.session;
	return true;
}

uint32_t legacy_failed(struct exchange *exchange)
{
	const struct one_shot_queue *queue = &exchange->queue;
	struct legacy *own = &exchange->legacy;
	uint32_t failed = 0;

	for (uint64_t asked = own->asked; asked; asked &= asked - 1) {
		const unsigned int place = (unsigned int)__builtin_ctzll(asked);
		enum pokeys_outcome outcome = POKEYS_OUTCOME_UNKNOWN; /* another daemon */

		if (own->asked_session == queue->session)
			outcome = one_shot_outcome(queue, exchange->state, own->asked_id[place]);
		if (outcome == POKEYS_OUTCOME_NONE)
			continue;
		own->asked &= ~(UINT64_C(1) << place);
		failed += outcome != POKEYS_OUTCOME_DONE;
	}
	return failed;
}
