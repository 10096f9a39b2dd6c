/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The kernel's receive stamps (wall clock) as CLOCK_MONOTONIC; see stamp.c. */
#ifndef TRANSPORT_STAMP_H
#define TRANSPORT_STAMP_H

#include <stdbool.h>
#include <stdint.h>

struct stamp {
	int64_t offset;    /* wall clock minus monotonic, ns */
	uint64_t since_ns; /* monotonic: the offset holds from here on */
	bool known, fresh;
};

/*
 * One reading: the wall clock was `real_ns` at some moment between the two
 * monotonic times. Realtime, pure.
 */
void stamp_sample(struct stamp *stamp, uint64_t before_ns, uint64_t real_ns, uint64_t after_ns);

/* A wall clock stamp as monotonic ns, 0 if it cannot be told. Realtime, pure. */
uint64_t stamp_convert(const struct stamp *stamp, uint64_t real_ns, uint64_t now_ns);

/* Read the clocks (vDSO, no system call) and sample; returns monotonic now. Realtime. */
uint64_t stamp_read(struct stamp *stamp);

/* CLOCK_MONOTONIC, ns. Realtime. */
uint64_t stamp_now(void);

#endif
