/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What motmod asks its homing module (homing.h).
 *
 * A joint is "homing" until the device has let go of it, also after it was
 * cancelled: as long as it may still move by itself its command has to follow, and
 * motion must not begin anything with it.
 */
#include "halbridge/home_module.h"

bool get_allhomed(void)
{
	for (int j = 0; j < (int)home.plan.joints; j++) {
		if (GET_JOINT_ACTIVE_FLAG(&home.joint[j]) && !(home.homed & home_bit(j)))
			return false;
	}
	return true;
}

bool get_homing_is_active(void)
{
	return home_plan_active(&home.plan);
}

int get_home_sequence(int jno)
{
	return home_knows(jno) ? home.plan.sequence[jno] : HOME_SEQUENCE_NONE;
}

bool get_homing(int jno)
{
	return home_in_talk(jno);
}

bool get_homed(int jno)
{
	return home.homed & home_bit(jno);
}

bool get_index_enable(int jno)
{
	return home_knows(jno) && home.index_enable[jno];
}

bool get_home_needs_unlock_first(int jno)
{
	return home_knows(jno) && home.settings[jno].flags & HOME_UNLOCK_FIRST;
}

bool get_home_is_idle(int jno)
{
	return !home_in_talk(jno);
}

bool get_home_is_synchronized(int jno)
{
	return home_knows(jno) && home.plan.sequence[jno] < 0;
}

/* Motion would not believe the feedback in it; what the device says is right. */
bool get_homing_at_index_search_wait(int jno)
{
	(void)jno;
	return false;
}
