/* SPDX-License-Identifier: GPL-2.0-or-later */
/* From the ring to a pcapng file. Cold. */
#ifndef RECORDER_EXPORT_H
#define RECORDER_EXPORT_H

#include <stdio.h>
#include "daemon/recorder/read.h"
#include "daemon/recorder/station.h"

enum { EXPORT_ALL = -1 };

struct export_options {
	int device;              /* index; EXPORT_ALL */
	const char *application; /* who writes: "pokeysctl 0.1.0" */
	const char *comment;     /* what it is */
	int64_t wall_ns;         /* to add to CLOCK_MONOTONIC for ns since 1970 */
	const struct stations *stations;
};

struct export_summary {
	uint64_t packets, events;
	uint64_t first_ns, last_ns; /* CLOCK_MONOTONIC; 0 = nothing was written */
};

/* What has to be added to CLOCK_MONOTONIC now. */
int64_t export_wall(void);

/*
 * Everything that the ring holds now, in the order of time. 0, or -errno: the
 * file is not whole then.
 */
int export_record(const struct recorder_file *file, const struct export_options *options, FILE *to,
		  struct export_summary *summary);

#endif
