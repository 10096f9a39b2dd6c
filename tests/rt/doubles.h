/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Stand-ins for devices and shared memory, and a world in virtual time to run
 * the loop in.
 */
#ifndef TESTS_RT_DOUBLES_H
#define TESTS_RT_DOUBLES_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include "daemon/rt/internal.h"
#include "daemon/transport/memory.h"

#define US	UINT64_C(1000)
#define MS	UINT64_C(1000000)
#define SECOND	UINT64_C(1000000000)

enum { REQUESTS = 8, LOG = 4096 };

struct request {
	bool open, fast;
	uint8_t number;
	uint64_t sent_ns, due_ns;
};

/* A device that asks `fast` + `slow` things a cycle and resends at a fixed deadline. */
struct device {
	/* set by the test */
	uint32_t fast, slow; /* requests a cycle */
	uint64_t deadline_ns;
	bool wants_address, in_use;
	bool overdue;              /* claims for ever that it is due */
	uint64_t stop_takes_ns;    /* until it has stopped */
	uint64_t deliver_takes_ns; /* work for each packet */
	uint8_t link;

	/* seen by the test */
	struct pokeys_io io;
	struct request request[REQUESTS];
	uint8_t next_number;
	uint64_t cycles, cycle, tick_ns, resent, delivered, checked;
	uint64_t tick_log[LOG];
	uint64_t delivered_late_ns; /* longest from arrival to delivery */
	uint64_t address_ns, stop_ns;
	uint32_t address;
	uint16_t port;
	bool stopping;
	uint64_t suspended, suspended_cycles; /* how often told, and its cycles until then */
	uint64_t slept_ns;                    /* in all of these */
	uint64_t ends, ended_cycles;          /* how often it was told, and its cycles until then */
	int refused;
	uint64_t commands, heartbeat;
	uint32_t wishes, wish_generation, orders, last_order, wanted_axes;
	uint64_t order_cycle[8]; /* cycle of each of the first orders */
	int order_result;        /* set by the test: what an order shall return */
	uint32_t report_count;   /* set by the test: reports that have become due */
	uint32_t reported;
	uint64_t last_send_ns[4]; /* of the last requests, newest first */
};

struct shm_device {
	struct pokeys_state cell[2];
	uint32_t newest;
	bool loaned;
	uint64_t published, published_log[LOG]; /* when */
	uint64_t diags, diag_log[LOG];
	struct pokeys_diag diag;
	int command_result; /* what read_command shall return */
	struct pokeys_command command;
	int wish_result; /* what read_wish shall return, once */
	struct pokeys_wish wish;
	uint64_t reports, report_before_state;
	struct pokeys_report report;
};

struct world {
	uint64_t now;
	struct transport *t;
	struct loop loop;
	struct device device[TRANSPORT_CHANNELS];
	struct shm_device shm[TRANSPORT_CHANNELS];

	/* set by the test */
	uint64_t round_trip_ns[TRANSPORT_CHANNELS]; /* 0 = does not answer */
	uint64_t lose;           /* the n-th datagram of channel 0, from 1; 0 = none */
	uint64_t asleep_ns;      /* suspended so far */
	uint64_t clock_takes_ns; /* to read the clock that counts that, each tenth time */
	uint64_t oversleep_ns;   /* added to the next sleep, once */
	uint64_t wait_late_ns;   /* added to the next wait for packets, once */
	uint64_t publish_takes_ns;
	uint64_t end_ns; /* stop is asked for then */
	int aim_result;
	void (*on_look)(struct world *w, uint32_t channel); /* at a command image */
	void (*on_sent)(struct world *w, uint32_t channel, const uint8_t *data, size_t length);

	/* seen by the test */
	uint64_t sent[TRANSPORT_CHANNELS], sent_log[TRANSPORT_CHANNELS][LOG];
	uint64_t boot_reads, sleeps, slept_ns, waits, spun_ns, waited_ns;
	uint64_t aims, aim_log[LOG];
	struct transport_address aimed_at[TRANSPORT_CHANNELS];
};

extern struct world world;

/* A loop of `count` devices with a period of 1 ms, sleeping, answering in 100 us. */
void world_begin(uint32_t count);
/* Prepare with what is set, and run until world.end_ns; the loop's result. */
int world_run(uint64_t for_ns);
void world_end(void);

/* The next event of that code, or NULL. Events before it are thrown away. */
const struct event *world_event(uint16_t code);

#endif
