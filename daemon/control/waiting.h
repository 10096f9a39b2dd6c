/* SPDX-License-Identifier: GPL-2.0-or-later */
/* How the realtime thread waits: what there is to choose from, and the choice. */
#ifndef CONTROL_WAITING_H
#define CONTROL_WAITING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "daemon/control/config.h"

/* What kernel, card and configuration offer. */
struct waiting_facts {
	enum config_wait wanted;
	enum config_transport transport;
	int ring;              /* 0, or -errno: io_uring is not to be had */
	int ring_napi;         /* 0, or -errno: it cannot poll cards */
	int card_napi;         /* how many queues of the interface can be polled, or -errno */
	const char *interface; /* "" = none named */
	uint32_t busy_poll_us;
	int cpu;       /* of the realtime thread, -1 = any */
	bool isolated; /* from all other work */
	bool servo;    /* the isolated one of the highest number: LinuxCNC takes it */
};

struct waiting {
	enum config_wait wait; /* never auto */
	enum loop_mode mode;
	uint32_t busy_poll_us; /* 0 = do not poll */
	bool refused;          /* what was asked for is not to be had */
	char why[240];
};

/*
 * The way to wait: what the configuration asks for, or the best there is. Pure.
 *
 * auto takes spin on an isolated core that is ours alone, else napi where ring
 * and card can, else sleep.
 */
void waiting_choose(const struct waiting_facts *facts, struct waiting *out);

/* Its name as in pokeysd.conf. */
const char *waiting_name(enum config_wait wait);

/* Look at this machine. Cold: opens files, asks the kernel. */
void waiting_look(const struct config *config, struct waiting_facts *out);

/*
 * Whether `cpu` is in a list of cores as the kernel writes it ("2-3,5"), and
 * whether it is the highest there. Pure.
 */
bool waiting_in_list(const char *list, int cpu, bool *highest);

#endif
