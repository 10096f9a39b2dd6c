/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The pulse engine as a whole.
 */
#ifndef HALBRIDGE_ENGINE_H
#define HALBRIDGE_ENGINE_H

#include <pokeys/state.h>
#include "halbridge/values.h"

/* From a fresh state image to the pins. Realtime. */
void engine_read(struct values *values, const struct pokeys_engine *engine);

#endif
