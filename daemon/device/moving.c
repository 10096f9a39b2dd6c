/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The servo motors of a device go along a path together, without a commander that is in time.
 *
 * Its commander has enabled the motors, and goes on holding them enabled; only their positions come
 * from here. If it is gone, they are switched off as at any other time. If one of them is off,
 * whyever, the others slow down on the path and stand: what is left of it is no path of all of them
 * any more. Afterwards each is held until its commander's position is where it is.
 *
 * A path begins where the motors are commanded to be. A motor that is homing, or that its commander
 * moves, is on no path.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define HALF_COUNT 0.501
#define FRACTIONS 256.0		/* of a count */
#define HANDOVER_S 0.1		/* an axis that is allowed to be off by so much gets there in it */
#define STANDS_PART 0.001	/* of max-speed: it is not commanded to move, */
#define RESTS_PART 0.05		/* ... nor does it */

#define SAME(a, b) _Static_assert((int)(a) == (int)(b), #a " is not " #b)
SAME(PATH_MOVES, POKEYS_MOVES);
SAME(PATH_FULL, POKEYS_MOVES_FULL);
SAME(PATH_ODD, POKEYS_MOVES_ODD);
SAME(PATH_ENDS, POKEYS_MOVES_ENDING);

static const struct servoing *motor_of(const struct device *device, unsigned int i)
{
	return &device->servoings.servoing[i];
}

static bool has(const struct device *device, unsigned int i)
{
	return device->moving.motors >> i & 1;
}

void moving_init(struct device *device)
{
	struct path_config config = {
		.axes = device->servoings.count, .deviation = device->config.corner_deviation,
	};

	for (unsigned int i = 0; i < config.axes; i++)
		config.axis[i] = (struct path_axis_config){
			.speed = device->config.servo[i].servo.speed_most,
			.acceleration = device->config.servo[i].acceleration,
		};
	device->moving.good = !path_init(&device->moving.path, &config);
}

/* Without an end, one that had ended stays to be seen. */
static void finish(struct device *device, enum pokeys_moves_end end, unsigned int motor)
{
	device->moving.end = (uint8_t)end;
	device->moving.open = device->moving.open && end == POKEYS_MOVES_DONE;
	if (end != POKEYS_MOVES_DONE)
		device_say(device, EVENT_MOVES, end == POKEYS_MOVES_STOPPED ? EVENT_WARNING :
									      EVENT_NOTICE,
			   (int64_t)end, motor, device->moving.path.count);
}

/* Motors that are not enabled are on no path, and end it. */
static void drop_motors(struct device *device)
{
	struct moving *moving = &device->moving;
	struct path *path = &moving->path;

	for (unsigned int i = 0; i < device->servoings.count; i++) {
		if (!has(device, i) || motor_of(device, i)->servo.enabled)
			continue;
		moving->motors &= (uint8_t)~(1u << i);
		if (!(path->axes >> i & 1) || path_is_idle(path))
			continue;
		if (moving->end != POKEYS_MOVES_STOPPED)
			finish(device, POKEYS_MOVES_STOPPED, i);
		path_abort(path);
	}
	if (!(moving->motors & path->axes) && !path_is_idle(path))
		path_stop(path);
}

/* It is over: each motor is held where it is. */
static void release(struct device *device)
{
	struct moving *moving = &device->moving;

	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (moving->path.axes >> i & 1)
			handover_begin(&moving->handover[i]);
	path_leave(&moving->path, moving->path.axes);
	if (moving->end == POKEYS_MOVES_NONE)
		finish(device, POKEYS_MOVES_DONE, 0);
}

/* Where the path has its motors now. */
static void take_path(struct moving *moving)
{
	for (unsigned int i = 0; i < moving->path.config.axes; i++) {
		if (!(moving->path.axes >> i & 1))
			continue;
		moving->place[i] = moving->path.position[i];
		moving->velocity[i] = moving->path.velocity[i];
	}
}

void moving_cycle(struct device *device)
{
	struct moving *moving = &device->moving;
	struct path *path = &moving->path;

	drop_motors(device);
	path_step(path, device->now_ns);
	take_path(moving);
	if (path->axes && path_is_idle(path))
		release(device);
}

void moving_wish(struct device *device, unsigned int index, struct servo_wish *wish)
{
	const struct servo *servo = &motor_of(device, index)->servo;
	struct moving *moving = &device->moving;
	const double step = servo->config.follow_least / HANDOVER_S *
			    ((double)device->config.period_ns / SECOND);

	if (!has(device, index))
		return;
	if (!(moving->path.axes >> index & 1) &&
	    handover_step(&moving->handover[index], servo, wish, step,
			  &moving->place[index], device->now_ns)) {
		moving_leave(device, index);
		return;
	}
	wish->position = moving->place[index];
	wish->velocity = moving->velocity[index];
}

bool moving_moves(const struct device *device, unsigned int index)
{
	return device->moving.path.axes >> index & 1;
}

void moving_leave(struct device *device, unsigned int index)
{
	device->moving.motors &= (uint8_t)~(1u << index);
}

/* What was held belongs to who has commanded it. */
void moving_session(struct device *device)
{
	struct moving *moving = &device->moving;

	path_hold(&moving->path, false);
	path_feed(&moving->path, 1);
	moving->refused = POKEYS_MOVES_TAKEN;
	moving->open = false;
}

static enum pokeys_moves_state state_of(const struct device *device)
{
	const struct path *path = &device->moving.path;

	if (path_is_idle(path))
		return device->moving.motors ? POKEYS_MOVES_HANDOVER : POKEYS_MOVES_IDLE;
	if (path->ends)
		return POKEYS_MOVES_ABORTING;
	return path->held || path->feed <= 0 ? POKEYS_MOVES_HELD : POKEYS_MOVES_MOVING;
}

void moving_show(struct device *device)
{
	const struct moving *moving = &device->moving;
	struct pokeys_moves *image = &device->image.moves;

	image->taken = moving->path.taken;
	image->feed = (float)moving->path.feed;
	image->speed = (float)moving->path.speed;
	image->waiting = (uint8_t)moving->path.count;
	image->motors = moving->motors;
	image->held = moving->path.held;
	image->state = (uint8_t)state_of(device);
	image->end = moving->end;
	image->refused = moving->refused;
}

/* May this motor be moved from here? */
static enum pokeys_moves_refusal judge_motor(const struct device *device, unsigned int i)
{
	const struct servoing *servoing = motor_of(device, i);
	const struct servo *servo = &servoing->servo;

	if (!servo->enabled)
		return POKEYS_MOVES_OFF;
	if (servo_home_moves(&servoing->home))
		return POKEYS_MOVES_HOMING;
	if (servoing_tunes(device, i))
		return POKEYS_MOVES_COMMANDED;
	if (!has(device, i) && servoing->home.state == SERVO_HOME_IDLE &&
	    (fabs(servo->wanted_rate) > servo->config.speed_most * STANDS_PART ||
	     fabs(servo->rate) > servo->config.speed_most * RESTS_PART))
		return POKEYS_MOVES_COMMANDED;
	return POKEYS_MOVES_TAKEN;
}

/* Where it goes, for its counts. A soft limit may be between two of them. */
static double place_of(const struct servo *servo, double counts)
{
	const double place = counts / servo->config.scale;

	return servo->homed ? fmin(fmax(place, servo->config.least), servo->config.most) : place;
}

static bool is_beyond(const struct servo *servo, double place, double counts)
{
	return fabs(place * servo->config.scale - counts) > HALF_COUNT;
}

/* Where the motors of a move are to go, and where those stand that are on no path. */
static enum pokeys_moves_refusal take_places(const struct device *device,
					     const struct pokeys_one_shot *shot,
					     double at[PATH_AXES], double end[PATH_AXES])
{
	unsigned int values = 0;

	if (!device->moving.good || !shot->mask || shot->mask >> device->servoings.count ||
	    shot->index)
		return POKEYS_MOVES_ODD;
	for (unsigned int i = 0; i < device->servoings.count; i++) {
		const struct servo *servo = &motor_of(device, i)->servo;
		enum pokeys_moves_refusal why;
		double counts;

		if (!(shot->mask >> i & 1))
			continue;
		at[i] = has(device, i) ? device->moving.place[i] : servo->wanted;
		counts = shot->value[values] + shot->fraction[values] / FRACTIONS;
		values++;
		end[i] = place_of(servo, counts);
		why = judge_motor(device, i);
		if (!why && is_beyond(servo, end[i], counts))
			why = POKEYS_MOVES_LIMIT;
		if (why)
			return why;
	}
	return POKEYS_MOVES_TAKEN;
}

static enum pokeys_moves_refusal add(struct device *device, const struct pokeys_one_shot *shot)
{
	double at[PATH_AXES] = { 0 }, end[PATH_AXES] = { 0 };
	enum pokeys_moves_refusal why;
	struct moving *moving = &device->moving;

	if (!moving->open && !(shot->flags & POKEYS_MOVE_BEGINS))
		return POKEYS_MOVES_BROKEN;
	why = take_places(device, shot, at, end);
	if (why)
		return why;
	why = (enum pokeys_moves_refusal)path_add(&moving->path, shot->mask, at, end,
						  (double)shot->parameter[0]);
	if (why)
		return why;
	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (shot->mask >> i & 1)
			servo_home_leave(&device->servoings.servoing[i].home);
	moving->motors |= shot->mask;
	moving->end = POKEYS_MOVES_NONE;
	moving->open = true;
	return POKEYS_MOVES_TAKEN;
}

/*
 * A program sends moves before it knows the outcome of the earlier ones. After a refused move or a
 * path that ended early, the next ones would begin at another place, so the daemon refuses them
 * and keeps the first reason.
 */
bool moving_add(struct device *device, const struct pokeys_one_shot *shot)
{
	const enum pokeys_moves_refusal why = add(device, shot);
	struct moving *moving = &device->moving;

	if (why != POKEYS_MOVES_BROKEN || !moving->refused)
		moving->refused = (uint8_t)why;
	moving->open = moving->open && !why;
	moving_show(device);
	return !why;
}

bool moving_is_usual(const struct device *device)
{
	const uint8_t refused = device->moving.refused;

	return refused == POKEYS_MOVES_TAKEN || refused == POKEYS_MOVES_FULL;
}

/* On request; so it is not held any more. */
static void end_path(struct device *device, bool at_once)
{
	struct path *path = &device->moving.path;

	path_hold(path, false);
	path_abort(path);
	if (!at_once)
		return;
	path_stop(path);
	take_path(&device->moving);
	release(device);
}

static bool control(struct device *device, unsigned int which, double value)
{
	struct path *path = &device->moving.path;
	const bool moves = !path_is_idle(path);

	if (!device->servoings.count)
		return false;
	switch ((enum pokeys_moves_control)which) {
	case POKEYS_MOVES_HOLD:
		path_hold(path, true);
		return true;
	case POKEYS_MOVES_RESUME:
		path_hold(path, false);
		return true;
	case POKEYS_MOVES_FEED:
		return path_feed(path, value);
	case POKEYS_MOVES_ABORT:
	case POKEYS_MOVES_STOP:
		if (!moves)
			return false;
		if (device->moving.end == POKEYS_MOVES_NONE)
			finish(device, POKEYS_MOVES_ABORTED, 0);
		end_path(device, which == POKEYS_MOVES_STOP);
		return true;
	}
	return false;
}

bool moving_control(struct device *device, unsigned int which, double value)
{
	const bool done = control(device, which, value);

	moving_show(device);
	return done;
}
