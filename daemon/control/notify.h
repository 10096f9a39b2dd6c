/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the service manager is told (sd_notify(3)); without one, nothing happens. Never waits. */
#ifndef CONTROL_NOTIFY_H
#define CONTROL_NOTIFY_H

#include <stdint.h>

/* How long it lets us be silent, ns; 0 = it does not watch. */
uint64_t notify_watchdog_limit(void);

/*
 * One line on how things are, sent if it has changed. The first says READY as
 * well: devices are asked and the shared memory can be attached.
 */
void notify_status(const char *status);

void notify_alive(void);
void notify_stopping(void);

#endif
