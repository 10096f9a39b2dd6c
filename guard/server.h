/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The guard's side of the handover of AF_XDP sockets; see daemon/transport/handover.h. */
#ifndef GUARD_SERVER_H
#define GUARD_SERVER_H

#include <poll.h>
#include <stdbool.h>
#include <stdint.h>

enum { GUARD_SERVER_FDS = 2 };

struct guard_server {
	const char *path;
	int listener, client; /* -1 = none */
	int sockets, ports;   /* maps of the program */
	uint32_t index;       /* the interface, 0 = there is none now */
	bool native;
	bool joined;               /* the client's replies are directed to it */
	uint64_t patient_until_ns; /* with a client that has not joined, if another waits */
};

#define GUARD_SERVER_CLOSED { .listener = -1, .client = -1 }

/* Listen at `path`, for the group pokeys if there is one. 0 or -errno. */
int guard_server_open(struct guard_server *server, const char *path, int sockets, int ports);

/*
 * Do what the descriptors in `fds` are ready for, and fill in those to poll next
 * (-1 where there is none). Never waits. now_ns is CLOCK_MONOTONIC; to be called some
 * times a second.
 */
void guard_server_run(struct guard_server *server, struct pollfd fds[GUARD_SERVER_FDS],
		      uint64_t now_ns);

/* Nothing is directed to anybody any more. Idempotent. */
void guard_server_close(struct guard_server *server);

#endif
