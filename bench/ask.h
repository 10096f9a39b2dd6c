/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the clients of the bench ask a device, and which question a datagram answers. */
#ifndef BENCH_ASK_H
#define BENCH_ASK_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

enum { ASK_PACKET = 64, ASK_MAX = 16 };

struct ask {
	int count;
	uint8_t question[ASK_MAX][ASK_PACKET];
	uint8_t id;
};

/* The two fast questions of a cycle; with the slow ones too, as the daemon asks them. */
void ask_fast(struct ask *ask);
void ask_all(struct ask *ask);

/* A new id and checksum for a question. */
void ask_stamp(struct ask *ask, int i);

/* Which question a datagram answers, -1 if none. */
int ask_match(const struct ask *ask, const uint8_t *packet, ssize_t length);

#endif
