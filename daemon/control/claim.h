/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Who drives the device at an address: one daemon of this machine, and one
 * section of its configuration.
 *
 * The control thread's, cold. A device is aimed at only when its address is ours.
 */
#ifndef CONTROL_CLAIM_H
#define CONTROL_CLAIM_H

#include "daemon/control/tell.h"
#include "daemon/rt/loop.h"

struct claim {
	int fd;           /* -1 = none */
	uint64_t held;    /* ip << 16 | port, 0 = none */
	uint64_t refused; /* that has been told */
	uint64_t next_ns; /* not tried again before */
};

struct claims {
	const struct teller *teller;
	struct loop_shared *shared;
	struct claim device[TRANSPORT_CHANNELS];
};

void claims_init(struct claims *claims, const struct teller *teller, struct loop_shared *shared);

/*
 * Claim the addresses that are wanted, those of the configuration or those that were
 * found (ip << 16 | port each, 0 = none), and aim the devices whose address is ours. What
 * somebody else has is told once and tried again ten times a second.
 */
void claims_run(struct claims *claims, const _Atomic uint64_t found[TRANSPORT_CHANNELS],
		uint64_t now_ns);

/* Give everything back. Idempotent. */
void claims_close(struct claims *claims);

#endif
