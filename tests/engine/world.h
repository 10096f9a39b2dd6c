/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A mailbox polling a device through a faulty link, in virtual time, with the
 * invariants I1 to I5 checked at every tick.
 *
 * The device here is a stamp: it puts into each reply which request, counted
 * by creation, it answers. So a value that is published from the wrong reply
 * is seen, whatever the reason.
 */
#ifndef TESTS_ENGINE_WORLD_H
#define TESTS_ENGINE_WORLD_H

#include "tests/engine/script.h"
#include "sim/link.h"
#include "sim/prng.h"

enum {
	WORLD_QUEUE = 512, /* requests waiting at the device */
	WORLD_BUDGET_MAX = 16384,
	WORLD_REQUESTS = 65536, /* the last so many are known */
};

struct world_options {
	struct pokeys_options mailbox;
	struct sim_link_faults way[SIM_LINK_DIRS];
	uint64_t service_ns;        /* of the device for a request */
	uint64_t period_ns;         /* of the polling cycle; default 1 ms */
	uint64_t tick_ns;           /* of the world; default 100 us */
	unsigned int per_cycle;     /* requests a cycle, default 2, up to 3 */
	bool status_only;           /* every request is a pulse engine status */
	unsigned int oneshot_every; /* cycles between one-shots, 0 = none */
	unsigned int cancel_every;  /* requests between cancelled ones, 0 = none */
};

/* What is known about one request. */
struct world_request {
	struct world *world;
	uint64_t number;                          /* by creation, from 0 */
	uint64_t created_ns, served_ns, ended_ns; /* served: the first time */
	uint8_t ends, sends, executed;
	uint8_t state; /* enum pokeys_request_state, how it ended */
	bool oneshot;
};

struct world_waiting {
	uint64_t done_ns;
	uint8_t bytes[POKEYS_PACKET_SIZE];
};

struct world {
	struct world_options options;
	uint64_t seed, now, next_cycle_ns, cycle;
	pokeys_device_t dev;
	struct sim_link link;
	struct sim_prng prng;
	struct world_request request[WORLD_REQUESTS]; /* index: number, modulo */
	uint64_t requests;                            /* created so far */
	uint64_t ended;
	uint64_t arrived_ns; /* of the packet taken last */
	bool idle;           /* create nothing more */
	unsigned int queue_head, queue_count;
	struct world_waiting queue[WORLD_QUEUE];
	uint64_t sends, resends;
	uint64_t send_times[WORLD_BUDGET_MAX], resend_times[WORLD_BUDGET_MAX];
	uint64_t corrupt_payloads; /* accepted, as nothing in the protocol can see it */
	uint64_t last_done_ns;
	/* the reply to one request is held back until so many more were created */
	uint64_t hold_request, hold_for;
	bool hold_copy; /* the reply itself goes through, a copy is held */
	bool held;
	uint8_t held_reply[POKEYS_PACKET_SIZE];
	uint8_t last_replies[256][POKEYS_PACKET_SIZE]; /* the newest ones made */
	uint32_t replies;
};

/* Seed: from POKEYS_SEED if it is set, else the given one. Printed. */
uint64_t world_seed(uint64_t seed);

void world_open(struct world *w, const struct world_options *options, uint64_t seed);

/* A request that is still known. */
const struct world_request *world_request(const struct world *w, uint64_t number);

/* One tick: device, receive, check, perhaps a cycle of requests; invariants. */
void world_tick(struct world *w);
void world_run(struct world *w, uint64_t for_ns);

/* The client gets no processor time for so long; device and network go on. */
void world_stall(struct world *w, uint64_t for_ns);

/* Create nothing more, let everything end, check that it did, exactly once. */
void world_drain(struct world *w);

/* Requests created, per thousand of which ended answered. */
unsigned int world_answered_permille(const struct world *w);

#endif
