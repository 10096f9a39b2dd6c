/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Moves of a device's servo motors along a path (daemon/loops/path.h). Realtime thread only.
 */
#ifndef DEVICE_MOVING_H
#define DEVICE_MOVING_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include "daemon/loops/handover.h"
#include "daemon/loops/path.h"
#include "daemon/loops/servo.h"

struct moving {
	struct path path;		/* its axes are the motors, by their index */
	bool good;			/* its configuration can be used */
	uint8_t motors;			/* bit = motor that is held on the path, or at its end */
	double place[POKEYS_SERVOS];	/* ... there, units */
	double velocity[POKEYS_SERVOS];	/* units/s */
	struct handover handover[POKEYS_SERVOS];
	bool open;			/* moves may go on from the last one */
	uint8_t end;			/* enum pokeys_moves_end */
	uint8_t refused;		/* enum pokeys_moves_refusal */
};

struct device;

/* After the motors. */
void moving_init(struct device *device);

/* In each cycle, before the motors' steps. */
void moving_cycle(struct device *device);
void moving_show(struct device *device);

/* Another commander than before. */
void moving_session(struct device *device);

/* It is on a path that has not ended. */
bool moving_moves(const struct device *device, unsigned int index);
/* It is homing now: wherever a path has left it. */
void moving_leave(struct device *device, unsigned int index);
/* Before a motor's step: what is commanded while it is held. */
void moving_wish(struct device *device, unsigned int index, struct servo_wish *wish);

/* One-shots. False if they refuse; why is in the image. */
bool moving_add(struct device *device, const struct pokeys_one_shot *shot);
/* The last move was accepted, or the queue was full: not worth an event. */
bool moving_is_usual(const struct device *device);
/* `which` is enum pokeys_moves_control. */
bool moving_control(struct device *device, unsigned int which, double value);

#endif
