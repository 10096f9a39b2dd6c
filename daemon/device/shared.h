/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Terminals that two settings of this board use, each told once. */
#ifndef DEVICE_SHARED_H
#define DEVICE_SHARED_H

#include <stddef.h>
#include <stdint.h>
#include <pokeys/settings.h>
#include "settings/terminal.h"

struct device;

enum { SHARED_MAX = 16 };		/* more than that are not told */

struct shared_pair {
	uint64_t terminals;
	uint8_t a, b;			/* numbers of owners, settings/terminal.h */
};

/* What was told. */
struct shared {
	struct shared_pair pair[SHARED_MAX];
	size_t count;
};

/* Settings are settled: log which terminals two of them use. Between cycles. */
void shared_tell(struct device *device, const struct pokeys_report *report);

#endif
