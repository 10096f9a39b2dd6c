/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A client that asks a device once a period, in one of several ways. A way is
 * how packets go out and come in; all else is the same for all of them.
 */
#ifndef BENCH_CLIENT_H
#define BENCH_CLIENT_H

#include <stdbool.h>
#include <stdint.h>
#include "bench/ask.h"
#include "bench/samples.h"

#define CLIENT_TIMEOUT_NS UINT64_C(20000000)

struct client {
	struct ask ask;
	int fd;                     /* a socket that is connected to the device */
	uint32_t open;              /* bit = question without an answer so far */
	uint64_t tick_ns, begin_ns; /* when the cycle was due, and began */
	uint64_t lost;
	struct samples newest; /* the cycle's last answer, since it was asked for */
	struct samples all;    /* from the start of the cycle until all answers are in */
};

struct client_way {
	const char *name;
	bool spins; /* awake before the tick, and never sleeps for an answer */
	/* Once; 0, or the reason why this machine cannot. */
	const char *(*open)(struct client *client);
	/* All questions of one cycle and their answers, or until client_late(). */
	void (*cycle)(struct client *client);
};

/* Ends with a way without a name. */
extern const struct client_way client_socket_ways[], client_ring_ways[], client_xdp_ways[];

uint64_t client_now(void);

/* All questions get new ids and are open from now on. */
void client_stamp_all(struct client *client);

/* A datagram came: counted if it answers an open question. */
void client_take(struct client *client, const uint8_t *packet, ssize_t length);

/* Nothing is to be waited for any more in this cycle. */
bool client_late(const struct client *client);

/* The address of the interface that the socket leaves by; its name into `name`. */
struct sockaddr_in;
const char *client_interface(const struct client *client, struct sockaddr_in *own, char name[16]);

/*
 * An XDP program on that interface while this process lives, so that it is polled
 * (NAPI). It passes everything. NULL, or why not.
 */
const char *client_make_polled(const struct client *client);

#endif
