/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Axes of the pulse engine on a path. Their commander has switched the machine on and has enabled
 * them; only their positions come from the path. They go to the device on the same way as a
 * commander's positions, in position mode and in buffered mode.
 *
 * In position mode the device plans its own ramps to each position, and follows from behind. So the
 * path leaves it some of its speed and acceleration to catch up with. In buffered mode the device
 * does what it is told, within the same limits.
 *
 * A stop of the engine, for whatever reason, ends the permission to move: then no axis is enabled,
 * and the path ends.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define SPEED_PART 0.95		/* of what the device permits, for a path */
#define ACCELERATION_PART 0.8
#define RESTS_NS (100 * MS)	/* a commander that is there to stay */
#define LASTS_NS (1 * SECOND)	/* ... although it is not exact */
#define NEAR 1			/* pulses */
#define CATCH_UP_S 0.1

static const struct device_axis_config *config_of(const struct device *device, unsigned int axis)
{
	return &device->config.axis[axis];
}

void moving_axis_init(struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct pokeys_axis *image = &device->image.engine.axis[i];

		image->pulses_per_unit = config_of(device, i)->pulses_per_unit;
		memcpy(image->name, config_of(device, i)->name, sizeof(image->name));
	}
}

bool moving_axis_any(const struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (config_of(device, i)->pulses_per_unit != 0)
			return true;
	return false;
}

/* The device has one limit for each direction of a change of speed, the path has one for both. */
static struct path_axis_config limits_of(const struct device *device, unsigned int axis)
{
	const struct wire_axis_config *set =
		&device->configure.setting[SETTING_AXIS + axis].value.axis.config;
	const double unit = fabs(config_of(device, axis)->pulses_per_unit);
	const double rate = fmin((double)set->max_accel, (double)set->max_decel) * 1e6;
	const uint8_t mode = device->image.engine.axis[axis].mode;

	if (!(unit > 0) || !motion_drivable(device, axis) || mode == POKEYS_AXIS_VELOCITY)
		return (struct path_axis_config){ .speed = 0 };
	return (struct path_axis_config){
		.speed = SPEED_PART * (double)set->max_speed * 1e3 / unit,
		.acceleration = ACCELERATION_PART * rate / unit,
	};
}

void moving_axis_limit(struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct path_axis_config limits = limits_of(device, i);

		path_limit(&device->moving.path, MOVING_AXIS + i, &limits);
	}
}

bool moving_axis_is_on(const struct device *device, unsigned int axis)
{
	return device->safe.permitted && device->motion.driven >> axis & 1;
}

double moving_axis_place(const struct device *device, unsigned int axis)
{
	return device->intake.axis[axis].position / config_of(device, axis)->pulses_per_unit;
}

/* Its commander does not move it on, and it is where it is commanded to be. */
static bool is_at_rest(const struct device *device, unsigned int axis)
{
	const struct axis_wish *wish = &device->intake.axis[axis];

	return wish->position == device->image.engine.axis[axis].position &&
	       !axis_wish_moves_on(wish, device->now_ns);
}

bool moving_axis_buffered(const struct device *device)
{
	return device->moving.path.axes >> MOVING_AXIS & buffer_axes(device);
}

/*
 * With axes in buffered mode, until it is known where their steps begin. Without, as long as the
 * device's data is stale: if the path went on while the device is silent, axes and motors would be
 * far behind afterwards, and each of them would catch up by the shortest way.
 */
bool moving_axis_waits(const struct device *device)
{
	return moving_axis_buffered(device) ? !device->buffer.synced : device->meter.stale;
}

/* Where a member will be, or is held; `at` if it is none. Units. */
static double ends_at(const struct device *device, unsigned int member, double at)
{
	if (moving_moves(device, member))
		return path_end(&device->moving.path, member);
	return moving_has(device, member) ? device->moving.place[member] : at;
}

/* From where it will be before. */
static bool is_beyond(const struct device *device, unsigned int axis, double pulses)
{
	const struct pokeys_axis *image = &device->image.engine.axis[axis];
	const double unit = config_of(device, axis)->pulses_per_unit;
	const double from = ends_at(device, MOVING_AXIS + axis, image->position / unit) * unit;

	return intake_beyond_soft_limits(device, axis, round(from), round(pulses));
}

static bool is_in_range(const struct device *device, unsigned int axis, double pulses)
{
	return fabs(pulses) <= intake_furthest(device->image.engine.axis[axis].mode);
}

enum pokeys_moves_refusal moving_axis_judge(const struct device *device, unsigned int axis,
					    double pulses)
{
	if (config_of(device, axis)->pulses_per_unit == 0 || !is_in_range(device, axis, pulses))
		return POKEYS_MOVES_ODD;
	if (!task_idle(device) || device->task.parked >> axis & 1)
		return POKEYS_MOVES_HOMING;
	if (!moving_axis_is_on(device, axis))
		return POKEYS_MOVES_OFF;
	if (!moving_has(device, MOVING_AXIS + axis) && !is_at_rest(device, axis))
		return POKEYS_MOVES_COMMANDED;
	return is_beyond(device, axis, pulses) ? POKEYS_MOVES_LIMIT : POKEYS_MOVES_TAKEN;
}

void moving_axis_join(struct device *device, unsigned int axis)
{
	device->moving.wish[axis] = device->intake.axis[axis];
	device->moving.wish[axis].velocity = 0;
	axis_wish_rest(&device->moving.wish[axis]);
}

/*
 * In position mode it follows from behind. What it is behind when it has only little way to go in a
 * move, it would keep for all of it.
 */
static double speed_of(const struct device *device, unsigned int axis, double speed)
{
	const struct pokeys_axis *image = &device->image.engine.axis[axis];
	const double behind = (double)device->moving.wish[axis].position - image->position;

	return fmax(speed, fabs(behind) / CATCH_UP_S);
}

void moving_axis_follow(struct device *device, unsigned int axis)
{
	const double unit = config_of(device, axis)->pulses_per_unit;
	struct axis_wish *wish = &device->moving.wish[axis];
	const int32_t position = (int32_t)lround(device->moving.place[MOVING_AXIS + axis] * unit);

	const double speed = device->moving.velocity[MOVING_AXIS + axis] * unit;

	axis_wish_position(wish, position, device->now_ns);
	wish->velocity = (float)speed_of(device, axis, fabs(speed));
	wish->forward = (float)speed;
	reference_lead(device, axis, wish);
}

void moving_axis_halt(struct device *device, unsigned int axis)
{
	struct axis_wish *wish = &device->moving.wish[axis];
	struct moving *moving = &device->moving;

	if (device->image.engine.axis[axis].mode == POKEYS_AXIS_POSITION &&
	    moving_axis_is_on(device, axis)) {
		wish->position = reference_ahead(device, axis, wish);
		moving->place[MOVING_AXIS + axis] = wish->position /
						    config_of(device, axis)->pulses_per_unit;
	}
	moving->velocity[MOVING_AXIS + axis] = 0;
}

/*
 * A command from before the path is somewhere else, or it would move the axis by no more than
 * NEAR. In that case, the commander gets time to read the position again: a busy one may have
 * read it last when the axis was a pulse before its end.
 */
bool moving_axis_met(const struct device *device, unsigned int axis)
{
	const struct axis_wish *asked = &device->intake.axis[axis];
	const int64_t apart = (int64_t)asked->position - device->moving.wish[axis].position;
	const uint64_t rests_ns = apart ? LASTS_NS : RESTS_NS;

	return device->now_ns - device->moving.released_ns >= rests_ns &&
	       device->now_ns - asked->moved_ns >= rests_ns && asked->good && apart >= -NEAR &&
	       apart <= NEAR;
}

const struct axis_wish *moving_axis_wish(const struct device *device, unsigned int axis)
{
	return moving_has(device, MOVING_AXIS + axis) ? &device->moving.wish[axis] :
							&device->intake.axis[axis];
}

int32_t moving_axis_asked(const struct device *device, unsigned int axis)
{
	return moving_moves(device, MOVING_AXIS + axis) ? moving_axis_wish(device, axis)->position :
							  device->intake.axis[axis].position;
}
