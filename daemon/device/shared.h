/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Terminals that two settings of this board use, or that it lacks, each told once. */
#ifndef DEVICE_SHARED_H
#define DEVICE_SHARED_H

#include <stddef.h>
#include <stdint.h>
#include <pokeys/settings.h>
#include "settings/terminal.h"

struct device;

enum { SHARED_MAX = 16 };      /* more than that are not told */
enum { SHARED_FUNCTIONS = 4 }; /* that terminals are wanted for */

struct shared_pair {
	uint64_t terminals;
	uint8_t a, b; /* numbers of owners, settings/terminal.h */
};

/* What was told. */
struct shared {
	struct shared_pair pair[SHARED_MAX];
	size_t count;
	uint64_t absent[SHARED_FUNCTIONS]; /* terminals */
	uint32_t pwm;                      /* channels that a commander has enabled so far */
};

/* A commander enables these PWM channels: their terminals are judged with the next report. */
void shared_pwm(struct device *device, uint32_t channels);

/* Settings are settled: log which terminals two of them use, or the board lacks. Between cycles. */
void shared_tell(struct device *device, const struct pokeys_report *report);

#endif
