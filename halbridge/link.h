/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How the connection stands, by our own clock.
 */
#ifndef HALBRIDGE_LINK_H
#define HALBRIDGE_LINK_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "halbridge/refusal.h"
#include "halbridge/values.h"

struct link {
	uint64_t epoch;     /* of the daemon last seen, 0 = none yet */
	uint64_t missed;    /* its counter of missed deadlines at the last read */
	uint64_t counts_of; /* the daemon whose counts were read last, 0 = none yet */
	/* the device's clock as last read, when that was, and its start on our clock modulo 2^32 */
	uint64_t tick_ns;
	uint32_t tick_ms, start_ms;
	uint8_t encoder_epoch;
	/* from when the newest data are; the first read before any */
	uint64_t data_ns;
	uint64_t fresh_ns;                   /* from when the last fresh data are; 0 = none yet */
	bool attached;                       /* once */
	int32_t limit, increment, decrement; /* in use */
	bool limit_bad, increment_bad, decrement_bad;
};

/* What one read has found out. */
struct link_news {
	bool fresh;         /* the image's data may be used */
	bool new_daemon;    /* another daemon than at the read before */
	bool restarted;     /* ... and there was one */
	bool counts_anew;   /* the device's counters may have begun again since the last one
			     * that was fresh */
	uint64_t silent_ns; /* fresh again, after a silence of LINK_SILENCE_NS or more that
			     * began then; 0 = no */
};

/*
 * Longer than lost packets last, and so short that a hand wheel makes about one turn in it: what is
 * turned in a longer silence must not move the machine when the device is back.
 */
#define LINK_SILENCE_NS	UINT64_C(500000000)

void link_init(struct link *link);

/*
 * Judge an image (NULL = there is none) and fill the connection's pins.
 * `refused` = an image is there, but it is not one of ours. Realtime.
 */
struct link_news link_read(struct link *link, struct values *values,
			   const struct pokeys_state *state, bool refused, uint64_t now_ns,
			   struct refusals *refusals);

#endif
