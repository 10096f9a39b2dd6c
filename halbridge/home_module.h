/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the files of pokeys_homecomp share: one set of joints, motmod's. All of it
 * belongs to the servo thread, once homing_init() has returned.
 */
#ifndef HALBRIDGE_HOME_MODULE_H
#define HALBRIDGE_HOME_MODULE_H

#include <rtapi.h>
#include <hal.h>
#include <motion.h>
#include <homing.h>
#include "halbridge/home_plan.h"

struct home_pins {
	hal_bit_t *home_sw, *homing, *homed, *index_enable;
	hal_s32_t *home_state;
	hal_u32_t *axes_state, *axes_command, *axes_config;
};

struct home_settings {
	double home, search, latch;
	int flags;
	bool volatile_home;
};

struct home_limits {
	bool taken;
	double least, most;
};

struct home_module {
	int component;
	emcmot_joint_t *joint;
	double period_s;
	struct home_plan plan;
	uint32_t homed;              /* bit = joint */
	uint32_t state[HOME_JOINTS]; /* AxesState */
	bool index_enable[HOME_JOINTS];
	struct home_settings settings[HOME_JOINTS];
	struct home_limits limits[HOME_JOINTS];
	struct home_pins *pins;
	hal_bit_t **is_module;
};

extern struct home_module home;

static inline uint32_t home_bit(int joint)
{
	return joint >= 0 && joint < HOME_JOINTS ? UINT32_C(1) << joint : 0;
}

static inline bool home_knows(int joint)
{
	return joint >= 0 && joint < (int)home.plan.joints;
}

static inline bool home_in_talk(int joint)
{
	return home_knows(joint) && home.plan.talk[joint].stage != HOME_STAGE_IDLE;
}

/* home_motion.c. Realtime, all of them. */

/* The joint is homed where it stands, as its HOME. */
void home_where_it_stands(int joint);

/* The device drives this joint in this period: motion looks on. */
void home_follow(int joint);

/* Motion drives it again; the limits of its following error hold. */
void home_let_go(int joint);

#endif
