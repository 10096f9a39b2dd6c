/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A record played against a mailbox, in the time that the record has: what was asked is
 * asked, what came is delivered when it was, and the mailbox has to make of it what the
 * daemon's made.
 */
#ifndef TESTS_RECORDER_PLAYER_H
#define TESTS_RECORDER_PLAYER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <pokeys/async.h>
#include "daemon/recorder/replay.h"

struct player_options {
	const struct pokeys_options *mailbox; /* as the daemon's were */
	/*
	 * The record begins with the daemon, and nothing happened that it does not tell:
	 * ids, check bytes, deadlines and retries come from the mailbox alone. Otherwise
	 * ids and the moments of the retries are the record's.
	 */
	bool exact;
	unsigned int copies; /* of each reply that are delivered besides, at once */
};

struct played {
	uint64_t requests, retries, replies, accepted, unanswered, cancelled, resets;
	uint64_t differences;
	char first[200]; /* of the differences */
};

void player_play(const struct replay *record, const struct player_options *options,
		 struct played *out);

#endif
