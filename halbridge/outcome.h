/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How a homing or probing ended, as homing.error and probe.error show it: the
 * daemon's enum pokeys_task_result, 0 for done, and two words of our own.
 */
#ifndef HALBRIDGE_OUTCOME_H
#define HALBRIDGE_OUTCOME_H

#include <stdint.h>
#include <pokeys/state.h>

enum { OUTCOME_WELL = 0, OUTCOME_REFUSED = 8, OUTCOME_NOT_KNOWN = 9 };

/* `outcome` is its one-shot's; not POKEYS_OUTCOME_NONE. Realtime. */
static inline uint32_t outcome_error(enum pokeys_outcome outcome,
				     const struct pokeys_engine *engine)
{
	if (outcome == POKEYS_OUTCOME_DONE)
		return OUTCOME_WELL;
	if (outcome == POKEYS_OUTCOME_REFUSED)
		return OUTCOME_REFUSED;
	if (outcome == POKEYS_OUTCOME_FAILED && engine->task_result > POKEYS_TASK_DONE)
		return engine->task_result;
	return OUTCOME_NOT_KNOWN;
}

#endif
