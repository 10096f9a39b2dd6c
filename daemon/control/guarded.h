/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What pokeys-guard(8) says of itself: whether it is on our interface, and its counters. */
#ifndef CONTROL_GUARDED_H
#define CONTROL_GUARDED_H

#include <stdbool.h>
#include <stdint.h>

#define GUARDED_FILE "/run/pokeys-guard/status"

enum { GUARDED_COUNTERS = 24 };

struct guarded {
	bool on;                  /* on the interface asked for, and heard of within 3 s */
	char mode[16];            /* "native" or "generic" */
	uint64_t passed, dropped; /* sums of the counters pass_... and drop_... */
	uint32_t counters;
	struct {
		char name[24]; /* a-z and _ only: pass_..., drop_... */
		uint64_t value;
	} counter[GUARDED_COUNTERS];
};

/*
 * Read the file at `path`; anything that is wrong with it is as if it was not
 * there. `interface` empty = none of ours is guarded. now_ns is CLOCK_MONOTONIC.
 * Control thread; never waits.
 */
void guarded_read(struct guarded *out, const char *path, const char *interface, uint64_t now_ns);

#endif
