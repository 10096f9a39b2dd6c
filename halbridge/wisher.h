/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The settings' way between an instance and shared memory.
 */
#ifndef HALBRIDGE_WISHER_H
#define HALBRIDGE_WISHER_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/shm.h>
#include "halbridge/wish.h"

struct wisher {
	struct wish wish;
	uint64_t epoch;          /* of the report last taken over */
	uint32_t count, session; /* of the report, of the wish last sent */
	bool unsent;
	struct pokeys_report report;
};

/*
 * A round: take over the report if it has changed, look at the parameters,
 * send the wish if it has changed or a daemon does not know it yet. `session`
 * is the command image's. Cold; one thread.
 */
void wisher_round(struct wisher *wisher, struct values *values, pokeys_client *client,
		  uint32_t session, wish_refuse refuse, void *argument);

/* One line about a setting that is not used: which, why, what may be set. */
void wisher_explain(const struct wish_item *item, const char *prefix, double value, char *line,
		    size_t size);

#endif
