/* SPDX-License-Identifier: GPL-2.0-or-later */
/* When the service manager may be told that the daemon lives. */
#ifndef CONTROL_WATCHDOG_H
#define CONTROL_WATCHDOG_H

#include <stdbool.h>
#include <stdint.h>

struct watchdog {
	uint64_t interval_ns;		/* 0 = nobody watches */
	uint64_t next_ns;
	uint64_t cycles;		/* at the last look */
};

/* `limit_ns`: silent for longer, and the service manager acts; 0 = it does not. */
void watchdog_init(struct watchdog *watchdog, uint64_t limit_ns, uint64_t cycles, uint64_t now_ns);

/* True = give a sign of life now. Call often, but not twice within a cycle. */
bool watchdog_due(struct watchdog *watchdog, uint64_t cycles, uint64_t now_ns);

#endif
