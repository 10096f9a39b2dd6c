/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the device is: the info.* pins.
 */
#ifndef HALBRIDGE_INFO_H
#define HALBRIDGE_INFO_H

#include <pokeys/state.h>
#include "halbridge/values.h"

/* What the pins were filled from; all zero at the begin. */
struct info_known {
	uint32_t serial;
	uint32_t hardware;
	uint8_t version[3], user_id, options; /* may change while it runs */
	struct pokeys_capability capability;
};

/* Fill info.* and devSerial when the device is known, or is another one. Realtime. */
void info_read(struct info_known *known, struct values *values, const struct pokeys_state *state);

#endif
