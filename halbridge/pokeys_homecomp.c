/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * LinuxCNC's homing, done by the device: [EMCMOT]HOMEMOD = pokeys_homecomp.
 *
 * motmod calls these functions instead of its own homing module's, in its servo
 * thread; this is the shell that has pins and joints, the homing itself is in
 * home_plan.c. Names are those of the module that existing configurations use:
 * joint.N.PEv2.AxesCommand and AxesState are connected to pokeys_shm's pins
 * PEv2.N.AxesCommand and AxesState.
 *
 * A joint without search and latch velocity is homed where it stands, as HOME: for
 * joints that are not on a device. The device is not asked.
 */
#include <errno.h>
#include <string.h>
#include <rtapi.h>
#include <rtapi_app.h>
#include "halbridge/home_module.h"

int rtapi_app_main(void);
void rtapi_app_exit(void);

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic" /* the macros end in a semicolon of their own */
MODULE_AUTHOR("pokeysd");
MODULE_DESCRIPTION("homing by the PoKeys device, for [EMCMOT]HOMEMOD");
MODULE_LICENSE("GPL");

static char *home_parms;
RTAPI_MP_STRING(home_parms, "not used; configurations may have it");
#pragma GCC diagnostic pop

struct home_module home;

/* ---- loading ------------------------------------------------------------- */

int rtapi_app_main(void)
{
	memset(&home, 0, sizeof(home));
	home.component = hal_init("pokeys_homecomp");
	if (home.component < 0)
		return home.component;
	home.is_module = hal_malloc(sizeof(*home.is_module));
	if (!home.is_module || hal_pin_bit_newf(HAL_OUT, home.is_module, home.component,
						"pokeys-homecomp.is-module")) {
		hal_exit(home.component);
		return -ENOMEM;
	}
	**home.is_module = 1;
	return hal_ready(home.component);
}

void rtapi_app_exit(void)
{
	hal_exit(home.component);
	home_parms = NULL;
}

void homeMotFunctions(void (*set_unlock)(int, int), int (*get_unlock)(int))
{
	(void)set_unlock; /* a device cannot unlock a rotary before it homes */
	(void)get_unlock;
}

static int make_pins(int id, struct home_pins *pins, int j)
{
	return hal_pin_bit_newf(HAL_IN, &pins->home_sw, id, "joint.%d.home-sw-in", j) ||
	       hal_pin_bit_newf(HAL_OUT, &pins->homing, id, "joint.%d.homing", j) ||
	       hal_pin_bit_newf(HAL_OUT, &pins->homed, id, "joint.%d.homed", j) ||
	       hal_pin_s32_newf(HAL_OUT, &pins->home_state, id, "joint.%d.home-state", j) ||
	       hal_pin_bit_newf(HAL_IO, &pins->index_enable, id, "joint.%d.index-enable", j) ||
	       hal_pin_u32_newf(HAL_IN, &pins->axes_state, id, "joint.%d.PEv2.AxesState", j) ||
	       hal_pin_u32_newf(HAL_OUT, &pins->axes_command, id, "joint.%d.PEv2.AxesCommand", j) ||
	       hal_pin_u32_newf(HAL_IN, &pins->axes_config, id, "joint.%d.PEv2.AxesConfig", j);
}

int homing_init(int id, double servo_period, int n_joints, int n_extrajoints,
		emcmot_joint_t *pjoints)
{
	(void)n_extrajoints; /* n_joints counts them as well */
	if (!(servo_period > 0) || n_joints < 0 || n_joints > HOME_JOINTS) {
		rtapi_print_msg(RTAPI_MSG_ERR, "pokeys_homecomp: period %g s, %d joints\n",
				servo_period, n_joints);
		return -EINVAL;
	}
	home_plan_init(&home.plan, (unsigned int)n_joints);
	home.period_s = servo_period;
	home.joint = pjoints;
	home.pins = hal_malloc(HOME_JOINTS * (long)sizeof(*home.pins));
	if (!home.pins)
		return -ENOMEM;
	for (int j = 0; j < n_joints; j++) {
		if (make_pins(id, &home.pins[j], j))
			return -EINVAL;
	}
	return 0;
}

/* ---- settings ------------------------------------------------------------ */

void set_joint_homing_params(int jno, double offset, double home_position, double home_final_vel,
			     double home_search_vel, double home_latch_vel, int home_flags,
			     int home_sequence, bool volatile_home)
{
	(void)offset; /* the device has them, by pokeys_shm's parameters */
	(void)home_final_vel;
	if (!home_knows(jno))
		return;
	home.settings[jno] = (struct home_settings){
		.home = home_position,
		.search = home_search_vel,
		.latch = home_latch_vel,
		.flags = home_flags,
		.volatile_home = volatile_home,
	};
	home.plan.sequence[jno] = home_sequence;
	home.plan.stay[jno] = home_flags & HOME_NO_FINAL_MOVE;
}

void update_joint_homing_params(int jno, double home_offset, double home_home, int home_sequence)
{
	(void)home_offset;
	if (!home_knows(jno))
		return;
	home.settings[jno].home = home_home;
	home.plan.sequence[jno] = home_sequence;
}

/* ---- what the operator asks for ------------------------------------------ */

static bool stands_alone(int j)
{
	return home.settings[j].search == 0 && home.settings[j].latch == 0;
}

void do_home_joint(int jno)
{
	uint32_t joints = jno < 0 ? home_plan_all(&home.plan) :
				    home_plan_with(&home.plan, (unsigned int)jno);

	for (int j = 0; j < (int)home.plan.joints; j++) {
		if (!(joints & home_bit(j)))
			continue;
		if (!GET_JOINT_ACTIVE_FLAG(&home.joint[j]) || home_in_talk(j) ||
		    (home.homed & home_bit(j) && home.settings[j].flags & HOME_NO_REHOME)) {
			joints &= ~home_bit(j);
		} else if (stands_alone(j)) {
			home_where_it_stands(j);
			joints &= ~home_bit(j);
		} else {
			home.homed &= ~home_bit(j);
		}
	}
	home_plan_ask(&home.plan, joints);
}

void do_cancel_homing(int jno)
{
	if (jno < 0 || home_in_talk(jno))
		home_plan_cancel(&home.plan);
}

static void unhome(int j, motion_state_t state)
{
	const char *why = NULL;

	if (!GET_JOINT_ACTIVE_FLAG(&home.joint[j]))
		return;
	if (state != EMCMOT_MOTION_FREE && state != EMCMOT_MOTION_DISABLED)
		why = "in joint mode or off";
	else if (home_in_talk(j))
		why = "done with homing";
	else if (!GET_JOINT_INPOS_FLAG(&home.joint[j]))
		why = "standing";
	if (why)
		rtapi_print_msg(RTAPI_MSG_ERR, "joint %d can be unhomed only when %s\n", j, why);
	else
		home.homed &= ~home_bit(j);
}

void set_unhomed(int jno, motion_state_t motstate)
{
	for (int j = 0; j < (int)home.plan.joints; j++) {
		if (jno == j || jno == -1 || (jno == -2 && home.settings[j].volatile_home))
			unhome(j, motstate);
	}
}

/* ---- every servo period -------------------------------------------------- */

void read_homing_in_pins(int njoints)
{
	for (int j = 0; j < njoints && home_knows(j); j++) {
		home.state[j] = *home.pins[j].axes_state;
		home.index_enable[j] = *home.pins[j].index_enable;
	}
}

static void tell_failed(uint32_t failed)
{
	for (int j = 0; j < (int)home.plan.joints; j++) {
		if (failed & home_bit(j))
			rtapi_print_msg(RTAPI_MSG_ERR,
					"joint %d is not homed: the axis is in "
					"state %u\n",
					j, home.state[j]);
	}
}

bool do_homing(void)
{
	const bool before = get_allhomed();
	uint32_t driven = home.plan.group;
	struct home_result result = home_plan_step(&home.plan, home.state, home.period_s);

	driven |= home.plan.group;
	/* gcc 14 does not see that joints <= HOME_JOINTS */
	for (int j = 0; j < HOME_JOINTS && j < (int)home.plan.joints; j++) {
		if (driven & home_bit(j))
			home_follow(j);
		if (!(home.plan.group & home_bit(j)))
			home_let_go(j);
		if (home.plan.talk[j].stage == HOME_STAGE_ARM)
			home.index_enable[j] = true;
		else if (home.plan.talk[j].stage != HOME_STAGE_ARMED && driven & home_bit(j))
			home.index_enable[j] = false;
	}
	home.homed |= result.done;
	tell_failed(result.failed);
	return !before && get_allhomed();
}

void write_homing_out_pins(int njoints)
{
	for (int j = 0; j < njoints && home_knows(j); j++) {
		const struct home_talk *talk = &home.plan.talk[j];

		*home.pins[j].homing = get_homing(j);
		*home.pins[j].homed = get_homed(j);
		*home.pins[j].home_state = home_talk_shown(talk, home.state[j]);
		*home.pins[j].index_enable = home.index_enable[j];
		*home.pins[j].axes_command = home_talk_command(talk);
	}
}
