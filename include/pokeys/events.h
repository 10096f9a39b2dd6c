/* SPDX-License-Identifier: MIT */
/*
 * What has happened to a device, in words: lines of the daemon's log, for programs that may not
 * read the log. The daemon keeps the last POKEYS_EVENTS_KEPT of each device until the next one
 * starts; pokeys_client_read_events() (shm.h) copies them.
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
	POKEYS_EVENT_TEXT_MAX = 600,
};

/* struct pokeys_event.flags */
enum {
	/* of the daemon or the network: each of its devices has this event */
	POKEYS_EVENT_ALL_DEVICES = 1u << 0,
};

struct pokeys_event {
	uint64_t number;                  /* 1 = the first since the daemon's start */
	uint64_t t_ns;                    /* when it happened, CLOCK_MONOTONIC */
	uint64_t wall_ns;                 /* the same, by CLOCK_REALTIME */
	uint16_t level;                   /* syslog's: 3 error, 4 warning, 5 notice, 6 info */
	uint16_t flags;                   /* POKEYS_EVENT_ */
	uint32_t held;                    /* earlier ones of this kind that were only counted */
	char kind[POKEYS_EVENT_KIND_MAX]; /* a word, such as "link" or "safe-state" */
	char text[POKEYS_EVENT_TEXT_MAX]; /* one line, without the device's name */
};

/* Where a reader is. All zero: before the oldest event that is kept. */
struct pokeys_events_cursor {
	uint64_t epoch; /* which daemon's (state.epoch) */
	uint64_t next;  /* number of the event to read next */
};

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_EVENTS_H */
