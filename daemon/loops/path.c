/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A path's plan and its steps.
 *
 * Each move has two speeds for its beginning. The safe one is the highest from which all corners
 * that follow, and the end, can be kept to. It depends on nothing that anybody may change while
 * the axes move, and another move at the end only makes it higher. So the axes are never faster
 * than they can brake, whatever becomes of the feed. The planned one is what the commanded speeds
 * ask for besides. If they become lower, the axes slow down to them as fast as they can.
 *
 * In a cycle the acceleration is constant, so what is covered is known exactly. At the end of a
 * move the cycle is divided.
 *
 * A corner: on a circle that touches both moves and comes no nearer to the corner than the
 * deviation, the speed is limited by the acceleration towards its centre. Moves that are short for
 * the angle between them are taken for parts of a curve, with its acceleration.
 */

#include "daemon/loops/path.h"

#include <math.h>
#include <stddef.h>

#include "daemon/loops/duration.h"

#define STEP_MOST_S 0.01	/* a longer pause is none of the path */
#define LENGTH_LEAST 1e-9	/* units: less is no move */
#define STRAIGHT 1e-12		/* off 1: no corner, or back the same way */
#define SPEED_MOST 1e9		/* units/s */

static bool is_above(double value)
{
	return value > 0 && isfinite(value);
}

static bool can_move(const struct path_axis_config *axis)
{
	return is_above(axis->speed) && is_above(axis->acceleration);
}

static bool is_none(const struct path_axis_config *axis)
{
	return axis->speed == 0 && axis->acceleration == 0;
}

const char *path_init(struct path *path, const struct path_config *config)
{
	*path = (struct path){ .config = *config, .feed = 1 };
	if (!(config->deviation >= 0) || !isfinite(config->deviation))
		return "corner-deviation has to be 0 or more";
	for (unsigned int i = 0; i < config->axes; i++)
		if (!can_move(&config->axis[i]) && !is_none(&config->axis[i]))
			return "max-speed and max-acceleration have to be above 0";
	return NULL;
}

void path_limit(struct path *path, unsigned int axis, const struct path_axis_config *limits)
{
	path->config.axis[axis] = can_move(limits) ? *limits :
						     (struct path_axis_config){ .speed = 0 };
}

static struct path_move *move_at(struct path *path, unsigned int index)
{
	return &path->move[(path->first + index) % PATH_MOVES];
}

/* How much of that in this direction, if each axis has its own limit? */
static double speed_along(const struct path *path, const double *unit)
{
	double most = INFINITY;

	for (unsigned int i = 0; i < path->config.axes; i++)
		if (unit[i] != 0)
			most = fmin(most, path->config.axis[i].speed / fabs(unit[i]));
	return most;
}

static double acceleration_along(const struct path *path, const double *unit)
{
	double most = INFINITY;

	for (unsigned int i = 0; i < path->config.axes; i++)
		if (unit[i] != 0)
			most = fmin(most, path->config.axis[i].acceleration / fabs(unit[i]));
	return most;
}

/* The square of the speed at the corner between two moves. */
static double corner_of(const struct path *path, const struct path_move *one,
			const struct path_move *next)
{
	const double fastest = fmin(one->speed_most, next->speed_most);
	double cosine = 0, turn[PATH_AXES] = { 0 }, size = 0, half, rate, round, curve;

	for (unsigned int i = 0; i < path->config.axes; i++) {
		cosine += one->unit[i] * next->unit[i];
		turn[i] = next->unit[i] - one->unit[i];
		size += turn[i] * turn[i];
	}
	if (cosine >= 1 - STRAIGHT)
		return fastest * fastest;
	if (cosine <= -1 + STRAIGHT)
		return 0;
	for (unsigned int i = 0; i < path->config.axes; i++)
		turn[i] /= sqrt(size);
	rate = acceleration_along(path, turn);
	half = sqrt((1 + cosine) / 2);
	round = rate * path->config.deviation * half / (1 - half);
	curve = rate * fmin(one->length, next->length) / sqrt(size);
	return fmin(fastest * fastest, fmin(round, curve));
}

static double cruise_of(const struct path *path, const struct path_move *move)
{
	return fmin(move->speed * path->feed, move->speed_most);
}

/* From the end to the beginning. */
static void plan(struct path *path)
{
	double safe = 0, planned = 0;

	for (unsigned int i = path->count; i-- > 0;) {
		struct path_move *move = move_at(path, i);
		const double more = 2 * move->acceleration * move->length;
		double cruise = cruise_of(path, move);

		if (i)
			cruise = fmin(cruise, cruise_of(path, move_at(path, i - 1)));
		safe = fmin(move->corner, safe + more);
		planned = fmin(fmin(safe, cruise * cruise), planned + more);
		move->safe = safe;
		move->planned = planned;
	}
}

/* Where the last move ends, or the axes are. */
static const double *last_place(struct path *path)
{
	return path->count ? move_at(path, path->count - 1)->end : path->position;
}

double path_end(const struct path *path, unsigned int axis)
{
	const unsigned int last = (path->first + path->count + PATH_MOVES - 1) % PATH_MOVES;

	return path->count ? path->move[last].end[axis] : path->position[axis];
}

static bool is_place(double value)
{
	return fabs(value) <= PATH_PLACE_MOST;
}

static bool can_all_move(const struct path *path, uint32_t axes)
{
	if (axes >> path->config.axes)
		return false;
	for (unsigned int i = 0; i < path->config.axes; i++)
		if (axes >> i & 1 && is_none(&path->config.axis[i]))
			return false;
	return true;
}

/* The move, but for its corner. */
static bool make_move(struct path *path, struct path_move *move, uint32_t axes, const double *at,
		      const double *end, double speed)
{
	const double *last = last_place(path);
	double square = 0;

	for (unsigned int i = 0; i < path->config.axes; i++) {
		const double from = path->axes >> i & 1 ? last[i] : axes >> i & 1 ? at[i] : 0;

		move->end[i] = axes >> i & 1 ? end[i] : from;
		move->unit[i] = move->end[i] - from;
		square += move->unit[i] * move->unit[i];
		if (!is_place(from) || !is_place(move->end[i]))
			return false;
	}
	move->length = sqrt(square);
	for (unsigned int i = 0; move->length > 0 && i < path->config.axes; i++)
		move->unit[i] /= move->length;
	move->speed_most = speed_along(path, move->unit);
	move->acceleration = acceleration_along(path, move->unit);
	move->speed = speed > 0 ? speed : move->speed_most;
	return true;
}

/* Axes that were not part of it join it where they are. */
static void join(struct path *path, uint32_t axes, const double *at)
{
	for (unsigned int i = 0; i < path->config.axes; i++) {
		if (path->axes >> i & 1 || !(axes >> i & 1))
			continue;
		path->position[i] = at[i];
		for (unsigned int k = 0; k < path->count; k++)
			move_at(path, k)->end[i] = at[i];
	}
	path->axes |= axes;
}

enum path_refusal path_add(struct path *path, uint32_t axes, const double *at, const double *end,
			   double speed)
{
	struct path_move move = { 0 };

	if (path->ends)
		return PATH_ENDS;
	if (path->count >= PATH_MOVES)
		return PATH_FULL;
	if (!(speed >= 0 && speed <= SPEED_MOST) || !can_all_move(path, axes) ||
	    !make_move(path, &move, axes, at, end, speed))
		return PATH_ODD;
	join(path, axes, at);
	path->taken++;
	if (move.length < LENGTH_LEAST)
		return PATH_TAKEN;
	if (path->count)
		move.corner = corner_of(path, move_at(path, path->count - 1), &move);
	*move_at(path, path->count) = move;
	path->count++;
	plan(path);
	return PATH_TAKEN;
}

bool path_is_idle(const struct path *path)
{
	return !path->count;
}

static void forget(struct path *path)
{
	path->count = 0;
	path->speed = path->done = 0;
	path->ends = false;
}

static bool slows_down(const struct path *path)
{
	return path->held || path->ends || path->feed <= 0;
}

/*
 * The highest speed after `seconds` from which it can still slow down to `end` (squared) in what is
 * left then of `rest`. A difference of roots would be 0 where little is left.
 */
static double braking(double speed, double rest, double end, double rate, double seconds)
{
	const double change = rate * seconds;
	const double room = end + 2 * rate * rest - change * speed;

	return room > 0 ? 2 * room / (sqrt(change * change + 4 * room) + change) : 0;
}

static double within(double value, double low, double high)
{
	return value < low ? low : value > high ? high : value;
}

/* How fast it is at the end of its move, if it gets there. */
static double speed_at_end(const struct path *path, double rest, double rate, double cruise,
			   double planned, double safe)
{
	const double square = path->speed * path->speed;
	const double low = sqrt(fmax(square - 2 * rate * rest, 0));
	const double high = sqrt(square + 2 * rate * rest);

	return fmin(within(fmin(cruise, planned), low, high), safe);
}

static void next_move(struct path *path)
{
	path->first = (path->first + 1) % PATH_MOVES;
	path->count--;
	path->done = 0;
}

/* Within the first move, for so long. */
static void go_on(struct path *path, double rest, double rate, double wanted, double seconds)
{
	const double before = path->speed, change = rate * seconds;

	path->speed = within(wanted, before - change, before + change);
	if (path->speed > 0)
		path->done += fmin((before + path->speed) / 2 * seconds, rest);
	else /* it stands before they are over */
		path->done += fmin(before * before / (2 * rate), rest);
	path->speed = fmax(path->speed, 0);
}

/* Advance by so many seconds, or to the end of the first move. What is left of them. */
static double advance(struct path *path, double seconds)
{
	const struct path_move *move = move_at(path, 0);
	const struct path_move *next = path->count > 1 ? move_at(path, 1) : NULL;
	const double safe = next ? next->safe : 0, planned = next ? next->planned : 0;
	const double cruise = slows_down(path) ? 0 : cruise_of(path, move);
	const double rest = move->length - path->done, rate = move->acceleration;
	const double square = path->speed * path->speed;
	const double at_end = speed_at_end(path, rest, rate, cruise, sqrt(planned), sqrt(safe));
	const double needed = 2 * rest / (path->speed + at_end);
	const bool stands_before = slows_down(path) && square <= 2 * rate * rest;

	if (rest <= LENGTH_LEAST || (needed <= seconds && !stands_before)) {
		path->speed = at_end;
		next_move(path);
		return rest > LENGTH_LEAST ? seconds - needed : seconds;
	}
	go_on(path, rest, rate, fmin(cruise, braking(path->speed, rest, planned, rate, seconds)),
	      seconds);
	return 0;
}

/* Where the axes are on the first move; `end`: where the last one has ended, if it has. */
static void show(struct path *path, const double *end)
{
	const struct path_move *move = path->count ? move_at(path, 0) : NULL;

	for (unsigned int i = 0; i < path->config.axes; i++) {
		if (move)
			path->position[i] = move->end[i] -
					    move->unit[i] * (move->length - path->done);
		else if (end)
			path->position[i] = end[i];
		path->velocity[i] = move ? move->unit[i] * path->speed : 0;
	}
}

void path_step(struct path *path, uint64_t now_ns)
{
	const uint64_t passed_ns = path->step_ns ? since(path->step_ns, now_ns) : 0;
	double seconds = fmin((double)passed_ns / SECOND, STEP_MOST_S);
	const double *end = NULL;

	path->step_ns = now_ns;
	while (path->count && seconds > 0) {
		end = move_at(path, 0)->end;
		seconds = advance(path, seconds);
	}
	show(path, end);
	if (path->ends && path->speed <= 0)
		forget(path);
}

void path_hold(struct path *path, bool held)
{
	path->held = held;
}

bool path_abort(struct path *path)
{
	if (path_is_idle(path))
		return false;
	path->ends = true;
	return true;
}

void path_stop(struct path *path)
{
	forget(path);
	for (unsigned int i = 0; i < path->config.axes; i++)
		path->velocity[i] = 0;
}

bool path_feed(struct path *path, double feed)
{
	if (!(feed >= 0 && feed <= PATH_FEED_MOST))
		return false;
	path->feed = feed;
	plan(path);
	return true;
}

void path_leave(struct path *path, uint32_t axes)
{
	path->axes &= ~axes;
}
