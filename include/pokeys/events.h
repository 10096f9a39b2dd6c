/* SPDX-License-Identifier: MIT */
/*
 * What has happened to a device, in words: the lines of the daemon's log that say so, for
 * programs that may not read the log. The daemon keeps the last POKEYS_EVENTS_KEPT of each
 * device since its start; pokeys_client_read_events() (shm.h) copies them.
 *
 * The texts are for people and may change; `kind` is for programs and does not. New kinds may
 * come.
 */
#ifndef POKEYS_EVENTS_H
#define POKEYS_EVENTS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
	POKEYS_EVENTS_KEPT = 128,
	POKEYS_EVENT_KIND_MAX = 32,
	POKEYS_EVENT_TEXT_MAX = 256,
};

struct pokeys_event {
	uint64_t number;		/* 1 = the first since the daemon's start */
	uint64_t t_ns;			/* when it happened, CLOCK_MONOTONIC */
	uint64_t wall_ns;		/* the same, CLOCK_REALTIME as it was set then */
	uint32_t level;			/* syslog's: 3 error, 4 warning, 5 notice, 6, 7 */
	uint32_t held;			/* so many of this kind came before it without an event */
	char kind[POKEYS_EVENT_KIND_MAX];	/* a word, such as "link" or "safe-state" */
	char text[POKEYS_EVENT_TEXT_MAX];	/* one line, without the device's name */
};

/* Where a reader is. All zero: before the oldest event that is kept. */
struct pokeys_events_cursor {
	uint64_t epoch;			/* which daemon's (state.epoch) */
	uint64_t next;			/* number of the event to read next */
};

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_EVENTS_H */
