/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The signals by which people and the service manager talk to the daemon: SIGTERM, SIGINT
 * and SIGHUP. The main thread's, cold.
 */
#ifndef CONTROL_SIGNALS_H
#define CONTROL_SIGNALS_H

/* From now on they wait until they are looked for; threads made later never take them. */
void signals_hold(void);

/* They act as on any program again; one that has waited does so at once. */
void signals_release(void);

/* The name of one that waits and asks us to end; NULL = none. It goes on waiting. */
const char *signals_ending(void);

/* Where they are read (non-blocking); before it signals_hold(). A descriptor, or -errno. */
int signals_open(void);

#endif
