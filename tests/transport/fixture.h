/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A transport of the kind named on the command line, and peers on loopback. */
#ifndef TESTS_TRANSPORT_FIXTURE_H
#define TESTS_TRANSPORT_FIXTURE_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include "daemon/transport/transport.h"

enum { MS = 1000000 };

/* When to give up waiting for an event; not a requirement on its speed. */
#define FIXTURE_PATIENCE_NS UINT64_C(60000000000)

struct peer {
	int fd;
	struct transport_address at;
	struct transport_address from; /* of what it received last */
};

struct world {
	struct transport *t;
	struct peer peer; /* channel 0 is aimed at it */
};

/*
 * "io_uring", "socket" or "xdp": argv[1]; ends the program with 77 if it cannot be
 * had here. For "xdp" the program moves to a network of its own (xdp_world.h).
 */
extern const char *fixture_kind;
void fixture_begin(int argc, char **argv);

/* What to open it with. */
struct transport_options fixture_options(void);

uint64_t fixture_now(void);

/* A UDP socket where the peers are. */
int peer_socket(void);

/* A socket on a loopback address of this process; blocking with a time limit. */
void peer_open(struct peer *peer);
void peer_close(struct peer *peer);
/* Send to where the last datagram came from. */
void peer_send(struct peer *peer, const void *data, size_t length);
/* Length of the next datagram within a second, -1 = none came. */
int peer_receive(struct peer *peer, void *data, size_t size);
/* The same without waiting. */
int peer_look(struct peer *peer, void *data, size_t size);

/* cmocka set-up and tear-down: a started transport, channel 0 aimed at world->peer. */
int world_begin(void **state);
int world_end(void **state);

/* Open, attach `channels`, start. */
struct transport *fixture_transport(uint32_t channels, bool spin);

/*
 * Send one datagram and have the peer take it: from now on it can answer. A kind
 * that has to find its way (tend) has found it then.
 */
void introduce(struct transport *t, uint32_t channel, struct peer *peer);

/* The next packet within `ms`; 1, or 0 if none came. */
int next_packet(struct transport *t, uint32_t ms, struct transport_packet *out);

#endif
