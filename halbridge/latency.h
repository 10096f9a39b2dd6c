/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How late the daemon is, from its histograms.
 */
#ifndef HALBRIDGE_LATENCY_H
#define HALBRIDGE_LATENCY_H

#include <pokeys/shm.h>
#include "halbridge/values.h"

/*
 * Read the diagnostic image into `diag` and fill the pins latency.*; without
 * one they keep what they had. Cold; one thread.
 */
void latency_round(struct values *values, pokeys_client *client, struct pokeys_diag *diag);

#endif
