/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the kernel knows of a neighbour's hardware address. Cold, no privilege. */
#ifndef TOOLS_NEIGHBOUR_H
#define TOOLS_NEIGHBOUR_H

#include <stdbool.h>
#include <stdint.h>

enum { NEIGHBOUR_MAC = 18 };

enum neighbour {
	NEIGHBOUR_UNSEEN,    /* could not be asked */
	NEIGHBOUR_NONE,      /* no entry, or it is being asked for just now */
	NEIGHBOUR_FAILED,    /* nobody answers for this address */
	NEIGHBOUR_STALE,     /* known, and to be confirmed before long */
	NEIGHBOUR_REACHABLE, /* known, for some seconds */
	NEIGHBOUR_PERMANENT,
};

/*
 * Of an IPv4 address (host byte order) at an interface, by netlink; with a root
 * other than "" from ROOT/proc/net/arp, which tells reachable and stale, failed
 * and none not apart and is then REACHABLE or NONE. Its hardware address goes into
 * mac as text, "" where it is not known.
 */
enum neighbour neighbour_look(const char *root, const char *nic, uint32_t address,
			      char mac[NEIGHBOUR_MAC]);

/*
 * The interface at which ROOT/proc/net/arp has a complete entry for this address: `nic` if it
 * is one of them, else the first. Not of a `nic` of its own: "" goes. False if there is none.
 */
bool neighbour_interface(const char *root, uint32_t address, const char *nic, char found[16]);

#endif
