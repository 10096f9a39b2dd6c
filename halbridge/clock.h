/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's clock.
 */
#ifndef HALBRIDGE_CLOCK_H
#define HALBRIDGE_CLOCK_H

#include <stdbool.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "halbridge/refusal.h"
#include "halbridge/values.h"

/* The clock to the pins. Realtime. */
void clock_read(struct pokeys_rtc *shown, bool *begun, struct values *values,
		const struct pokeys_rtc *rtc);

/*
 * The one-shot that sets the clock to what the pins say. False, and refused,
 * if that is no date or no time. Realtime.
 */
bool clock_wanted(const struct value_rtc *value, struct pokeys_one_shot *shot,
		  struct refusals *refusals);

#endif
