/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A path: straight moves, one after another, of several axes together. Pure: the time is a
 * parameter, nothing is allocated, nothing is sent. Realtime thread only.
 *
 * The speed along the path changes by the acceleration that its axes can do in this direction. It
 * is planned over all moves that wait: at each corner it is low enough for what follows, and at the
 * end of the last one it is 0. So whatever comes next, or does not, the axes can stop on the path.
 *
 * Lengths are measured over all axes alike, whether their units are mm or degrees.
 */
#ifndef LOOPS_PATH_H
#define LOOPS_PATH_H

#include <stdbool.h>
#include <stdint.h>

enum {
	PATH_MOVES = 32, /* that wait, or are under way */
	PATH_AXES = 16,
};

#define PATH_FEED_MOST 2.0
#define PATH_PLACE_MOST 1e9	/* units */

struct path_axis_config {
	double speed;        /* at most, units/s; above 0, or both 0: it cannot be moved */
	double acceleration; /* at most, units/s^2 */
};

struct path_config {
	unsigned int axes;
	struct path_axis_config axis[PATH_AXES];
	/*
	 * A corner is passed as fast as a round one would be that leaves it by no more than this,
	 * units; 0: a stop at each corner. The axes do not leave the corner by command.
	 */
	double deviation;
};

enum path_refusal {
	PATH_TAKEN,
	PATH_FULL, /* PATH_MOVES are waiting */
	PATH_ODD,  /* a place or a speed is no number, or too large, or an axis of it
		    * cannot be moved */
	PATH_ENDS, /* it is slowing down for path_abort() */
};

struct path_move {
	double end[PATH_AXES];  /* where it goes, units */
	double unit[PATH_AXES]; /* its direction */
	double length;          /* units */
	double speed;           /* that is commanded, units/s */
	double speed_most;      /* that its axes can do */
	double acceleration;    /* ... likewise, units/s^2 */
	/* Squares of speeds at its beginning, (units/s)^2. */
	double corner;  /* for the corner there */
	double safe;    /* ... and to keep to the corners that follow */
	double planned; /* ... and to the speeds that are commanded there */
};

struct path {
	struct path_config config;
	uint32_t axes;                                   /* bit = axis that belongs to it */
	double position[PATH_AXES], velocity[PATH_AXES]; /* units, units/s */
	double speed;                                    /* along the path */
	double done;                                     /* of the first move, units */
	double feed; /* part of the commanded speeds, 0 to PATH_FEED_MOST */
	bool held;   /* slow down and wait, on the path */
	bool ends;   /* slow down, then forget what waits */
	struct path_move move[PATH_MOVES];
	unsigned int first, count;
	uint32_t taken;   /* moves, since the start */
	uint64_t step_ns; /* of the last step; 0: there was none */
};

/*
 * Judge a configuration and begin, without axes. NULL, or what is wrong, in the words of
 * pokeysd.conf(5). Not for realtime.
 */
const char *path_init(struct path *path, const struct path_config *config);

/* Other limits of an axis, if they are some. Only while the path is idle. */
void path_limit(struct path *path, unsigned int axis, const struct path_axis_config *limits);

/*
 * One more move: the axes of `axes` (bit = axis) go to end[], units, and all others stay where the
 * move before leaves them. `at`: where those of them stand that do not belong to the path yet.
 * `speed`: along the path, units/s; 0: as fast as its axes can. What is refused changes nothing.
 */
enum path_refusal path_add(struct path *path, uint32_t axes, const double *at, const double *end,
			   double speed);

/* One cycle: position and velocity from now on. */
void path_step(struct path *path, uint64_t now_ns);

/* Slow down on the path, and wait there; go on. */
void path_hold(struct path *path, bool held);

/* Slow down on the path and forget what waits. False: nothing moves or waits. */
bool path_abort(struct path *path);

/* Stand at once, whatever the axes can do, and forget what waits. */
void path_stop(struct path *path);

/* A part of the commanded speeds from now on; false if it is not from 0 to PATH_FEED_MOST. */
bool path_feed(struct path *path, double feed);

/* Where an axis of it will be when all that waits is done, units. */
double path_end(const struct path *path, unsigned int axis);

/* It stands, and nothing waits. */
bool path_is_idle(const struct path *path);

/* These axes (bit = axis) do not belong to it any more. Only while it is idle. */
void path_leave(struct path *path, uint32_t axes);

#endif
