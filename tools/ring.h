/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The recorder's ring of the daemon that is meant, for the commands that read it. */
#ifndef TOOLS_RING_H
#define TOOLS_RING_H

#include "daemon/recorder/read.h"
#include "tools/pokeysctl.h"

/* Open it, to be given back by recorder_release(). 0, or -errno with the reason complained. */
int ring_open(const struct options *options, struct recorder_file *ring);

#endif
