/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the control thread says of the daemon: one line of status, a page of metrics. */
#ifndef CONTROL_REPORT_H
#define CONTROL_REPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <pokeys/state.h>
#include "daemon/control/guarded.h"
#include "daemon/transport/transport.h"

/* The daemon's first reader: what has been published, as anybody sees it. */
struct report_device {
	const char *name;
	bool known;			/* an image was read */
	struct pokeys_state state;
	struct pokeys_diag diag;
};

struct report {
	uint64_t now_ns;
	uint64_t log_dropped, metrics_failed, requests_refused;
	struct guarded guard;
	uint32_t devices;
	struct report_device device[TRANSPORT_CHANNELS];
};

/* Room for the status of all devices. A package upgrade searches it for a device that is on. */
enum { REPORT_STATUS_SIZE = 128 * TRANSPORT_CHANNELS };

/* "mill running, 212 us; lathe searching: no answer". Returns the length. */
size_t report_status(const struct report *report, char *text, size_t size);

/* Prometheus' text format. 0, or -errno if the stream failed. */
int report_metrics(const struct report *report, FILE *to);

#endif
