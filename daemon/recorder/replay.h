/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A record read back: what was asked, what was answered, and which belongs to which.
 * Of pokeysd's own files and of any capture of PoKeys traffic in pcapng. Cold.
 */
#ifndef RECORDER_REPLAY_H
#define RECORDER_REPLAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum replay_kind { REPLAY_REQUEST, REPLAY_REPLY, REPLAY_EVENT };

enum { REPLAY_NONE = -1, REPLAY_NAME = 32, REPLAY_DATA = 64 };

struct replay_line {
	uint64_t t_ns; /* since 1970 */
	enum replay_kind kind;
	char device[REPLAY_NAME]; /* the interface's name */
	char *text;               /* event: its words; NULL otherwise */
	int level;                /* event: syslog's */
	uint32_t address;         /* the device's, IPv4, host byte order */
	uint16_t port;
	uint16_t length; /* of the datagram */
	uint16_t kept;   /* bytes in `data` */
	uint8_t data[REPLAY_DATA];
	uint32_t cycle;
	bool known;        /* the daemon has told try or verdict, cycle and taken_ns */
	bool stamped;      /* reply: taken_ns is known */
	uint8_t tries;     /* request */
	bool once;         /* request: a newer one replaces it */
	uint8_t verdict;   /* reply: enum pokeys_verdict */
	uint64_t taken_ns; /* reply: until the daemon looked at it */
	ptrdiff_t partner; /* line of the reply, or of the try before; REPLAY_NONE */
	ptrdiff_t again;   /* request: line of its next try; REPLAY_NONE */
	ptrdiff_t before;  /* request: line of the try before; REPLAY_NONE */
};

struct replay {
	struct replay_line *line;
	size_t lines, room;
	size_t others; /* packets that are no PoKeys traffic */
};

/* Read it whole. 0, -ENOMEM, or -EPROTO with one line in `why`. replay_free() in any case. */
int replay_load(struct replay *replay, FILE *from, char *why, size_t size);
void replay_free(struct replay *replay);

/* A request's first try and its answer, from whichever try; the answer may be NULL. */
const struct replay_line *replay_first_try(const struct replay *replay,
					   const struct replay_line *line);
const struct replay_line *replay_answer(const struct replay *replay,
					const struct replay_line *line);

/*
 * The operation's name as in wire/ops.h, "0x.." for one that is not there; a reply's is its
 * request's, if that is known. Static text.
 */
const char *replay_operation(const struct replay *replay, const struct replay_line *line);

#endif
