/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The servo motors and axes of a device go along a path together, without a commander that is in
 * time.
 *
 * Its commander has enabled them, and goes on holding them enabled; only their positions come from
 * here. If it is gone, they are switched off as at any other time. If one of them is off, whyever,
 * the others slow down on the path and stand: what is left of it is no path of all of them any
 * more. Afterwards each is held until its commander's position is where it is.
 *
 * A path begins where its members are commanded to be. One that is homing, or that its commander
 * moves, is on no path.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define HALF_COUNT 0.501
#define FRACTIONS 256.0		/* of a count, or of a pulse */
#define VALUES 8		/* of a one-shot */
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

static bool is_motor(unsigned int member)
{
	return member < MOVING_AXIS;
}

bool moving_has(const struct device *device, unsigned int member)
{
	return device->moving.members >> member & 1;
}

/* The axes of the pulse engine have limits when the device's settings are known. */
void moving_init(struct device *device)
{
	struct path_config config = {
		.axes = MOVING_MEMBERS,
		.deviation = device->config.corner_deviation,
	};

	for (unsigned int i = 0; i < device->servoings.count; i++)
		config.axis[i] = (struct path_axis_config){
			.speed = device->config.servo[i].servo.speed_most,
			.acceleration = device->config.servo[i].acceleration,
		};
	device->moving.good = !path_init(&device->moving.path, &config);
	moving_axis_init(device);
	device->moving.any = device->servoings.count || moving_axis_any(device);
}

/* Without an end, one that had ended stays to be seen. */
static void finish(struct device *device, enum pokeys_moves_end end, unsigned int member)
{
	device->moving.end = (uint8_t)end;
	device->moving.open = device->moving.open && end == POKEYS_MOVES_DONE;
	if (end != POKEYS_MOVES_DONE)
		device_say(device, EVENT_MOVES,
			   end == POKEYS_MOVES_STOPPED ? EVENT_WARNING : EVENT_NOTICE, (int64_t)end,
			   member, device->moving.path.count);
}

static bool is_on(const struct device *device, unsigned int member)
{
	return is_motor(member) ? motor_of(device, member)->servo.enabled :
				  moving_axis_is_on(device, member - MOVING_AXIS);
}

/* What is not enabled is on no path, and ends it. */
static void drop_members(struct device *device)
{
	struct moving *moving = &device->moving;
	struct path *path = &moving->path;

	for (unsigned int i = 0; i < MOVING_MEMBERS; i++) {
		if (!moving_has(device, i) || is_on(device, i))
			continue;
		moving_leave(device, i);
		if (!(path->axes >> i & 1) || path_is_idle(path))
			continue;
		if (moving->end != POKEYS_MOVES_STOPPED)
			finish(device, POKEYS_MOVES_STOPPED, i);
		path_abort(path);
	}
	if (!(moving->members & path->axes) && !path_is_idle(path))
		path_stop(path);
}

/* It is over: each member is held where it is. */
static void release(struct device *device)
{
	struct moving *moving = &device->moving;

	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (moving->path.axes >> i & 1)
			handover_begin(&moving->handover[i]);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		axis_wish_rest(&moving->wish[i]);
		moving->wish[i].velocity = 0; /* what is left of its way, as fast as it can */
	}
	moving->released_ns = device->now_ns;
	path_leave(&moving->path, moving->path.axes);
	if (moving->end == POKEYS_MOVES_NONE)
		finish(device, POKEYS_MOVES_DONE, 0);
}

static void take_member(struct device *device, unsigned int i)
{
	struct moving *moving = &device->moving;

	moving->place[i] = moving->path.position[i];
	moving->velocity[i] = moving->path.velocity[i];
	if (!is_motor(i))
		moving_axis_follow(device, i - MOVING_AXIS);
}

/* Where the path has its members now. */
static void take_path(struct device *device)
{
	const struct path *path = &device->moving.path;

	for (unsigned int i = 0; i < path->config.axes; i++) {
		if (path->axes >> i & 1)
			take_member(device, i);
	}
}

/* An axis whose path has ended is its commander's as soon as that is where it is held. */
static void hand_over_axes(struct device *device)
{
	for (unsigned int i = MOVING_AXIS; i < MOVING_MEMBERS; i++)
		if (moving_has(device, i) && !moving_moves(device, i) &&
		    moving_axis_met(device, i - MOVING_AXIS))
			moving_leave(device, i);
}

/* Steps of the motion buffer belong to ticks, the readings of an encoder to their own time. */
static uint64_t time_of(const struct device *device)
{
	return moving_moves_axes(device) ? device->tick_ns : device->now_ns;
}

void moving_cycle(struct device *device)
{
	struct moving *moving = &device->moving;
	struct path *path = &moving->path;

	if (path_is_idle(path))
		moving_axis_limit(device);
	drop_members(device);
	path_hold(path, moving->held || moving_axis_waits(device));
	path_step(path, time_of(device));
	take_path(device);
	if (path->axes && path_is_idle(path))
		release(device);
	hand_over_axes(device);
}

/* So much later, but not beyond a soft limit that the path keeps to. */
static double ahead(const struct servo *servo, const struct servo_wish *wish, uint64_t later_ns)
{
	const double place = wish->position;
	const double then = place + wish->velocity * ((double)later_ns / (double)SECOND);

	if (!servo->homed)
		return then;
	return fmin(fmax(then, fmin(place, servo->config.least)), fmax(place, servo->config.most));
}

void moving_wish(struct device *device, unsigned int motor, struct servo_wish *wish)
{
	const struct servo *servo = &motor_of(device, motor)->servo;
	struct moving *moving = &device->moving;
	const double step = servo->config.follow_least / HANDOVER_S *
			    ((double)device->config.period_ns / SECOND);

	if (!moving_has(device, motor))
		return;
	if (!moving_moves(device, motor) &&
	    handover_step(&moving->handover[motor], servo, wish, step, &moving->place[motor],
			  device->now_ns)) {
		moving_leave(device, motor);
		return;
	}
	wish->position = moving->place[motor];
	wish->velocity = moving->velocity[motor];
	/* where the path has it in the time of the encoder's readings */
	if (moving_moves(device, motor) && device->now_ns > time_of(device))
		wish->position = ahead(servo, wish, device->now_ns - time_of(device));
}

bool moving_moves(const struct device *device, unsigned int member)
{
	return device->moving.path.axes >> member & 1;
}

bool moving_moves_axes(const struct device *device)
{
	return device->moving.path.axes >> MOVING_AXIS;
}

bool moving_has_axes(const struct device *device)
{
	return device->moving.members >> MOVING_AXIS;
}

void moving_leave(struct device *device, unsigned int member)
{
	device->moving.members &= (uint16_t)~(1u << member);
}

/* What was held belongs to who has commanded it. */
void moving_session(struct device *device)
{
	struct moving *moving = &device->moving;

	moving->held = false;
	path_feed(&moving->path, 1);
	moving->refused = POKEYS_MOVES_TAKEN;
	moving->open = false;
}

static enum pokeys_moves_state state_of(const struct device *device)
{
	const struct path *path = &device->moving.path;

	if (path_is_idle(path))
		return device->moving.members ? POKEYS_MOVES_HANDOVER : POKEYS_MOVES_IDLE;
	if (path->ends)
		return POKEYS_MOVES_ABORTING;
	return device->moving.held || path->held || path->feed <= 0 ? POKEYS_MOVES_HELD :
								      POKEYS_MOVES_MOVING;
}

void moving_show(struct device *device)
{
	const struct moving *moving = &device->moving;
	struct pokeys_moves *image = &device->image.moves;

	image->taken = moving->path.taken;
	image->feed = (float)moving->path.feed;
	image->speed = (float)moving->path.speed;
	image->waiting = (uint8_t)moving->path.count;
	image->motors = moving->members & ((1u << MOVING_AXIS) - 1);
	image->axes = (uint8_t)(moving->members >> MOVING_AXIS);
	image->held = moving->held;
	image->state = (uint8_t)state_of(device);
	image->end = moving->end;
	image->refused = moving->refused;
}

/* May this motor be moved from here? */
static enum pokeys_moves_refusal judge_motor(const struct device *device, unsigned int i,
					     double place, double counts)
{
	const struct servoing *servoing = motor_of(device, i);
	const struct servo *servo = &servoing->servo;

	if (!servo->enabled)
		return POKEYS_MOVES_OFF;
	if (servo_home_moves(&servoing->home))
		return POKEYS_MOVES_HOMING;
	if (servoing_tunes(device, i))
		return POKEYS_MOVES_COMMANDED;
	if (!moving_has(device, i) && servoing->home.state == SERVO_HOME_IDLE &&
	    (fabs(servo->wanted_rate) > servo->config.speed_most * STANDS_PART ||
	     fabs(servo->rate) > servo->config.speed_most * RESTS_PART))
		return POKEYS_MOVES_COMMANDED;
	return fabs(place * servo->config.scale - counts) > HALF_COUNT ? POKEYS_MOVES_LIMIT :
									 POKEYS_MOVES_TAKEN;
}

/* Where it goes, for its counts. A soft limit may be between two of them. */
static double motor_place(const struct servo *servo, double counts)
{
	const double place = counts / servo->config.scale;

	return servo->homed ? fmin(fmax(place, servo->config.least), servo->config.most) : place;
}

/* Where it stands, and where it is to go; what is against that. */
static enum pokeys_moves_refusal take_motor(const struct device *device, unsigned int i,
					    double counts, double *at, double *end)
{
	const struct servo *servo = &motor_of(device, i)->servo;

	*at = servo->wanted;
	*end = motor_place(servo, counts);
	return judge_motor(device, i, *end, counts);
}

static enum pokeys_moves_refusal take_axis(const struct device *device, unsigned int axis,
					   double pulses, double *at, double *end)
{
	*at = moving_axis_place(device, axis);
	*end = pulses / device->config.axis[axis].pulses_per_unit;
	return moving_axis_judge(device, axis, pulses);
}

static uint16_t members_of(const struct pokeys_one_shot *shot)
{
	return (uint16_t)(shot->mask | shot->index << MOVING_AXIS);
}

/* Where the members of a move are to go, and where those stand that are on no path. */
static enum pokeys_moves_refusal take_places(const struct device *device,
					     const struct pokeys_one_shot *shot,
					     double at[PATH_AXES], double end[PATH_AXES])
{
	const uint16_t members = members_of(shot);
	unsigned int values = 0;

	if (!device->moving.good || !members || shot->mask >> device->servoings.count)
		return POKEYS_MOVES_ODD;
	for (unsigned int i = 0; i < MOVING_MEMBERS; i++) {
		enum pokeys_moves_refusal why;
		double counts;

		if (!(members >> i & 1))
			continue;
		if (values == VALUES)
			return POKEYS_MOVES_ODD;
		counts = shot->value[values] + shot->fraction[values] / FRACTIONS;
		values++;
		why = is_motor(i) ? take_motor(device, i, counts, &at[i], &end[i]) :
				    take_axis(device, i - MOVING_AXIS, counts, &at[i], &end[i]);
		if (why)
			return why;
		if (moving_has(device, i))
			at[i] = device->moving.place[i];
	}
	return POKEYS_MOVES_TAKEN;
}

/* They are held by the path from now on. */
static void join(struct device *device, uint16_t members)
{
	for (unsigned int i = 0; i < MOVING_MEMBERS; i++) {
		if (!(members >> i & 1))
			continue;
		if (is_motor(i))
			servo_home_leave(&device->servoings.servoing[i].home);
		else if (!moving_has(device, i))
			moving_axis_join(device, i - MOVING_AXIS);
	}
	device->moving.members |= members;
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
	why = (enum pokeys_moves_refusal)path_add(&moving->path, members_of(shot), at, end,
						  (double)shot->parameter[0]);
	if (why)
		return why;
	join(device, members_of(shot));
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

	device->moving.held = false;
	path_hold(path, false);
	path_abort(path);
	if (!at_once || moving_axis_buffered(device))
		return;
	path_stop(path);
	for (unsigned int i = 0; i < path->config.axes; i++) {
		if (!(path->axes >> i & 1))
			continue;
		if (is_motor(i))
			take_member(device, i);
		else
			moving_axis_halt(device, i - MOVING_AXIS);
	}
	release(device);
}

static bool control(struct device *device, unsigned int which, double value)
{
	struct path *path = &device->moving.path;
	const bool moves = !path_is_idle(path);

	if (!device->moving.any)
		return false;
	switch ((enum pokeys_moves_control)which) {
	case POKEYS_MOVES_HOLD:
		device->moving.held = true;
		return true;
	case POKEYS_MOVES_RESUME:
		device->moving.held = false;
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
