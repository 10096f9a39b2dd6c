/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Times of the loops. */
#ifndef LOOPS_DURATION_H
#define LOOPS_DURATION_H

#include <stdint.h>

#define SECOND 1e9	/* ns */

/* How long ago something was; 0 if that is still to come: it was measured a moment after `now`. */
static inline uint64_t since(uint64_t then_ns, uint64_t now_ns)
{
	return now_ns > then_ns ? now_ns - then_ns : 0;
}

#endif
