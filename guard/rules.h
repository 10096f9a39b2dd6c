/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the program in the kernel and its loader share: the verdicts, one
 * counter each, and the table of devices. Both sides of it are compiled from
 * this file; maps that were pinned by a build with another layout are not used
 * again but made anew.
 */
#ifndef GUARD_RULES_H
#define GUARD_RULES_H

#include <linux/types.h>

enum {
	GUARD_DEVICES = 64,    /* as many as a daemon may have */
	GUARD_REPLY = 64,      /* bytes of a reply (protocol section 1.2) */
	GUARD_ANSWER = 19,     /* of an answer to a search (section 1.9) ... */
	GUARD_ANSWER_OLD = 14, /* ... and that of a PoKeys56E */
	GUARD_PORT = 20055,    /* whoever sends from here claims to be a device */
	/* Answers to searches that pass in a while, on each core: a network full of devices. */
	GUARD_ANSWERS = 256, /* a device answers more than one broadcast */
	GUARD_ANSWERS_MS = 100,
	/* A device that was heard of more recently is not taken for moved elsewhere. */
	GUARD_SILENT_MS = 500,
	GUARD_QUEUES = 64, /* of a card, as far as AF_XDP goes */
};

/* Verdict, its name in status and metrics, what it counts. Passes first. */
#define GUARD_VERDICT_TABLE(X) \
	X(SOCKET, "pass_socket", "replies given to the daemon's AF_XDP socket") \
	X(DEVICE, "pass_device", "replies of configured devices") \
	X(DEVICE_ELSE, "pass_device_else", "other packets of configured devices") \
	X(FOUND, "pass_discovery", "answers to a search") \
	X(LINK, "pass_link", "LACP, 802.1X and the like: from the other end of the cable") \
	X(ARP, "pass_arp", "ARP") \
	X(ICMP, "pass_icmp", "ICMP") \
	X(ELSE, "pass_else", "not aimed at the daemon") \
	X(FOREIGN, "drop_foreign", "from a PoKeys port, but from no configured device") \
	X(LENGTH, "drop_length", "replies of a length that none has") \
	X(FRAGMENT, "drop_fragment", "fragments, of which no reply is made") \
	X(EXCESS, "drop_discovery", "answers to a search, more than any network gives") \
	X(MALFORMED, "drop_malformed", "shorter than their headers say") \
	X(DEDICATED, "drop_else", "of others, on a dedicated interface")

#define GUARD_ENUM(id, name, help) GUARD_##id,
enum guard_verdict { GUARD_VERDICT_TABLE(GUARD_ENUM) GUARD_VERDICTS };
#define GUARD_FIRST_DROP GUARD_FOREIGN

/* address and port as on the wire (big-endian) */
struct guard_device {
	__u64 heard_ns; /* last reply, CLOCK_MONOTONIC */
	__u32 serial;   /* 0 = stays where it is configured */
	__u32 address;  /* 0 = not known yet */
	__u16 port;     /* 0 = no device, here and from here on */
	__u16 unused[3];
};

/* The daemon's own, that its AF_XDP socket takes replies for; big-endian, 0 = none from here on. */
struct guard_ports {
	__u16 port[GUARD_DEVICES];
};

struct guard_table {
	struct guard_device device[GUARD_DEVICES];
};

#endif
