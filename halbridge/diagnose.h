/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Rates, counters and states of the driver itself.
 */
#ifndef HALBRIDGE_DIAGNOSE_H
#define HALBRIDGE_DIAGNOSE_H

#include <pokeys/state.h>
#include "halbridge/values.h"

/* From a state image, fresh or not, to the pins. Realtime. */
void diagnose_read(struct values *values, const struct pokeys_state *state);

#endif
