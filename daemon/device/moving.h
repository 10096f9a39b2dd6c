/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Moves of a device's servo motors and axes along a path (daemon/loops/path.h). Realtime thread
 * only.
 */
#ifndef DEVICE_MOVING_H
#define DEVICE_MOVING_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include "daemon/device/axis_wish.h"
#include "daemon/loops/handover.h"
#include "daemon/loops/path.h"
#include "daemon/loops/servo.h"

/* A member is a servo motor, by its index, or an axis of the pulse engine, behind them. */
enum {
	MOVING_AXIS = POKEYS_SERVOS, /* member of axis 0 */
	MOVING_MEMBERS = POKEYS_SERVOS + POKEYS_AXES,
};

struct device;

struct moving {
	struct path path;                /* its axes are the members */
	bool good;                       /* its configuration can be used */
	bool any;                        /* there is something to move */
	uint16_t members;                /* bit = member that is held on the path, or at its end */
	double place[MOVING_MEMBERS];    /* ... there, units */
	double velocity[MOVING_MEMBERS]; /* units/s */
	struct handover handover[POKEYS_SERVOS];
	struct axis_wish wish[POKEYS_AXES]; /* of axes that are members */
	uint64_t released_ns;               /* when the last path has ended */
	bool held;                          /* its commander holds it */
	bool open;                          /* moves may go on from the last one */
	uint8_t end;                        /* enum pokeys_moves_end */
	uint8_t refused;                    /* enum pokeys_moves_refusal */
};

/* After the motors. */
void moving_init(struct device *device);

/* In each cycle, before the motors' steps and the pulse engine. */
void moving_cycle(struct device *device);
void moving_show(struct device *device);

/* Another commander than before. */
void moving_session(struct device *device);

/* It is on a path that has not ended. */
bool moving_moves(const struct device *device, unsigned int member);
/* ... any axis of the pulse engine is; is, or is held at its end. */
bool moving_moves_axes(const struct device *device);
bool moving_has_axes(const struct device *device);
/* It is held on the path, or at its end. */
bool moving_has(const struct device *device, unsigned int member);
/* It is homing now: wherever a path has left it. */
void moving_leave(struct device *device, unsigned int member);
/* Before a motor's step: what is commanded while it is held. */
void moving_wish(struct device *device, unsigned int motor, struct servo_wish *wish);
/* What an axis of the pulse engine is commanded, by the path or by the commander. */
const struct axis_wish *moving_axis_wish(const struct device *device, unsigned int axis);
/* The position that it should be at: the path's as long as that moves, else the commander's. */
int32_t moving_axis_asked(const struct device *device, unsigned int axis);

/* One-shots. False if they refuse; why is in the image. */
bool moving_add(struct device *device, const struct pokeys_one_shot *shot);
/* The last move was accepted, or the queue was full: not worth an event. */
bool moving_is_usual(const struct device *device);
/* `which` is enum pokeys_moves_control. */
bool moving_control(struct device *device, unsigned int which, double value);

/* moving_axis.c, for moving.c: an axis of the pulse engine as a member. */

void moving_axis_init(struct device *device);
bool moving_axis_any(const struct device *device);
/* What each of them can do, by the device's settings. */
void moving_axis_limit(struct device *device);
/* Some axis that moves is in buffered mode: its steps have to slow down. */
bool moving_axis_buffered(const struct device *device);
/* The path has to wait: for the motion buffer, or for a device that is silent. */
bool moving_axis_waits(const struct device *device);
bool moving_axis_is_on(const struct device *device, unsigned int axis);
/* Where it is commanded to be, units, while it is no member. */
double moving_axis_place(const struct device *device, unsigned int axis);
/* May it go there, in pulses? */
enum pokeys_moves_refusal moving_axis_judge(const struct device *device, unsigned int axis,
					    double pulses);
/* It becomes a member; it follows the path for a cycle; its commander is where it is held. */
void moving_axis_join(struct device *device, unsigned int axis);
void moving_axis_follow(struct device *device, unsigned int axis);
/* It stops at once: where it can. */
void moving_axis_halt(struct device *device, unsigned int axis);
bool moving_axis_met(const struct device *device, unsigned int axis);

#endif
