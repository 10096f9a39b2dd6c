/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The words in a record's comments, for who writes and who reads them.
 */
#ifndef RECORDER_WORDS_H
#define RECORDER_WORDS_H

#include <inttypes.h>
#include <stdint.h>

/* cycle, number of the try */
#define WORDS_SENT "cycle %" PRIu32 ", try %u"
/* ... of a request that is asked in every cycle, so that a newer one replaces it */
#define WORDS_ONCE ", replaced by the next"
/* cycle, words_verdict() */
#define WORDS_RECEIVED "cycle %" PRIu32 ", %s"
/* ns from the kernel's time stamp until the daemon looked at it */
#define WORDS_TAKEN ", taken %" PRIu64 " ns later"

/* enum pokeys_verdict: "accepted", "discarded: ..."; "unknown" for a number that is none. */
const char *words_verdict(uint8_t verdict);

/* The other way round, of the beginning of a text; POKEYS_VERDICT_NONE if it is none. */
uint8_t words_find_verdict(const char *text);

#endif
