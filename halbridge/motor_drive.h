/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoStep drivers and backlash on pins.
 */
#ifndef HALBRIDGE_MOTOR_DRIVE_H
#define HALBRIDGE_MOTOR_DRIVE_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "halbridge/values.h"

/* What the pins were last filled from. */
struct motor_drive {
	int16_t backlash[POKEYS_AXES];
	struct pokeys_postep postep[POKEYS_AXES];
	bool begun;
};

/* From the image to the values. Realtime; cheap where nothing has changed. */
void motor_drive_read(struct motor_drive *drive, struct values *values,
		      const struct pokeys_state *state, uint64_t now_ns);

#endif
