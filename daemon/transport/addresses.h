/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The IPv4 addresses of this computer, each with its interface. Cold: for the control
 * thread and the tools, never for the realtime thread.
 */
#ifndef TRANSPORT_ADDRESSES_H
#define TRANSPORT_ADDRESSES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { ADDRESSES_OWN_MAX = 256 };

struct own_address {
	uint32_t address;       /* host byte order */
	uint32_t broadcast;     /* of its network; 0 = it has none (/31, /32) */
	unsigned int interface; /* index */
	uint8_t prefix;         /* length of its network's, bits */
	bool loopback;
	bool broadcasts; /* the interface can send them */
};

/*
 * Addresses of interfaces that are up. A label (v0:pk) is no name of an interface, and a
 * broadcast address that nobody has set is none for the kernel: so both come from the
 * interface's index and the length of the prefix. Only those of the interface `only`, or of
 * all if it is 0. Returns how many, at most `room`, or -errno.
 */
int addresses_own(struct own_address *out, size_t room, unsigned int only);

#endif
