/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing as most machines do it: search the switch, back off it, and approach it slowly. The axis
 * follows a path whose speed changes by the acceleration only, so each state goes over to the next
 * one without a stop.
 *
 * A change of the switch counts when it has been read some times in a row: a disturbance of one
 * moment is no switch, and a contact that bounces is left when it has ceased to. Its place is that
 * of the first of these readings. Switch and encoder may be read at different times, so it is where
 * the axis was, at its speed, in the middle between this reading and the one before. If readings
 * were lost just then, or the axis still moved away from the switch, the approach is begun again.
 *
 * Each state has a way and a time. Both are those of the path; an axis that does not follow its
 * path has a fault of its own.
 */

#include "daemon/loops/servo_home.h"

#include <math.h>
#include <stddef.h>

#include "daemon/loops/servo_part.h"

#define CLOSED 3		/* readings in a row, */
#define OPENED 10
#define CLOSED_NS UINT64_C(2000000)	/* ... and for so long */
#define OPENED_NS UINT64_C(9000000)
#define LOST 3			/* times the usual time from one reading to the next */
#define AVERAGE 16		/* readings */
#define ROUNDS 5
#define EDGE_READINGS 1.5	/* at the speed of the search, and */
#define EDGE_COUNTS 8		/* ... so many counts: a place where the switch has opened */
#define FULL 0.99		/* of the speed */
#define LEFT_S 0.1		/* a switch has opened so long after it was reached, and the rest */
#define TIMES_MORE 2.0		/* the time that a state needs */
#define SECONDS_MORE 2.0
#define STEP_MOST_S 0.01	/* a longer pause is none of the path */

static const char *judge(const struct servo_home_config *config, const struct servo_config *servo)
{
	if (!isfinite(config->search) || fabs(config->search) > servo->speed_most)
		return "home-search-speed has to be at most max-speed, in either direction";
	if (!(config->latch > 0 && config->latch <= fabs(config->search)))
		return "home-latch-speed has to be above 0, and at most home-search-speed without "
		       "its sign";
	if (!(config->acceleration > 0) || !isfinite(config->acceleration))
		return "home-acceleration has to be above 0";
	if (!(config->distance > 0) || !isfinite(config->distance))
		return "home-distance has to be given if min-position or max-position is none";
	if (!isfinite(config->offset) || !isfinite(config->position))
		return "home-offset and home-position have to be numbers";
	if (!(config->position >= servo->least && config->position <= servo->most))
		return "home-position has to be from min-position to max-position";
	if (config->search * config->search / config->acceleration > config->distance)
		return "home-distance is too short to stop from home-search-speed with "
		       "home-acceleration, and to go back as far";
	if (fabs(config->position - config->offset) > config->distance)
		return "home-position is further than home-distance from the home switch "
		       "(home-offset)";
	return NULL;
}

const char *servo_home_init(struct servo_home *home, const struct servo_home_config *config,
			    const struct servo_config *servo)
{
	*home = (struct servo_home){ .config = *config };
	return config->search != 0 ? judge(config, servo) : NULL;
}

static void enter(struct servo_home *home, enum servo_home_state state, double way, uint64_t now_ns)
{
	home->state = state;
	home->from = home->path;
	home->way = way;
	home->since_ns = now_ns;
}

bool servo_home_begin(struct servo_home *home, struct servo *servo, uint64_t now_ns)
{
	if (home->config.search == 0 || !servo->enabled ||
	    (home->state == SERVO_HOME_IDLE && fabs(servo->wanted_rate) > home->config.latch))
		return false;
	if (home->state == SERVO_HOME_IDLE) {
		home->path = servo->wanted;
		home->speed = servo->wanted_rate;
		home->step_ns = now_ns;
	}
	home->end = SERVO_HOME_NONE;
	home->pressed = false;
	home->alike = home->rounds = home->readings = 0;
	home->read_ns = now_ns;
	home->interval_ns = 0;
	servo->homed = false;
	enter(home, SERVO_HOME_LEAVE, home->config.distance, now_ns);
	return true;
}

static void finish(struct servo_home *home, enum servo_home_end end)
{
	home->state = SERVO_HOME_HOLD;
	home->end = end;
	home->stands = false;
	handover_begin(&home->handover);
}

static bool works(const struct servo_home *home)
{
	return home->state != SERVO_HOME_IDLE && home->state != SERVO_HOME_HOLD;
}

bool servo_home_moves(const struct servo_home *home)
{
	return works(home) || (home->state == SERVO_HOME_HOLD && home->speed != 0);
}

bool servo_home_leave(struct servo_home *home)
{
	if (servo_home_moves(home))
		return false;
	home->state = SERVO_HOME_IDLE;
	return true;
}

bool servo_home_abort(struct servo_home *home, const struct servo *servo)
{
	if (!works(home) || !servo->enabled)
		return false;
	finish(home, SERVO_HOME_ABORTED);
	return true;
}

/* The highest speed after this step from which it can still stop in what is left then of `rest`. */
static double stopping_speed(const struct servo_home *home, double rest, double change)
{
	const double room = 2 * home->config.acceleration * fabs(rest) -
			    change * home->speed * copysign(1, rest);

	return room > 0 ? (sqrt(change * change + 4 * room) - change) / 2 : 0;
}

/* How fast it shall be in this state. */
static double wanted_speed(const struct servo_home *home, double change)
{
	const struct servo_home_config *config = &home->config;
	const double rest = config->position - home->path;

	switch (home->state) {
	case SERVO_HOME_LEAVE:
		return home->pressed ? -config->search : 0;
	case SERVO_HOME_SEARCH:
		return config->search;
	case SERVO_HOME_BACK:
		return -config->search;
	case SERVO_HOME_APPROACH:
		return copysign(config->latch, config->search);
	case SERVO_HOME_GO:
		return copysign(fmin(fabs(config->search), stopping_speed(home, rest, change)),
				rest);
	case SERVO_HOME_IDLE:
	case SERVO_HOME_HOLD:
	case SERVO_HOME_STATES:
		break;
	}
	return 0;
}

/* One step of the path. */
static void advance(struct servo_home *home, struct servo *servo, double seconds)
{
	const double change = home->config.acceleration * seconds, before = home->speed;
	const double more = wanted_speed(home, change) - before;
	const double rest = home->config.position - home->path;

	home->speed += fmax(-change, fmin(more, change));
	home->path += (before + home->speed) / 2 * seconds;
	/* the last step of a way that is known */
	if (home->state == SERVO_HOME_GO && fabs(home->speed) <= 2 * change &&
	    fabs(rest) <= 2 * change * seconds) {
		home->path = home->config.position;
		home->speed = 0;
		servo_renumber(servo, 0, true);
		finish(home, SERVO_HOME_DONE);
	}
}

/* Where the axis was between this reading of the switch and the one before. */
static double place_of(const struct servo *servo, uint64_t before_ns, uint64_t read_ns)
{
	const double middle_ns = (double)before_ns / 2 + (double)read_ns / 2;

	return servo->position + servo->rate * (middle_ns - (double)servo->read_ns) / SECOND;
}

/* The usual time between two readings. A long gap counts as LOST times the usual one at most. */
static void note_interval(struct servo_home *home, double passed_ns)
{
	if (home->readings == 1)
		home->interval_ns = passed_ns;
	else if (home->readings)
		home->interval_ns +=
			(fmin(passed_ns, LOST * home->interval_ns) - home->interval_ns) / AVERAGE;
	home->readings++;
}

/* A new reading of the switch. */
static void take(struct servo_home *home, const struct servo *servo,
		 const struct servo_home_input *input)
{
	const double passed_ns = (double)(input->read_ns - home->read_ns);
	if (input->active != home->active || !home->alike) {
		home->alike = 0;
		home->active = input->active;
		home->edge = place_of(servo, home->read_ns, input->read_ns);
		home->exact = home->state == SERVO_HOME_APPROACH &&
			      home->speed * home->config.search > 0 && home->readings > AVERAGE &&
			      passed_ns <= LOST * home->interval_ns &&
			      (double)since(servo->read_ns, input->read_ns) <=
				      LOST * home->interval_ns;
		home->run_ns = input->read_ns;
	}
	home->alike++;
	note_interval(home, passed_ns);
	home->read_ns = input->read_ns;
}

static bool has_closed(const struct servo_home *home)
{
	return home->active && home->alike >= CLOSED && home->read_ns - home->run_ns >= CLOSED_NS;
}

/* It told the same for long, as a contact does not that bounces. */
static bool is_sure(const struct servo_home *home)
{
	return home->alike >= OPENED && home->read_ns - home->run_ns >= OPENED_NS;
}

/* On the slow way there is time, and no disturbance is taken for the switch. */
static bool stays_closed(const struct servo_home *home)
{
	return home->active && is_sure(home);
}

static bool has_opened(const struct servo_home *home)
{
	return !home->active && is_sure(home);
}

/*
 * ... and the axis is on its way from it. It turns only then, and the switch has to stay open until
 * it has: what had opened for a moment closes again while it still moves away.
 */
static bool is_left(const struct servo_home *home)
{
	return has_opened(home) &&
	       home->speed * copysign(1, home->config.search) <= -FULL * fabs(home->config.search);
}

/* To stop from the search, and as much again. */
static double overrun(const struct servo_home *home)
{
	return home->config.search * home->config.search / home->config.acceleration;
}

/* The switch was reached a moment ago, so it has to open soon. */
static void go_back(struct servo_home *home, const struct servo *servo, uint64_t now_ns)
{
	const double read_s = (CLOSED + OPENED) * home->interval_ns / SECOND;

	const double way = overrun(home) + 2 * servo->config.follow_most +
			   fabs(home->config.search) * (LEFT_S + read_s);

	enter(home, SERVO_HOME_BACK, fmin(way, home->config.distance), now_ns);
}

/* The switch has opened: it has to close there again. */
static void approach(struct servo_home *home, const struct servo *servo, uint64_t now_ns)
{
	const double read_s = (OPENED * home->interval_ns + OPENED_NS) / SECOND;
	const double way = fabs(home->path - home->edge) + overrun(home) +
			   servo->config.follow_most + home->config.latch * read_s;

	home->left = home->edge;
	enter(home, SERVO_HOME_APPROACH, fmin(way, home->config.distance), now_ns);
}

/* A switch closes where it has opened, or beyond: what closes before that is a disturbance. */
static bool is_beyond(const struct servo_home *home, const struct servo *servo)
{
	const double direction = copysign(1, home->config.search);
	const double read_s = home->interval_ns / SECOND;
	const double slack = EDGE_READINGS * fabs(home->config.search) * read_s +
			     EDGE_COUNTS / fabs(servo->config.scale);

	return (home->edge - home->left) * direction >= -slack;
}

/*
 * The axis is where the switch has closed: its position is known. It is homed only at the end,
 * because the switch, and what it still moves on, may be beyond a soft limit.
 */
static void know(struct servo_home *home, struct servo *servo, uint64_t now_ns)
{
	const double shift = home->config.offset - home->edge;

	servo_renumber(servo, shift, false);
	home->path += shift;
	enter(home, SERVO_HOME_GO, INFINITY, now_ns);
}

/* It has closed on the approach. */
static void close_in(struct servo_home *home, struct servo *servo, uint64_t now_ns)
{
	if (home->exact && is_beyond(home, servo))
		know(home, servo, now_ns);
	else if (++home->rounds >= ROUNDS)
		finish(home, SERVO_HOME_LATE);
	else
		go_back(home, servo, now_ns);
}

static void look(struct servo_home *home, struct servo *servo, uint64_t now_ns)
{
	switch (home->state) {
	case SERVO_HOME_LEAVE:
		home->pressed = home->pressed || has_closed(home);
		if (home->pressed && is_left(home))
			approach(home, servo, now_ns);
		else if (!home->pressed && has_opened(home))
			enter(home, SERVO_HOME_SEARCH, home->config.distance, now_ns);
		break;
	case SERVO_HOME_SEARCH:
		if (has_closed(home))
			go_back(home, servo, now_ns);
		break;
	case SERVO_HOME_BACK:
		if (is_left(home))
			approach(home, servo, now_ns);
		break;
	case SERVO_HOME_APPROACH:
		if (stays_closed(home))
			close_in(home, servo, now_ns);
		break;
	case SERVO_HOME_IDLE:
	case SERVO_HOME_GO:
	case SERVO_HOME_HOLD:
	case SERVO_HOME_STATES:
		break;
	}
}

/* The time that this state may take. */
static double seconds_of(const struct servo_home *home)
{
	const struct servo_home_config *config = &home->config;
	const double slow = home->state == SERVO_HOME_APPROACH ? config->latch :
								 fabs(config->search);
	const double way = isfinite(home->way) ? home->way : fabs(config->position - home->from);

	return TIMES_MORE * (way / slow + 2 * fabs(config->search) / config->acceleration) +
	       SECONDS_MORE;
}

/* What has gone wrong. */
static enum servo_home_end judge_now(const struct servo_home *home, const struct servo *servo,
				     uint64_t now_ns)
{
	if (since(home->read_ns, now_ns) > servo->config.stale_ns && home->state != SERVO_HOME_GO)
		return SERVO_HOME_UNREAD;
	if (fabs(home->path - home->from) > home->way)
		return home->state == SERVO_HOME_SEARCH || home->state == SERVO_HOME_APPROACH ?
			       SERVO_HOME_NOT_FOUND :
			       SERVO_HOME_NOT_LEFT;
	return (double)since(home->since_ns, now_ns) / SECOND > seconds_of(home) ? SERVO_HOME_LATE :
										   SERVO_HOME_NONE;
}

static void work(struct servo_home *home, struct servo *servo, const struct servo_home_input *input,
		 uint64_t now_ns)
{
	enum servo_home_end wrong;

	if (input->read_ns > home->read_ns) {
		take(home, servo, input);
		look(home, servo, now_ns);
	}
	wrong = judge_now(home, servo, now_ns);
	if (wrong)
		finish(home, wrong);
}

void servo_home_step(struct servo_home *home, struct servo *servo,
		     const struct servo_home_input *input, struct servo_wish *wish, uint64_t now_ns)
{
	const double seconds = fmin((double)since(home->step_ns, now_ns) / SECOND, STEP_MOST_S);

	if (home->state == SERVO_HOME_IDLE)
		return;
	home->step_ns = now_ns;
	if (!servo->enabled) {
		home->end = works(home) ? SERVO_HOME_STOPPED : home->end;
		home->state = SERVO_HOME_IDLE;
		return;
	}
	if (works(home))
		work(home, servo, input, now_ns);
	advance(home, servo, seconds);
	if (home->state == SERVO_HOME_HOLD) {
		if (home->speed == 0 && !home->stands) {
			home->stands = true;
			if (input->limit)
				servo_watch_switch(servo, home->path, home->config.search < 0);
		}
		if (home->speed == 0 &&
		    handover_step(&home->handover, servo, wish, home->config.latch * seconds,
				  &home->path, now_ns)) {
			home->state = SERVO_HOME_IDLE;
			return;
		}
	}
	wish->position = home->path;
	wish->velocity = home->speed;
}
