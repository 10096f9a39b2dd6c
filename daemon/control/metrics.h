/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The metrics file: off unless configured, never fatal. */
#ifndef CONTROL_METRICS_H
#define CONTROL_METRICS_H

#include "daemon/control/report.h"

struct metrics {
	const char *path; /* empty = off */
	uint64_t interval_ns, next_ns;
	uint64_t failed;
	int last; /* -errno of the last write, 0 = it went well */
};

void metrics_init(struct metrics *metrics, const char *path, uint64_t interval_ns, uint64_t now_ns);

bool metrics_due(const struct metrics *metrics, uint64_t now_ns);

/* Replace the file as a whole. 0, or -errno (counted; the old file is untouched). */
int metrics_write(struct metrics *metrics, const struct report *report, uint64_t now_ns);

#endif
