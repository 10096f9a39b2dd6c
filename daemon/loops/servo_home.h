/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing of a servo motor: the axis finds its home switch, and its position is set from it.
 * Pure: the time is a parameter, nothing is allocated, nothing is sent. Realtime thread only.
 *
 * Whoever has enabled the motor goes on holding it enabled; only its path comes from here
 * meanwhile. What stops the motor otherwise stops it here as well, and ends the homing: a fault, a
 * command to switch it off, a commander that is gone. Soft limits are not in effect, because nobody
 * knows the position.
 *
 * At the end the axis is held where it is until the commander's position is there too, or it
 * switches the motor off: its position may be one from before the homing.
 */
#ifndef LOOPS_SERVO_HOME_H
#define LOOPS_SERVO_HOME_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/loops/handover.h"
#include "daemon/loops/servo.h"

enum servo_home_state {
	SERVO_HOME_IDLE,
	SERVO_HOME_LEAVE,    /* on the switch at the beginning: off it */
	SERVO_HOME_SEARCH,   /* towards the switch */
	SERVO_HOME_BACK,     /* there: off it again */
	SERVO_HOME_APPROACH, /* towards it again, slowly: where it closes is its place */
	SERVO_HOME_GO,       /* the position is known: to the home position */
	SERVO_HOME_HOLD,     /* it stays where it is: over, but for the commander's position */
	SERVO_HOME_STATES
};

/* How the last one has ended. */
enum servo_home_end {
	SERVO_HOME_NONE, /* there was none, or it has not ended */
	SERVO_HOME_DONE,
	SERVO_HOME_ABORTED,   /* on request */
	SERVO_HOME_STOPPED,   /* the motor was switched off, or has a fault */
	SERVO_HOME_NOT_FOUND, /* no switch on the way that it may go */
	SERVO_HOME_NOT_LEFT,  /* likewise, but the switch stays pressed */
	SERVO_HOME_LATE,      /* it should have been there long ago */
	SERVO_HOME_UNREAD,    /* no readings of the switch */
	SERVO_HOME_ENDS
};

struct servo_home_config {
	double search;       /* units/s, below 0: the switch is at the lower end; 0: no homing */
	double latch;        /* units/s, of the slow approach; above 0 */
	double acceleration; /* units/s^2 */
	double offset;       /* position where the switch closes, units */
	double position;     /* where the axis goes at the end, units */
	double distance;     /* it may go so far for the switch, units */
};

struct servo_home {
	struct servo_home_config config;
	enum servo_home_state state;
	enum servo_home_end end;
	bool pressed;             /* LEAVE: the switch was */
	double path, speed;       /* what is commanded, units and units/s */
	double from;              /* the path when this state began */
	double way;               /* allowed in this state, units */
	struct handover handover; /* HOLD */
	uint64_t since_ns;        /* of this state */
	uint64_t step_ns;         /* of the last step */
	uint64_t read_ns;         /* newest reading of the switch */
	double interval_ns;       /* usual time between two of them; 0: not known */
	bool active;              /* what it told */
	unsigned int alike;       /* ... and those before it in a row */
	uint64_t run_ns;          /* when the first of these was read */
	double edge;              /* ... and where */
	double left;              /* where the switch has opened before the approach */
	bool exact;               /* ... on the slow way, and soon after the one before */
	unsigned int readings;    /* since the beginning */
	unsigned int rounds;      /* approaches that have told no exact place */
	bool stands;              /* HOLD: it does, and the limit switch is watched again */
};

/* The home switch in this cycle. */
struct servo_home_input {
	bool active;
	bool limit;       /* it is the limit switch in the direction of the search */
	uint64_t read_ns; /* when it was read; 0: never */
};

/*
 * Judge a configuration, of a motor whose own is good. NULL, or what is wrong, in the words of
 * pokeysd.conf(5). Not for realtime.
 */
const char *servo_home_init(struct servo_home *home, const struct servo_home_config *config,
			    const struct servo_config *servo);

/*
 * False: it has no home switch, or the motor is not enabled, or is commanded to move. One that is
 * at work begins again.
 */
bool servo_home_begin(struct servo_home *home, struct servo *servo, uint64_t now_ns);

/* Slow down, and hold the axis. False: none is at work, or the motor is off. */
bool servo_home_abort(struct servo_home *home, const struct servo *servo);

/* It is at work, or still slows down: its switch may be pressed. */
bool servo_home_moves(const struct servo_home *home);

/* Something else holds the axis from now on, where it is. False: it is at work. */
bool servo_home_leave(struct servo_home *home);

/*
 * One cycle, before servo_step(), of which it replaces position and speed in `wish` while the axis
 * is not the commander's.
 */
void servo_home_step(struct servo_home *home, struct servo *servo,
		     const struct servo_home_input *input, struct servo_wish *wish,
		     uint64_t now_ns);

#endif
