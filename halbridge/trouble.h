/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What is wrong, in one number for whoever asks for no more. */
#ifndef HALBRIDGE_TROUBLE_H
#define HALBRIDGE_TROUBLE_H

#include <stdbool.h>
#include <pokeys/state.h>
#include "halbridge/values.h"

enum trouble_code {
	TROUBLE_NONE = 0,
	TROUBLE_COMMUNICATION = 1, /* the device is not connected */
	TROUBLE_DEVICE = 2,        /* a motor driver reports an error */
	TROUBLE_LIMIT = 3,         /* a limit switch stopped the pulse engine */
	TROUBLE_EMERGENCY = 4,     /* the emergency input, or HAL's emergency-stop */
	TROUBLE_CONFIGURATION = 5, /* the device does not take a setting, or is locked */
	TROUBLE_HEATER = 6,        /* a heater with on-fault = machine has a fault */
};

struct trouble {
	bool connected_once;
	bool active; /* at the last read, since it was connected first */
};

/*
 * error-code, error-active and error-count of an image (`fresh`: its data may be used). A
 * component that was never connected shows an error and counts none. Realtime.
 */
void trouble_read(struct trouble *trouble, struct values *values, const struct pokeys_state *state,
		  bool fresh);

#endif
