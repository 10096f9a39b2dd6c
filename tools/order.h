/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Orders for the daemon, through the socket in its runtime folder. */
#ifndef TOOLS_ORDER_H
#define TOOLS_ORDER_H

enum { ORDER_TEXT_MAX = 4096 };

/*
 * "config VERB DEVICE": 0 = the daemon does it or did it, else -errno (-EPERM:
 * it refused). What it said, or why nobody answered, goes into `text`. Waits at
 * most ten seconds. Cold.
 */
int order_give(const char *runtime_directory, const char *verb, const char *device,
	       char text[ORDER_TEXT_MAX]);

/* The daemon of this folder, 0 if there is none or it cannot be seen. Cold. */
int order_daemon(const char *runtime_directory);

#endif
