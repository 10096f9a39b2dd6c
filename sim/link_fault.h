/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_LINK_FAULT_H
#define SIM_LINK_FAULT_H

#include "sim/link.h"

/* What becomes of one packet pushed into the link. */
struct sim_link_fate {
	uint64_t due_ns;
	size_t len;
	unsigned int copies; /* 0: lost */
};

/*
 * Decides it, counts it, and damages the packet's bytes in place. `bytes` may
 * be anything when len is 0.
 */
void sim_link_decide(struct sim_link_way *way, uint64_t now_ns, uint8_t *bytes, size_t len,
		     struct sim_link_fate *fate);

/* One travel time drawn from the distribution. */
uint64_t sim_delay_draw(const struct sim_delay *delay, struct sim_prng *prng);

#endif
