/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A 32-bit count out of 8-bit samples (protocol sections 3.4, 3.8, 3.25).
 * Pure and realtime safe.
 */
#ifndef DEVICE_ENCODER_H
#define DEVICE_ENCODER_H

#include <stdbool.h>
#include <stdint.h>

struct encoder {
	int32_t count;     /* the last count that is certain; wraps at 2^32 */
	uint64_t t_ns;     /* when it was sampled: when its answer came */
	uint64_t asked_ns; /* ... and not before it was asked for */
	double rate;       /* counts per ns, of late */
	bool known;        /* count is the device's, not just a start value */
	bool doubt;        /* 8-bit samples are ignored until a 32-bit one comes */
	bool begun;        /* in doubt because nothing is known of its speed yet */
	bool marked;
	uint8_t late;    /* 32-bit samples in a row that were too slow to end a doubt */
	int32_t mark;    /* count when a 32-bit read was begun */
	uint32_t resync; /* jumps that a 32-bit sample mended */
	uint32_t slips;  /* ... of a count that was published, and was wrong */
};

enum encoder_verdict {
	ENCODER_TAKEN, /* the count follows the sample */
	ENCODER_CHECK, /* taken, but read all 32 bits soon: the gap was long */
	ENCODER_HELD,  /* not taken: read all 32 bits now */
};

/*
 * The low byte as sampled at t_ns; nominal_ns is how far samples usually are
 * apart. Samples that are older than the count are ignored.
 */
enum encoder_verdict encoder_low_byte(struct encoder *encoder, uint8_t low, uint64_t t_ns,
				      uint64_t nominal_ns);

/* A read of all 32 bits is about to be asked for. */
void encoder_mark(struct encoder *encoder);

/*
 * All 32 bits, sampled at some moment between asked_ns (which encoder_mark()
 * belongs to) and t_ns. HELD: still in doubt, ask again.
 */
enum encoder_verdict encoder_exact(struct encoder *encoder, int32_t count, uint64_t asked_ns,
				   uint64_t t_ns, uint64_t nominal_ns);

/* A counter that always comes with all its bits (the ultra-fast encoder). */
void encoder_whole(struct encoder *encoder, int32_t count, uint64_t t_ns);

/* Counts from the last certain one to t_ns, if it goes on as of late. */
int32_t encoder_travel(const struct encoder *encoder, uint64_t t_ns);

/*
 * The count was set from outside, or the device was restarted: the next exact
 * sample is a beginning, no mended jump.
 */
void encoder_forget(struct encoder *encoder);

#endif
