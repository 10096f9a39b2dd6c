/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One table for both ways: what a record says of a reply is read back from the
 * same words, so a person and pokeysctl replay read the same thing.
 */
#include <string.h>
#include <pokeys/async.h>
#include "daemon/recorder/words.h"

static const char *const verdicts[POKEYS_VERDICTS] = {
	[POKEYS_VERDICT_ACCEPTED] = "accepted",
	[POKEYS_VERDICT_BAD_SOURCE] = "discarded: not from the device",
	[POKEYS_VERDICT_BAD_LENGTH] = "discarded: bad length",
	[POKEYS_VERDICT_BAD_MAGIC] = "discarded: no reply",
	[POKEYS_VERDICT_BAD_CHECKSUM] = "discarded: bad checksum",
	[POKEYS_VERDICT_NOT_IN_FLIGHT] = "discarded: answers nothing that was asked",
	[POKEYS_VERDICT_DUPLICATE] = "discarded: a copy",
	[POKEYS_VERDICT_BAD_OPERATION] = "discarded: answers another operation",
	[POKEYS_VERDICT_BAD_CHECK] = "discarded: bad check byte or echo",
	[POKEYS_VERDICT_STALE] = "discarded: too old",
};

const char *words_verdict(uint8_t verdict)
{
	return verdict < POKEYS_VERDICTS && verdicts[verdict] ? verdicts[verdict] : "unknown";
}

uint8_t words_find_verdict(const char *text)
{
	for (uint8_t i = 0; i < POKEYS_VERDICTS; i++)
		if (verdicts[i] && !strncmp(text, verdicts[i], strlen(verdicts[i])))
			return i;
	return POKEYS_VERDICT_NONE;
}
