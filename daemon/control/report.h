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
	bool known; /* an image was read */
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

/* systemd ignores a message of more than 4096 bytes, and this is a part of one. */
enum { REPORT_STATUS_SIZE = 4000 };

/*
 * "mill running, 212 us; lathe searching: no answer". If not all devices fit, those
 * that are on come first, since a package upgrade searches the text for them; then those that are
 * not running; and the others are only counted. `size`: at least 256. Returns the length.
 */
size_t report_status(const struct report *report, char *text, size_t size);

/* Prometheus' text format. 0, or -errno if the stream failed. */
int report_metrics(const struct report *report, FILE *to);

#endif
