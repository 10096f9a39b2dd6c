/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Gains for a servo motor, from how it answers to steps of its output. Pure: the time is a
 * parameter, nothing is allocated, nothing is sent. Realtime thread only.
 *
 * The motor is enabled, and stands. It is pushed back and forth, by little more than half of a
 * distance from where it was, and coasts from there if it has to be stopped. At the end it is off.
 * What stops a motor otherwise stops it here as well, but for a following error: there is none.
 */
#ifndef LOOPS_SERVO_TUNE_H
#define LOOPS_SERVO_TUNE_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/loops/servo.h"

enum {
	SERVO_TUNE_WINDOW = 33, /* readings */
	SERVO_TUNE_TERMS = 4,
	SERVO_TUNE_TURNS = 9, /* to each side, for what is usual */
};

enum servo_tune_state {
	SERVO_TUNE_NONE,
	SERVO_TUNE_RUNS,
	SERVO_TUNE_DONE,
	SERVO_TUNE_FAILED,
};

/* Why it has found nothing. */
enum servo_tune_reason {
	SERVO_TUNE_FINE,
	SERVO_TUNE_STOPPED,  /* on request, switched off, or a fault */
	SERVO_TUNE_STILL,    /* it does not move with the highest output */
	SERVO_TUNE_REVERSED, /* it moves against its output */
	SERVO_TUNE_SILENT,   /* it was moving, and the encoder does not count any more */
	SERVO_TUNE_FAR,      /* it went further than it was to */
	SERVO_TUNE_UNLIKE,   /* it does not answer as a motor does */
	SERVO_TUNE_LATE,     /* not enough readings in 30 s */
};

struct servo_tune {
	enum servo_tune_state state;
	enum servo_tune_reason reason;
	double distance;    /* units */
	double most;        /* output, 0 to 1 */
	bool brakes;        /* all is found, and it is brought to rest */
	bool rests;         /* it stands without output, as it has to before it is pushed */
	uint64_t rested_ns; /* since then */
	double begun_at;    /* position at the beginning, units */
	double from;        /* ... and where it rests */
	double push;        /* output that it is pushed with; 0: it is sought */
	double output;      /* now */
	double turned_at;   /* position where it turned last */
	double sign;        /* of its speed then */
	double braking[2];  /* units/s^2, from its way up, down: as last; 0: not known */
	double turned_rate; /* speed when its output was turned, units/s; 0: it has turned */
	double turned_from; /* ... and its position */
	double peak;        /* highest speed of this push */
	double moved_at;    /* position where it has moved last */
	uint64_t moved_ns;
	uint64_t back_ns; /* when it was not going with its output, last */
	unsigned int turns;
	uint64_t begun_ns, turned_ns, read_ns, step_ns;
	double dead; /* usual time until a turned output was applied, seconds */
	double dead_of[2][SERVO_TUNE_TURNS]; /* the last ones, to go down and up */
	unsigned int deads[2];
	bool applied;        /* the output is, since it was turned */
	uint64_t applied_ns; /* ... since then */
	uint64_t waited_ns;  /* when it was not, last */
	double least;        /* output with which it has moved */
	double delay;        /* from a reading to its output, seconds, smoothed */
	double interval;     /* ... from one to the next; 0: not known */
	/* the last readings */
	double place[SERVO_TUNE_WINDOW];
	uint64_t place_ns[SERVO_TUNE_WINDOW];
	unsigned int places;                               /* since the output has changed */
	double moment[SERVO_TUNE_TERMS][SERVO_TUNE_TERMS]; /* of the equations' terms */
	unsigned int equations;
	/* what was found */
	double rate;     /* units/s^2 for an output of 1 */
	double slowing;  /* units/s^2 for each unit/s */
	double friction; /* units/s^2 */
	struct servo_gains gains;
};

/*
 * False: the motor is not enabled, or moves, or is on a limit switch; a soft limit is too near; or
 * these are no numbers, or too few counts. `distance`: it stays so near
 * to where it is, both ways together, units. `most`: largest output, 0 to 1; 0: its own.
 */
bool servo_tune_begin(struct servo_tune *tune, const struct servo *servo, double distance,
		      double most, uint64_t now_ns);

/* The motor is off in the next step. False: none runs. */
bool servo_tune_abort(struct servo_tune *tune);

/*
 * One cycle, before servo_step(). `applied`: the device has the output of the last one. True: the
 * motor has to be off.
 */
bool servo_tune_step(struct servo_tune *tune, struct servo *servo, bool applied, uint64_t now_ns);

#endif
