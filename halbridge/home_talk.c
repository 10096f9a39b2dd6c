/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device homes; this asks it to, and believes only what it sees.
 *
 * A table says for each stage which command stands, in which states of the axis
 * it lasts, in which it is over, and how long it may take. Any other state means
 * that the device does something else than we think (stopped, tripped, refused,
 * rebooted), and then the joint is not homed: there is no state in which it is
 * hoped that things will turn out well. Every stage has a time limit: a handshake
 * with the daemon a short one, a search and a move one that no axis reaches.
 *
 * An axis that was homed before may still say so when it is asked again, so it
 * has to be seen searching before "ready" is believed.
 */
#include "halbridge/home_talk.h"
#include <stddef.h>
#include "halbridge/legacy_home.h"

#define IN(state)	(UINT32_C(1) << (state))

/* AxesState: the device's own, and those that stand for the conversation. */
enum {
	STATE_READY = 1,
	STATE_RUNNING = 2,
	STATE_FOUND = 3,
	STATE_FINISHED = 4,
	STATE_RESETTING = 8,
	STATE_BACKING_OFF = 9,
	STATE_HOME = 10,
	STATE_START = 11,
	STATE_SEARCH = 12,
	STATE_BACK = 13,
	STATE_ARMING = 17,
	STATE_ARMED = 18,
	STATE_FINAL = 19,
	STATE_ERROR = 20,
	STATE_LIMIT = 30,
};

#define AT_WORK	(IN(STATE_RESETTING) | IN(STATE_BACKING_OFF) | IN(STATE_START) |	\
		 IN(STATE_SEARCH) | IN(STATE_BACK))
#define OURS	(AT_WORK | IN(STATE_FOUND) | IN(STATE_FINISHED) | IN(STATE_ARMING) |	\
		 IN(STATE_ARMED) | IN(STATE_FINAL))
#define HANDSHAKE_S 5
#define LET_GO_S 1
#define LONG_S 600

struct stage {
	uint32_t lasts, ends; /* in these states */
	uint8_t command, next;
	bool group; /* ends only for all of the group together */
	double limit_s;
};

static const struct stage stages[HOME_STAGES] = {
	[HOME_STAGE_ASKED] = { ~(AT_WORK | IN(STATE_ERROR) | IN(STATE_LIMIT)), AT_WORK,
			       LEGACY_HOME_START, HOME_STAGE_SEARCH, false, HANDSHAKE_S },
	[HOME_STAGE_SEARCH] = { AT_WORK | IN(STATE_HOME), IN(STATE_FOUND), LEGACY_HOME_START,
				HOME_STAGE_FOUND, false, LONG_S },
	[HOME_STAGE_FOUND] = { 0, IN(STATE_FOUND), LEGACY_HOME_START, HOME_STAGE_FINISH, true,
			       LONG_S },
	[HOME_STAGE_FINISH] = { IN(STATE_FOUND), IN(STATE_FINISHED), LEGACY_HOME_FINALIZE,
				HOME_STAGE_ARM, false, HANDSHAKE_S },
	[HOME_STAGE_ARM] = { IN(STATE_FINISHED) | IN(STATE_ARMING), IN(STATE_ARMED),
			     LEGACY_HOME_ARM, HOME_STAGE_ARMED, false, HANDSHAKE_S },
	[HOME_STAGE_ARMED] = { 0, IN(STATE_ARMED), LEGACY_HOME_WAIT, HOME_STAGE_MOVE, true,
			       LONG_S },
	[HOME_STAGE_MOVE] = { IN(STATE_ARMED) | IN(STATE_FINAL),
			      IN(STATE_READY) | IN(STATE_RUNNING) | IN(STATE_HOME),
			      LEGACY_HOME_FINAL, HOME_STAGE_IDLE, false, LONG_S },
	[HOME_STAGE_GIVE_UP] = { OURS, ~OURS, LEGACY_HOME_CANCEL, HOME_STAGE_IDLE, false,
				 LET_GO_S },
};

static void enter(struct home_talk *talk, enum home_stage stage)
{
	talk->stage = (uint8_t)stage;
	talk->elapsed_s = 0;
}

void home_talk_begin(struct home_talk *talk, bool stay)
{
	enter(talk, HOME_STAGE_ASKED);
	talk->stay = stay;
}

void home_talk_give_up(struct home_talk *talk)
{
	if (talk->stage != HOME_STAGE_IDLE && talk->stage != HOME_STAGE_GIVE_UP)
		enter(talk, HOME_STAGE_GIVE_UP);
}

static enum home_news end_stage(struct home_talk *talk, const struct stage *stage)
{
	const bool over = talk->stage == HOME_STAGE_MOVE ||
			  (talk->stage == HOME_STAGE_ARMED && talk->stay);

	enter(talk, over ? HOME_STAGE_IDLE : stage->next);
	return over ? HOME_NEWS_DONE : HOME_NEWS_NONE;
}

enum home_news home_talk_step(struct home_talk *talk, uint32_t axes_state, bool together,
			      double period_s)
{
	const struct stage *stage = &stages[talk->stage];
	const uint32_t state = axes_state < 32 ? IN(axes_state) : 0;
	bool late;

	if (talk->stage == HOME_STAGE_IDLE)
		return HOME_NEWS_NONE;
	talk->elapsed_s += period_s;
	late = talk->elapsed_s > stage->limit_s;
	if (talk->stage == HOME_STAGE_GIVE_UP) {
		/* one period at least, so that the command is seen */
		if (late || (state & stage->ends && talk->elapsed_s > period_s))
			enter(talk, HOME_STAGE_IDLE);
		return HOME_NEWS_NONE;
	}
	if (state & stage->ends && (together || !stage->group))
		return end_stage(talk, stage);
	if (!late && state & (stage->lasts | stage->ends))
		return HOME_NEWS_NONE;
	home_talk_give_up(talk);
	return HOME_NEWS_FAILED;
}

uint32_t home_talk_command(const struct home_talk *talk)
{
	return stages[talk->stage].command;
}

int home_talk_shown(const struct home_talk *talk, uint32_t axes_state)
{
	static const int8_t shown[] = {
		[STATE_START] = 1,  [STATE_RESETTING] = 2, [STATE_BACKING_OFF] = 5,
		[STATE_SEARCH] = 7, [STATE_BACK] = 9,      [STATE_FOUND] = 10,
		[STATE_HOME] = 10,  [STATE_FINISHED] = 17, [STATE_ARMING] = 18,
		[STATE_ARMED] = 19, [STATE_FINAL] = 21,    [STATE_ERROR] = 25,
		[STATE_LIMIT] = 25,
	};

	if (talk->stage == HOME_STAGE_IDLE)
		return 0;
	if (talk->stage == HOME_STAGE_GIVE_UP)
		return 25;
	if (axes_state >= sizeof(shown) / sizeof(shown[0]) || !shown[axes_state])
		return 1;
	return shown[axes_state];
}
