/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The file format pcapng (draft-ietf-opsawg-pcapng), as much of it as a record has:
 * Wireshark, tshark and tcpdump read it. Cold; what goes wrong with writing stands in
 * ferror(). Times are ns since 1970.
 */
#ifndef RECORDER_PCAPNG_H
#define RECORDER_PCAPNG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum {
	PCAPNG_INTERFACES = 256, /* of a file that is read */
	PCAPNG_TEXT = 512,       /* of a comment, a name or a message, with its end */
	PCAPNG_FRAME = 65535,    /* of a packet that is read */
};

/* The beginning: who wrote it, and what it is. */
void pcapng_begin(FILE *to, const char *application, const char *comment);

/* An Ethernet interface; they count from 0. */
void pcapng_interface(FILE *to, const char *name, const char *description);

struct pcapng_packet {
	uint32_t interface;
	uint64_t t_ns;
	bool inbound, outbound; /* neither: not known */
	uint32_t kept, length;  /* bytes in `data`, and of the packet */
	const uint8_t *data;
	const char *comment; /* empty: none */
};

void pcapng_packet(FILE *to, const struct pcapng_packet *packet);

/* What happened beside the packets, as an entry of the system's journal. */
struct pcapng_entry {
	uint64_t t_ns;
	int level;                 /* syslog's */
	const char *device, *text; /* device: empty = none */
};

void pcapng_entry(FILE *to, const struct pcapng_entry *entry);

/* What is found when it is read; each returns false to end the reading. */
struct pcapng_take {
	bool (*packet)(void *context, const char *interface, const struct pcapng_packet *packet);
	bool (*entry)(void *context, const struct pcapng_entry *entry);
	void *context;
};

/*
 * Read a file of any writer: packets of Ethernet interfaces and journal entries; all
 * other blocks are passed over. 0, or -EPROTO / -errno with one line in `why`.
 */
int pcapng_read(FILE *from, const struct pcapng_take *take, char *why, size_t size);

#endif
