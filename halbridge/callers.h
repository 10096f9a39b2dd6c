/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Whether one thread runs a device's read and write, as it has to be. */
#ifndef HALBRIDGE_CALLERS_H
#define HALBRIDGE_CALLERS_H

#include <stdbool.h>
#include <stdint.h>

/* As somebody finds it who looks now and then. */
struct callers_seen {
	uintptr_t reader, writer;	/* who ran each last; 0 = nobody yet */
	uint32_t reads, writes;		/* change whenever it runs */
};

struct callers {
	uint32_t reads, writes;		/* at the last look */
	uint32_t different;		/* looks running */
	bool told;
};

/*
 * One look. Returns true if it is to be told that two threads run them: once, until
 * one thread has run both again. Pure; one thread at a time.
 */
bool callers_look(struct callers *callers, const struct callers_seen *seen);

#endif
