/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Whether a device's read and write both run, in one thread, as it has to be. */
#ifndef HALBRIDGE_CALLERS_H
#define HALBRIDGE_CALLERS_H

#include <stdbool.h>
#include <stdint.h>

/* As somebody finds it who looks now and then. */
struct callers_seen {
	uintptr_t reader, writer; /* who ran each last; 0 = nobody yet */
	uint32_t reads, writes;   /* change whenever it runs */
};

enum callers_news {
	CALLERS_AS_BEFORE,
	CALLERS_TWO_THREADS,
	CALLERS_NO_READ,
};

struct callers {
	uint32_t reads, writes;     /* at the last look at which both had run */
	uint32_t last_writes;       /* at the last look */
	uint32_t different, unread; /* looks running */
	bool told, told_unread;
};

/*
 * One look. Returns what is to be reported: that two threads run them, or that write runs
 * and read does not. Each once, until one thread has run both again. Pure; one thread at a
 * time.
 */
enum callers_news callers_look(struct callers *callers, const struct callers_seen *seen);

#endif
