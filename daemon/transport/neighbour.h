/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the kernel knows of the way to an address; see neighbour.c. */
#ifndef TRANSPORT_NEIGHBOUR_H
#define TRANSPORT_NEIGHBOUR_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/transport/frame.h"

struct neighbour {
	uint8_t mac[FRAME_MAC]; /* of the device, or of the router before it */
	bool stale;             /* the kernel would like to ask again */
};

/* A socket to ask through. Cold. The descriptor or -errno. */
int neighbour_open(void);

/*
 * The next hop from `from` to `to` (host byte order) by interface `index`, and
 * its MAC address. 0; -ENOENT: not resolved yet, or gone; -EHOSTUNREACH: there is
 * no way; or -errno. Cold.
 */
int neighbour_find(int fd, uint32_t index, uint32_t from, uint32_t to, struct neighbour *out);

/* The interface's own MAC address; -EPROTONOSUPPORT if it is not Ethernet. Cold. */
int neighbour_own(const char *interface, uint8_t mac[FRAME_MAC]);

/*
 * True if the interface is a VLAN or a bond: its frames come in at another one. AF_XDP
 * gains nothing on the first; for a socket of the second the kernel drops them. Cold.
 */
bool neighbour_is_upper(const char *interface);

#endif
