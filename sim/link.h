/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_LINK_H
#define SIM_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "sim/prng.h"

/*
 * A faulty network between one client and one device, in either virtual or
 * real time: what is pushed in comes out late, twice, damaged or not at all.
 * Pure and of fixed size; no clock, no socket, no allocation. Not thread safe.
 * Times are nanoseconds of whatever clock the caller uses and never go back.
 */

#define SIM_LINK_PACKETS 1024	/* packets under way, both directions together */
#define SIM_LINK_BYTES 512	/* longest packet: the multi-part buffer fill */
#define SIM_LINK_NEVER UINT64_MAX

enum sim_link_dir {
	SIM_LINK_REQUEST, /* client to device */
	SIM_LINK_REPLY,   /* device to client */
	SIM_LINK_DIRS,
};

/* How long a packet travels. */
enum sim_delay_kind {
	SIM_DELAY_CONSTANT,   /* always `low` */
	SIM_DELAY_UNIFORM,    /* evenly in low..high */
	SIM_DELAY_HEAVY_TAIL, /* Pareto: at least `low`, shape `alpha`, cut at `high` */
};

struct sim_delay {
	enum sim_delay_kind kind;
	uint64_t low_ns;
	uint64_t high_ns;
	double alpha; /* heavy tail only; 1..2 is heavy, 0 is taken as 1.5 */
};

/* Probabilities are per packet, 0..1. All zero is a perfect link. */
struct sim_link_faults {
	double loss;
	/* Bursts (Gilbert-Elliott in continuous time): the link is good for
	 * burst_every_ns on average, then bad for burst_length_ns on average,
	 * and loses burst_loss of the packets while bad. Off while either
	 * time is 0. */
	uint64_t burst_every_ns;
	uint64_t burst_length_ns;
	double burst_loss;
	struct sim_delay delay;
	double duplicate;     /* packet is followed by `copies` more of itself */
	unsigned int copies;  /* 0 is taken as 1 */
	uint64_t copy_gap_ns; /* time between the copies */
	double reorder;       /* packet is overtaken by those of the next reorder_ns */
	uint64_t reorder_ns;
	double corrupt;  /* one bit of it is flipped, at a random place */
	double truncate; /* cut to a random shorter length, 0 included */
	double wrong_id; /* request id (byte 6) replaced, checksum made good */
	double wrong_op; /* operation (byte 1) replaced, checksum made good */
};

struct sim_link_options {
	struct sim_link_faults faults[SIM_LINK_DIRS];
};

/* What became of the packets, per direction. */
struct sim_link_stats {
	uint64_t pushed;
	uint64_t delivered;
	uint64_t lost;
	uint64_t lost_burst;
	uint64_t lost_silence;
	uint64_t duplicated; /* copies made */
	uint64_t reordered;
	uint64_t corrupted;
	uint64_t truncated;
	uint64_t wrong_id;
	uint64_t wrong_op;
	uint64_t overflow; /* queue full, packet dropped */
};

struct sim_link_packet {
	uint64_t due_ns;
	uint64_t order; /* packets due at one moment leave as they came */
	uint64_t peer;
	uint16_t len;
	uint8_t bytes[SIM_LINK_BYTES];
};

struct sim_link_way {
	struct sim_link_faults faults;
	struct sim_link_stats stats;
	struct sim_prng prng;
	uint64_t last_due_ns;
	uint64_t silent_from_ns;
	uint64_t silent_until_ns;
	uint64_t burst_change_ns; /* when the good or bad period ends */
	bool burst_bad;
	bool burst_started;
	unsigned int waiting;
	uint16_t heap[SIM_LINK_PACKETS];
};

struct sim_link {
	struct sim_link_way way[SIM_LINK_DIRS];
	uint64_t order;
	unsigned int free_count;
	uint16_t free_slots[SIM_LINK_PACKETS];
	struct sim_link_packet packets[SIM_LINK_PACKETS];
};

/*
 * Each direction draws from a stream of its own, so that changing the faults
 * of one leaves the other as it was. NULL options are a perfect link.
 */
void sim_link_init(struct sim_link *link, const struct sim_link_options *options, uint64_t seed);

/* New faults from now on; what is under way is not touched. */
void sim_link_set_faults(struct sim_link *link, enum sim_link_dir dir,
			 const struct sim_link_faults *faults);

/* Everything pushed in from_ns <= now < until_ns is lost. One window per direction. */
void sim_link_silence(struct sim_link *link, enum sim_link_dir dir, uint64_t from_ns,
		      uint64_t until_ns);

/* Whether it is in such a window. */
bool sim_link_is_silent(const struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns);

/*
 * Sends a packet of 0..SIM_LINK_BYTES bytes (longer ones count as overflow).
 * `peer` is handed back unchanged by sim_link_pop_from(): a server with many
 * clients keeps their addresses there.
 */
void sim_link_push_from(struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns,
			uint64_t peer, const uint8_t *bytes, size_t len);
void sim_link_push(struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns,
		   const uint8_t *bytes, size_t len);

/* Puts a packet on the wire untouched by any fault, to arrive at due_ns. */
void sim_link_inject(struct sim_link *link, enum sim_link_dir dir, uint64_t due_ns, uint64_t peer,
		     const uint8_t *bytes, size_t len);

/*
 * Takes the next packet that has arrived by now_ns. Returns true and its
 * length in *len (0 is possible: truncated, or a search), or false when
 * nothing has arrived. Of a packet longer than cap only cap bytes are copied
 * and *len is cap, as with a datagram socket. peer may be NULL.
 */
bool sim_link_pop_from(struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns,
		       uint64_t *peer, uint8_t *bytes, size_t cap, size_t *len);

/* As above for one peer; packets of length 0 cannot be told from nothing. */
size_t sim_link_pop(struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns, uint8_t *bytes,
		    size_t cap);

/* When the next packet of that direction arrives; SIM_LINK_NEVER if none is under way. */
uint64_t sim_link_next(const struct sim_link *link, enum sim_link_dir dir);

/* Forgets what is under way in that direction (a cable pulled out). */
void sim_link_flush(struct sim_link *link, enum sim_link_dir dir);

#endif
