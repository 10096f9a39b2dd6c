/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One joint's side of homing by the device: AxesCommand out, AxesState in.
 */
#ifndef HALBRIDGE_HOME_TALK_H
#define HALBRIDGE_HOME_TALK_H

#include <stdbool.h>
#include <stdint.h>

enum home_stage {
	HOME_STAGE_IDLE,
	HOME_STAGE_ASKED,   /* the device is to begin */
	HOME_STAGE_SEARCH,  /* it searches, alone */
	HOME_STAGE_FOUND,   /* waits for the other joints of the group */
	HOME_STAGE_FINISH,  /* homing is over: the request to end it is sent */
	HOME_STAGE_ARM,     /* its position is being set */
	HOME_STAGE_ARMED,   /* it is; waits for the others */
	HOME_STAGE_MOVE,    /* to HOME, by the device */
	HOME_STAGE_GIVE_UP, /* cancelled, until the device has let go */
	HOME_STAGES
};

enum home_news { HOME_NEWS_NONE, HOME_NEWS_DONE, HOME_NEWS_FAILED };

struct home_talk {
	uint8_t stage;    /* enum home_stage */
	bool stay;        /* no final move */
	double elapsed_s; /* in this stage */
};

/* Begin; idle before. */
void home_talk_begin(struct home_talk *talk, bool stay);

/* Tell the device to let go; nothing if it has nothing. */
void home_talk_give_up(struct home_talk *talk);

/*
 * A period. axes_state is AxesState as read, `together` that every joint of the
 * group has come as far as this one. Failed: it is giving up already. Realtime.
 */
enum home_news home_talk_step(struct home_talk *talk, uint32_t axes_state, bool together,
			      double period_s);

/* AxesCommand of this stage. */
uint32_t home_talk_command(const struct home_talk *talk);

/* LinuxCNC's joint.N.home-state: 0 idle ... 25 abort. */
int home_talk_shown(const struct home_talk *talk, uint32_t axes_state);

#endif
