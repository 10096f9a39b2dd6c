/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The command image comes in: looked at once a cycle, believed in nothing.
 *
 * Each field is judged by itself. A bad value is refused, counted and
 * flagged, and the last good value of that field stays; so a commander with
 * one broken axis still has its outputs. Off is never refused: machine-on and
 * an axis' enable that fall, and an emergency stop, are heard whatever stands beside them. The last
 * good position is a place to stand at, the last good speed is none: an axis in
 * velocity mode stands while its command is bad. An image that is refused as a
 * whole is as good as none: the heartbeat grows old by itself.
 *
 * The heartbeat is late by our own clock, from when we last saw it change.
 * The commander's time stamps prove nothing: its clock may be another one,
 * and a dead commander's last image stays in memory for ever. For the same
 * reason the first image of a session is not fresh until it changes.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define SAY_AGAIN_NS (10 * SECOND)
#define BUFFERED_MAX INT32_C(2100000000)	/* protocol section 3.24.1 */
#define VELOCITY_MAX 1e7f
#define SPEED_MARGIN 1.001f		/* above the highest speed is still rounding */
#define KNOWN_FLAGS (POKEYS_COMMAND_MACHINE_ON | POKEYS_COMMAND_LIMIT_OVERRIDE | \
		     POKEYS_COMMAND_EMERGENCY | POKEYS_COMMAND_RESUMED | POKEYS_COMMAND_ENDS)

/* Count it; true when it is time to say it (again). */
static bool count(struct device *device, enum command_fault fault)
{
	struct intake *intake = &device->intake;
	uint64_t *said = &intake->said_ns[fault];

	intake->bad = true;
	intake->refused++;
	if (*said && device->now_ns - *said < SAY_AGAIN_NS)
		return false;
	*said = device->now_ns;
	return true;
}

void intake_refuse(struct device *device, enum command_fault fault, int64_t index)
{
	if (count(device, fault))
		device_say(device, EVENT_BAD_COMMAND, EVENT_WARNING, fault, index, 0);
}

static void take_flags(struct device *device, uint32_t flags)
{
	if (flags & ~(uint32_t)KNOWN_FLAGS) {
		intake_refuse(device, COMMAND_FAULT_FLAGS, flags);
		device->intake.machine_on &= (flags & POKEYS_COMMAND_MACHINE_ON) != 0;
		device->intake.limit_override &= (flags & POKEYS_COMMAND_LIMIT_OVERRIDE) != 0;
		device->intake.emergency |= (flags & POKEYS_COMMAND_EMERGENCY) != 0;
		return;
	}
	device->intake.machine_on = flags & POKEYS_COMMAND_MACHINE_ON;
	device->intake.limit_override = flags & POKEYS_COMMAND_LIMIT_OVERRIDE;
	device->intake.emergency = flags & POKEYS_COMMAND_EMERGENCY;
}

static void take_outputs(struct device *device, const struct pokeys_command *command)
{
	const uint64_t outputs = pins_load(command->digital_out);
	const uint64_t mask = pins_load(command->digital_out_mask);
	const uint64_t beyond = (outputs | mask) & ~OUTPUT_PINS;

	if (beyond) {
		intake_refuse(device, COMMAND_FAULT_OUTPUT, __builtin_ctzll(beyond) / 8);
		return;
	}
	device->intake.outputs = outputs;
	device->intake.outputs_mask = mask;
}

bool intake_beyond_soft_limits(const struct device *device, unsigned int i, double from, double to)
{
	const struct pokeys_axis *axis = &device->image.engine.axis[i];

	return (to > axis->soft_maximum && to > from) || (to < axis->soft_minimum && to < from);
}

/* ... as this device is set up. */
static enum command_fault setup_fault(const struct device *device, unsigned int i,
				      const struct pokeys_axis_command *axis)
{
	const struct pokeys_axis *known = &device->image.engine.axis[i];

	if (!motion_drivable(device, i) || axis->mode != known->mode)
		return COMMAND_FAULT_AXIS_SETUP;
	if (axis->mode == POKEYS_AXIS_VELOCITY)
		return fabsf(axis->velocity) > known->max_speed * SPEED_MARGIN ?
			       COMMAND_FAULT_AXIS_SPEED :
			       COMMAND_FAULT_NONE;
	return intake_beyond_soft_limits(device, i, known->position, axis->position) ?
		       COMMAND_FAULT_AXIS_SOFT_LIMIT :
		       COMMAND_FAULT_NONE;
}

int32_t intake_furthest(uint8_t mode)
{
	return mode == POKEYS_AXIS_BUFFERED ? BUFFERED_MAX : MOTION_POSITION_MAX;
}

/* What is wrong with an axis as commanded. */
static enum command_fault axis_fault(const struct device *device, unsigned int i,
				     const struct pokeys_axis_command *axis)
{
	if (axis->enable > 1)
		return COMMAND_FAULT_AXIS_ENABLE;
	if (axis->mode == POKEYS_AXIS_OFF)
		return COMMAND_FAULT_NONE;
	if (axis->mode > POKEYS_AXIS_BUFFERED)
		return COMMAND_FAULT_AXIS_MODE;
	if (axis->position > intake_furthest(axis->mode) ||
	    axis->position < -intake_furthest(axis->mode))
		return COMMAND_FAULT_AXIS_POSITION;
	if (!isfinite(axis->velocity) || fabsf(axis->velocity) > VELOCITY_MAX)
		return COMMAND_FAULT_AXIS_VELOCITY;
	if (!axis->enable || !running(device))
		return COMMAND_FAULT_NONE;
	if (device->safe.permitted && !device->intake.axis[i].enable &&
	    !device->intake.read_recently)
		return COMMAND_FAULT_AXIS_UNREAD;
	return setup_fault(device, i, axis);
}

/* Only while the device follows it, the way in which it moves on counts. */
static void follow(struct device *device, unsigned int i, int32_t position,
		   const struct axis_images *images)
{
	struct axis_wish *wish = &device->intake.axis[i];

	axis_wish_position(wish, position, device->now_ns);
	if (!(device->motion.driven >> i & 1) || moving_has(device, MOVING_AXIS + i)) {
		axis_wish_rest(wish);
		return;
	}
	axis_wish_follow(wish, images);
	reference_lead(device, i, wish);
}

static void take_axis(struct device *device, unsigned int i, const struct pokeys_axis_command *axis,
		      const struct axis_images *images)
{
	const enum command_fault fault = axis_fault(device, i, axis);
	struct axis_wish *wish = &device->intake.axis[i];

	wish->good = !fault;
	if (fault) {
		intake_refuse(device, fault, i);
		wish->enable &= axis->enable != 0;
		if (wish->mode == POKEYS_AXIS_VELOCITY)
			wish->velocity = 0;
		follow(device, i, wish->position, images);
		return;
	}
	wish->enable = axis->enable && axis->mode != POKEYS_AXIS_OFF;
	wish->mode = axis->mode;
	wish->velocity = axis->mode == POKEYS_AXIS_VELOCITY ? axis->velocity :
							      fabsf(axis->velocity);
	follow(device, i, axis->position, images);
}

static void take_values(struct device *device, const struct pokeys_command *command,
			const struct axis_images *images)
{
	device->intake.bad = false;
	take_flags(device, command->flags);
	take_outputs(device, command);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		take_axis(device, i, &command->axis[i], images);
	intake_outputs(device, command);
}

/*
 * Another commander, or the same one started anew: nothing of before counts.
 * Not fresh yet, it also ends the permission to move.
 */
static void begin_session(struct device *device, const struct pokeys_command *command)
{
	struct intake *intake = &device->intake;

	intake->session = command->session;
	intake->heartbeat = command->heartbeat;
	intake->seen_ns = 0;
	intake->ended = false;
	intake->machine_on = false;
	intake->limit_override = false;
	intake->emergency = command->flags & POKEYS_COMMAND_EMERGENCY;
	intake->outputs = 0;
	intake->outputs_mask = 0;
	memset(intake->axis, 0, sizeof(intake->axis));
	memset(&intake->output, 0, sizeof(intake->output));
	memset(&intake->heating, 0, sizeof(intake->heating));
	memset(intake->servoing, 0, sizeof(intake->servoing));
	device->shared.pwm = 0;
	device->safe.commanded |= pins_load(command->digital_out_mask) & OUTPUT_PINS;
	safe_session(device, command->flags & POKEYS_COMMAND_MACHINE_ON,
		     command->flags & POKEYS_COMMAND_RESUMED);
	loops_session(device);
	one_shot_session(device, command->one_shot_head);
	wish_session(device, command->session);
}

static bool readable(struct device *device, const struct pokeys_command *command, int refused)
{
	if (refused) {
		intake_refuse(device, COMMAND_FAULT_IMAGE, refused);
		return false;
	}
	if (!command)
		return false;
	if (command->magic != POKEYS_COMMAND_MAGIC || command->version != POKEYS_COMMAND_VERSION) {
		if (count(device, COMMAND_FAULT_IMAGE))
			device_say(device, EVENT_FOREIGN_IMAGE, EVENT_ERROR, command->magic,
				   command->version, 0);
		return false;
	}
	if (!command->session) {
		intake_refuse(device, COMMAND_FAULT_SESSION, 0);
		return false;
	}
	return true;
}

static bool heartbeat_fresh(const struct device *device)
{
	const struct intake *intake = &device->intake;

	return intake->seen_ns &&
	       device->now_ns - intake->seen_ns < device->config.heartbeat_timeout_ns;
}

/* Of each read since the last image that was looked at; what is older is overwritten. */
static void take_ages(struct device *device, const struct pokeys_command *command)
{
	uint64_t writes = command->heartbeat - device->intake.heartbeat;

	if (writes > POKEYS_READ_AGES)
		writes = POKEYS_READ_AGES;
	for (uint64_t i = 0; i < writes; i++) {
		uint32_t age_ns = command->read_age_ns[(command->heartbeat - i) % POKEYS_READ_AGES];

		if (age_ns)
			histogram_add(&device->meter.age_at_read, age_ns);
	}
}

/* Both times are of the commander's clock, whichever that is. */
static void take_read(struct intake *intake, const struct pokeys_command *command)
{
	const uint64_t period = command->period_ns < SECOND ? command->period_ns : SECOND;
	const bool read = command->t_thread_ns && command->t_thread_ns <= command->t_ns;

	intake->read_age_ns = read ? command->t_ns - command->t_thread_ns : POKEYS_NEVER;
	intake->read_recently = intake->read_age_ns <= POKEYS_READ_OLD_NS + 4 * period;
}

/* Since the last image that was looked at. */
static struct axis_images new_images(const struct device *device,
				     const struct pokeys_command *command)
{
	const struct intake *intake = &device->intake;
	const uint64_t count = command->heartbeat - intake->heartbeat;

	return (struct axis_images){
		/* it is 1, too, if this is the first one, or the heartbeat went back */
		.count = intake->seen_ns && count < UINT32_MAX ? count : 1,
		.apart_ns = command->period_ns < SECOND ? command->period_ns : 0,
		.seen_ns = device->now_ns,
	};
}

static void leave(struct device *device)
{
	struct intake *intake = &device->intake;

	if (intake->fresh)
		safe_lost(device);
	intake->ended = true;
	intake->seen_ns = 0;
}

static void take(struct device *device, const struct pokeys_command *command)
{
	struct intake *intake = &device->intake;
	struct axis_images images;

	if (command->session != intake->session) {
		begin_session(device, command);
		return;
	}
	if (command->heartbeat != intake->heartbeat) {
		take_ages(device, command);
		images = new_images(device, command);
		intake->heartbeat = command->heartbeat;
		intake->t_ns = command->t_ns;
		take_read(intake, command);
		intake->seen_ns = device->now_ns;
		intake->ended = false;
		take_values(device, command, &images);
	} else if (command->flags & POKEYS_COMMAND_ENDS) {
		leave(device); /* what the image says has had its cycle */
	}
	if (heartbeat_fresh(device))
		one_shot_intake(device, command);
}

static void judge_freshness(struct device *device)
{
	struct intake *intake = &device->intake;
	const uint64_t age = device->now_ns - intake->seen_ns;
	const bool fresh = heartbeat_fresh(device);
	const int64_t age_us = intake->seen_ns ? (int64_t)(age / 1000) : -1;

	if (fresh != intake->fresh)
		device_say(device, EVENT_COMMANDER,
			   fresh || intake->ended ? EVENT_NOTICE : EVENT_WARNING, fresh, age_us,
			   intake->ended);
	intake->fresh = fresh;
}

void intake_forget(struct device *device)
{
	device->intake.seen_ns = 0;
	device->intake.fresh = false;
}

void intake_cycle(struct device *device, const struct pokeys_command *command, int refused)
{
	if (readable(device, command, refused))
		take(device, command);
	judge_freshness(device);
}
