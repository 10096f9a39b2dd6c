/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Joints: the conversion, and what must never come out of it.
 *
 * The daemon and the device speak pulses; scale (pulses per unit) is HAL's.
 * A position that is not a finite number, or beyond what the device's planner
 * can reach, is not saturated: a saturated position is a move to the end of
 * the world. It is refused, the last good one stays. A velocity that is
 * refused becomes 0, which is "as fast as allowed" to a position that has not
 * moved on.
 *
 * What drives an axis is a setting of the device (joint.NN.mode); the command has
 * to say the same. A mode that is set here and not yet there is refused by the
 * daemon until it is: nothing moves in another way than the parameter says.
 *
 * The device's count may begin anew (position.c). The carry makes up for it on the way in
 * and out, so that positions go on as they were.
 *
 * Scale is taken over only while the joint is not enabled: the same position
 * command with another scale is another place, and the axis would jump there.
 */
#include "halbridge/joint.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "halbridge/threading.h"

#define VELOCITY_MOST	1e7		/* pulses/s, far above what any device makes */
#define SPEED_MARGIN	1.001		/* above the highest speed is still rounding */

/* LinuxCNC's motion.motion-type: 0 at rest, jogging or homing; 5 probing. All others: a path. */
enum { MOTION_NONE = 0, MOTION_PROBES = 5 };

#define OFFSET(number, member)	\
	(offsetof(struct values, joint) + (number) * sizeof(struct value_joint) +	\
	 offsetof(struct value_joint, member))

void joint_init(struct joint *joint)
{
	memset(joint, 0, sizeof(*joint));
	joint->wanted = (struct factor){ .used = 1, .seen = 1 };
	joint->scale = 1;
}

static double framed(const struct joint_frame *frame, double scale)
{
	double whole = frame->whole ? trunc(scale) : scale;

	whole = whole == 0 ? scale : whole;
	return frame->turned ? -whole : whole;
}

bool joint_settings(struct joint *joint, const struct value_joint *value, unsigned int number,
		    struct refusals *refusals)
{
	const size_t at = OFFSET(number, scale);
	double wanted = factor_take(&joint->wanted, refusals, value->scale, at);
	bool moved, late;

	wanted = framed(&joint->frame, wanted);
	moved = wanted != joint->scale || joint->frame.offset != joint->offset;
	late = (value->enable || joint->enable) && moved;
	refusal_mark(refusals, &joint->scale_late, late, at, REFUSAL_ENABLED, wanted);
	if (!late) {
		joint->scale = wanted;
		joint->offset = joint->frame.offset;
	}
	if (joint->scale == joint->shown_scale && joint->offset == joint->shown_offset &&
	    joint->position == joint->shown_position)
		return false;
	joint->shown_scale = joint->scale;
	joint->shown_offset = joint->offset;
	joint->shown_position = joint->position;
	return true;
}

void joint_carry(struct joint *joint, int64_t carry, int32_t position)
{
	joint->carry = carry;
	joint->position = position;
}

void joint_hold(struct joint *joint, bool held, int32_t at)
{
	joint->held = held;
	joint->held_at = at;
}

/* Pulses as the device counts to units. */
static double units_of(const struct joint *joint, int64_t pulses)
{
	return (double)(pulses + joint->carry) / joint->scale - joint->offset;
}

void joint_leave_out_delay(struct joint *joint, const struct value_joint *value,
			   const struct pokeys_axis *axis, int32_t motion_type)
{
	const bool is_path = motion_type != MOTION_NONE && motion_type != MOTION_PROBES;
	const bool is_driven = axis->mode == POKEYS_AXIS_BUFFERED && axis->enabled &&
			       (value->enable || joint->enable);

	if (!is_path && !joint->arrives)
		joint->path_end = joint->position;
	joint->arrives = joint->undelayed && !is_path;
	joint->undelayed = is_driven && motion_type != MOTION_PROBES &&
			   (is_path || (joint->arrives && axis->delayed &&
					joint->position == joint->path_end));
}

/* Pulses as the device counts. */
static int64_t shown(const struct joint *joint, const struct pokeys_axis *axis, bool led)
{
	if (joint->held)
		return joint->held_at;
	if (led)
		return joint->position;
	return axis->position + (joint->undelayed ? (int64_t)axis->delayed : 0);
}

void joint_read(const struct joint *joint, struct value_joint *value, unsigned int number,
		const struct pokeys_engine *engine)
{
	const struct pokeys_axis *axis = &engine->axis[number];

	value->pos_fb = units_of(joint, shown(joint, axis, threading_leads(engine, number)));
	value->following_error = axis->following_error / joint->scale;
	value->state = axis->state;
	value->in_position = axis->in_position && axis->reference == joint->position;
	value->enabled = axis->enabled;
	value->homed = axis->homed;
	value->error = axis->error;
	value->limit_neg = axis->limit_minus;
	value->limit_pos = axis->limit_plus;
	value->soft_limit = axis->soft_limit;
	value->home_switch = axis->home;
	value->limit_neg_dedicated = engine->dedicated_limit_minus >> number & 1;
	value->limit_pos_dedicated = engine->dedicated_limit_plus >> number & 1;
	value->home_dedicated = engine->dedicated_home >> number & 1;
	value->probed = engine->probe_status >> number & 1;
	value->probe_pos = axis->probe ? units_of(joint, axis->probe) : 0;
}

static enum pokeys_axis_mode mode_of(int32_t wanted, const struct pokeys_axis *axis)
{
	if (wanted >= POKEYS_AXIS_POSITION && wanted <= POKEYS_AXIS_BUFFERED)
		return (enum pokeys_axis_mode)wanted;
	return axis->mode >= POKEYS_AXIS_POSITION && axis->mode <= POKEYS_AXIS_BUFFERED ?
		       (enum pokeys_axis_mode)axis->mode :
		       POKEYS_AXIS_POSITION;
}

/* A place on the axis to *pulses, if it is one; *bad says whether. */
static void take_place(const struct joint *joint, double units, double most, int32_t *pulses,
		       bool *bad, size_t at, struct refusals *refusals)
{
	const double place = (units + joint->offset) * joint->scale - (double)joint->carry;
	/* Written so that NaN is bad as well. */
	const bool beyond = !(fabs(place) <= most);

	refusal_mark(refusals, bad, beyond, at,
		     isfinite(units) ? REFUSAL_RANGE : REFUSAL_NOT_FINITE, units);
	if (!beyond)
		*pulses = (int32_t)lrint(place);
}

/* In velocity mode the daemon refuses what is above the axis' highest speed; so do we, by name. */
static float velocity(struct joint *joint, double units, unsigned int number, double most,
		      struct refusals *refusals)
{
	const double pulses = units * joint->scale;
	const bool bad = !(fabs(pulses) <= most);

	refusal_mark(refusals, &joint->velocity_bad, bad, OFFSET(number, vel_cmd),
		     !isfinite(units)     ? REFUSAL_NOT_FINITE :
		     most < VELOCITY_MOST ? REFUSAL_SPEED :
					    REFUSAL_RANGE,
		     units);
	return bad ? 0 : (float)pulses;
}

static double velocity_most(enum pokeys_axis_mode mode, const struct joint_device *device)
{
	const double most = (double)device->axis->max_speed * SPEED_MARGIN;

	return mode == POKEYS_AXIS_VELOCITY && device->known && most > 0 && most < VELOCITY_MOST ?
		       most :
		       VELOCITY_MOST;
}

/* Beyond a soft limit that holds, and not on the way back. */
static bool beyond(const struct joint *joint, const struct value_joint *value,
		   const struct value_axis_settings *set, int32_t position)
{
	const double slack = 0.5 / fabs(joint->scale);
	/* the limits are those of the device's own count */
	const double carry = (double)joint->carry / joint->scale;
	const double to = value->pos_cmd - carry;
	const double here = units_of(joint, position) - carry;

	return set->soft_limits == 1 && ((to > set->soft_max + slack && to > here) ||
					 (to < set->soft_min - slack && to < here));
}

/*
 * What only the daemon can refuse, for it has the device's word: here it is said which
 * joint it is.
 */
static void foresee(struct joint *joint, const struct value_joint *value, unsigned int number,
		    const struct value_axis_settings *set, const struct joint_device *device,
		    const struct pokeys_axis_command *command, struct refusals *refusals)
{
	const bool asked = device->known && command->enable && command->mode != POKEYS_AXIS_OFF;

	refusal_mark(refusals, &joint->absent, asked && device->axis->mode == POKEYS_AXIS_OFF,
		     OFFSET(number, pos_cmd), REFUSAL_NO_AXIS, value->pos_cmd);
	refusal_mark(refusals, &joint->beyond,
		     asked && command->mode != POKEYS_AXIS_VELOCITY &&
			     beyond(joint, value, set, device->axis->position),
		     OFFSET(number, pos_cmd), REFUSAL_SOFT_LIMIT, value->pos_cmd);
}

void joint_write(struct joint *joint, struct value_joint *value, unsigned int number,
		 const struct value_axis_settings *set, const struct joint_device *device,
		 struct pokeys_axis_command *command, struct refusals *refusals)
{
	const enum pokeys_axis_mode mode = mode_of(set->mode, device->axis);
	const double most = mode == POKEYS_AXIS_BUFFERED ? JOINT_BUFFERED_MOST :
							   JOINT_POSITION_MOST;

	take_place(joint, value->pos_cmd, most, &joint->position, &joint->position_bad,
		   OFFSET(number, pos_cmd), refusals);
	take_place(joint, value->probe_target, JOINT_POSITION_MOST, &joint->target,
		   &joint->target_bad, OFFSET(number, probe_target), refusals);
	command->velocity = velocity(joint, value->vel_cmd, number, velocity_most(mode, device),
				     refusals);
	command->position = joint->position;
	command->mode = (uint8_t)mode;
	command->enable = value->enable || joint->enable;
	foresee(joint, value, number, set, device, command, refusals);
	value->refused = joint->wanted.bad || joint->scale_late || joint->position_bad ||
			 joint->velocity_bad || joint->target_bad || joint->absent || joint->beyond;
}
