/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One joint: machine units on the pins, pulses in the images.
 */
#ifndef HALBRIDGE_JOINT_H
#define HALBRIDGE_JOINT_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "halbridge/refusal.h"
#include "halbridge/values.h"

/* The device's planner reaches no further, pulses (protocol section 3.24.1). */
#define JOINT_POSITION_MOST	16777216
#define JOINT_BUFFERED_MOST	2100000000	/* in buffered mode */

/* How units lie to pulses beyond the scale; all 0: not at all. */
struct joint_frame {
	double offset; /* units, added to the command */
	bool turned;   /* pulses count down where units count up */
	bool whole;    /* the whole part of the scale only */
};

struct joint {
	struct joint_frame frame; /* as wanted; taken over with the scale */
	double offset;            /* in use, units */
	bool enable;              /* somebody else than the joint's own pin enables it as well */

	struct factor wanted; /* scale as the parameter has it */
	double scale;         /* in use, pulses per unit */
	int64_t carry;        /* pulses that the device has lost: its count began anew */
	bool held;            /* the axis is off: pos-fb shows held_at, not its count */
	int32_t held_at;      /* the count that was shown last, pulses */
	int32_t position;     /* last good command, pulses */
	int32_t target;       /* last good one for probing, pulses */
	bool undelayed;       /* pos-fb leaves out the buffer's delay */
	bool arrives;         /* the path has ended, the joint has not arrived */
	int32_t path_end;     /* command at the end of the path, pulses */
	bool scale_late, position_bad, velocity_bad, target_bad, absent, beyond;
	double shown_scale, shown_offset; /* the pins were filled with these */
	int32_t shown_position;
};

/* The axis as the device has it. */
struct joint_device {
	const struct pokeys_axis *axis;
	bool known; /* it is running, and that is of now */
};

void joint_init(struct joint *joint);

/*
 * Take over the scale, at the start of a period: the first position shown is
 * in the right units already. Returns true if the pins have to be filled anew.
 * Realtime.
 */
bool joint_settings(struct joint *joint, const struct value_joint *value, unsigned int number,
		    struct refusals *refusals);

/* From now on the device's count is `position` and lacks `carry` pulses. Realtime. */
void joint_carry(struct joint *joint, int64_t carry, int32_t position);

/* The axis is off: pos-fb stays at the count `at`. Or it is not. Realtime. */
void joint_hold(struct joint *joint, bool held, int32_t at);

/*
 * The reported position of a joint in buffered mode is late by the delay of the buffer. pos-fb
 * leaves this delay out while LinuxCNC moves along a path (motion_type is its motion.motion-type).
 * After the path, it does so until the joint has arrived or is commanded again. For probing, homing
 * and jogging, pos-fb is the reported position. Realtime.
 */
void joint_leave_out_delay(struct joint *joint, const struct value_joint *value,
			   const struct pokeys_axis *axis, int32_t motion_type);

/* State image to pins. Realtime. */
void joint_read(const struct joint *joint, struct value_joint *value, unsigned int number,
		const struct pokeys_engine *engine);

/* Pins to command image. `set` are the parameters of its settings. Realtime. */
void joint_write(struct joint *joint, struct value_joint *value, unsigned int number,
		 const struct value_axis_settings *set, const struct joint_device *device,
		 struct pokeys_axis_command *command, struct refusals *refusals);

#endif
