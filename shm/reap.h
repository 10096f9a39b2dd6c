/* SPDX-License-Identifier: MIT */
/* Clean up after processes that died while they were attached to a root. */
#ifndef SHM_REAP_H
#define SHM_REAP_H

#include "shm/iox.h"

/*
 * Free what dead nodes have had in the services that were made by `node`, and remove their files.
 * Returns how many there were, or -errno. Not realtime; never waits.
 */
int reap(const struct iox_node *node, const char *root);

#endif
