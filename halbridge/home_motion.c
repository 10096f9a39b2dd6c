/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What homing does to motion's joints.
 *
 * Three things have to be so while the device moves an axis by itself. The
 * joint's command follows the feedback, because motion goes on from there at the
 * end. The following error has no limit, because nobody is being followed, and one
 * late packet would end a good homing. And both end with every way of ending.
 *
 * At the end the device has set its position, so what it reports is the joint's
 * position: motor_offset is 0, whatever an earlier homing had left.
 */
#include "halbridge/home_module.h"

#define NO_LIMIT 1e9

static void place(int j, double position)
{
	emcmot_joint_t *joint = &home.joint[j];

	joint->pos_fb = position;
	joint->pos_cmd = position;
	joint->free_tp.enable = 0;
	joint->free_tp.curr_pos = position;
	joint->free_tp.curr_vel = 0;
	joint->free_tp.pos_cmd = position;
}

void home_where_it_stands(int j)
{
	emcmot_joint_t *joint = &home.joint[j];

	joint->motor_offset = joint->motor_pos_fb - joint->backlash_filt - home.settings[j].home;
	place(j, home.settings[j].home);
	home.homed |= home_bit(j);
}

static void hold_limits(int j)
{
	struct home_limits *limits = &home.limits[j];
	emcmot_joint_t *joint = &home.joint[j];

	if (!limits->taken)
		*limits = (struct home_limits){ true, joint->min_ferror, joint->max_ferror };
	joint->min_ferror = NO_LIMIT;
	joint->max_ferror = NO_LIMIT;
}

void home_let_go(int j)
{
	struct home_limits *limits = &home.limits[j];

	if (!limits->taken)
		return;
	home.joint[j].min_ferror = limits->least;
	home.joint[j].max_ferror = limits->most;
	limits->taken = false;
}

void home_follow(int j)
{
	emcmot_joint_t *joint = &home.joint[j];
	const uint8_t stage = home.plan.talk[j].stage;

	if (stage == HOME_STAGE_ARMED || stage == HOME_STAGE_MOVE)
		joint->motor_offset = 0;
	place(j, joint->motor_pos_fb - joint->backlash_filt - joint->motor_offset);
	hold_limits(j);
}
