/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The UDP socket of a channel, as the ring and plain sockets both use it. */
#ifndef TRANSPORT_UDP_H
#define TRANSPORT_UDP_H

#include <net/if.h>
#include <netinet/in.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>
#include <time.h>
#include "daemon/transport/transport.h"

enum {
	/* room for one SO_TIMESTAMPNS message */
	UDP_CONTROL = CMSG_SPACE(sizeof(struct timespec)),
};

struct udp {
	int fd; /* -1 = not attached */
	bool connected;
	bool aside;               /* bound to the interface of the device, not to ours */
	char interface[IFNAMSIZ]; /* bound to it, "" = any */
};

/*
 * Open a nonblocking UDP socket that stamps what it receives. Cold. 0 or
 * -errno (-ENODEV: no such interface).
 */
int udp_open(struct udp *udp, const struct transport_options *options);

/* Close it if it is open. Cold. */
void udp_close(struct udp *udp);

/*
 * See transport_ops.aim; *local becomes our end, address 0 if there is none.
 * Adds the system calls it made to *calls. Realtime.
 */
int udp_aim(struct udp *udp, const struct transport_address *to, struct transport_address *local,
	    uint64_t *calls);

/* The kernel's stamp (wall clock, ns) in a control buffer, 0 if there is none. Realtime. */
uint64_t udp_stamp(struct msghdr *message);

/* Fill in the packet's source. Realtime. */
void udp_source(const struct sockaddr_in *source, size_t length, struct transport_packet *out);

#endif
