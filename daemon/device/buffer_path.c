/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Where the axes are after each slot that was sent.
 *
 * Slots are differences of absolute positions, so no rounding is ever added
 * up: what one slot could not carry is in the next one, and 10^8 periods drift
 * by nothing. A position that the device reports is looked up here; which slot
 * it belongs to says what has been executed.
 *
 * An axis takes no step that is longer than its highest speed, and its speed
 * rises by no more than its acceleration: after a gap it catches up as a motor
 * can, and brakes in time to go on with what it has caught up with. A command
 * that stops at once is followed all the same, for the axis never passes it. One
 * that is not driven any more slows down as well.
 */

#include <math.h>
#include <stdlib.h>
#include "daemon/device/internal.h"

#define STEP_MAX 32767		/* 15 bits, protocol section 3.24.5 */
#define LATE_SLOTS 16		/* so much older than the lead a position may be; then error */

static struct buffer_slot *slot_at(struct device *device, uint64_t at)
{
	return &device->buffer.path[at % BUFFER_PATH];
}

void buffer_path_begin(struct device *device, const int32_t position[POKEYS_AXES])
{
	struct buffer *buffer = &device->buffer;

	buffer->seen = buffer->end = buffer->dry = 0;
	buffer->leaving = false;
	buffer_pace(device, 0, device->now_ns);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		slot_at(device, 0)->position[i] = position[i];
		buffer->wished[0].position[i] = position[i];
		buffer->step[i] = 0;
	}
}

/* Most pulses in a slot. The device carries no more than its frequency, whatever the axis may. */
static int32_t step_max(const struct device *device, const struct pokeys_axis *axis)
{
	const double most = ceil((double)axis->max_speed / 1e3);
	const int32_t khz = device->image.capability.axis_khz;
	const int32_t carried = khz ? khz : STEP_MAX;

	return most > 0 && most < carried ? (int32_t)most : carried;
}

/* Most pulses by which a slot may differ from the one before. */
static int32_t change_max(const struct pokeys_axis *axis)
{
	const double most = ceil((double)axis->max_acceleration / 1e6) + 1;

	return most > 1 && most < STEP_MAX ? (int32_t)most : STEP_MAX;
}

static int32_t limited(int64_t value, int32_t most)
{
	return (int32_t)(value > most ? most : value < -most ? -most : value);
}

static int32_t slower(int32_t step, int32_t change)
{
	if (abs(step) <= change)
		return 0;
	return step > 0 ? step - change : step + change;
}

/* Pulses/ms^2 by which it can slow down, without what rounding needs. */
static double slowing(const struct device *device, unsigned int i)
{
	const struct wire_axis_config *set =
		&device->configure.setting[SETTING_AXIS + i].value.axis.config;
	const double rate = fmin((double)set->max_accel, (double)set->max_decel);

	return rate > 0 && rate < STEP_MAX ? rate : change_max(&device->image.engine.axis[i]);
}

/*
 * The longest step from which it can slow down to what it is behind, though that slows down as well
 * as it can. With steps of s, s - c, ... it goes s * s / 2c + s / 2 until it stands, the other one
 * as much from its own step, and the difference is what it is behind.
 */
static double longest(double behind, double pace, double c)
{
	if (pace < 0)
		return pace + sqrt(c * c / 4 + 2 * c * behind) - c / 2;
	return fmax(sqrt((pace + c / 2) * (pace + c / 2) + 2 * c * behind) - c / 2, pace + 1);
}

/* ... or a little less than the last one: that its command stood for a moment is no reason. */
static int64_t braking(const struct device *device, unsigned int i, int64_t distance, int64_t pace)
{
	const int64_t sign = distance < 0 ? -1 : 1;
	const int64_t behind = sign * (distance - pace);
	const int64_t before = sign * device->buffer.step[i];
	double most;

	if (behind <= 0)
		return distance;
	most = longest((double)behind, (double)(sign * pace), slowing(device, i));
	most = fmax(most, (double)(before - change_max(&device->image.engine.axis[i])));
	return most >= (double)(sign * distance) ? distance : most > 0 ? sign * (int64_t)most : 0;
}

/* `pace`: how far goes what it follows in this slot. */
static int32_t step_of(const struct device *device, unsigned int i, int64_t distance, int64_t pace)
{
	const struct pokeys_axis *axis = &device->image.engine.axis[i];
	const int32_t before = device->buffer.step[i];
	const int32_t change = change_max(axis);
	int32_t most = step_max(device, axis);

	if (!(device->motion.driven >> i & 1))
		return slower(before, change);
	if (most > abs(before) + change)
		most = abs(before) + change;
	/* nor does it turn faster than from rest */
	if (before * distance < 0 && most > change)
		most = change;
	/* what the spindle plays has no time of its own */
	if (!threading_paces(device))
		distance = braking(device, i, distance, pace);
	return limited(distance, most);
}

void buffer_path_step(struct device *device, uint64_t after, const struct buffer_slot *to,
		      const struct buffer_slot *to_before)
{
	const struct buffer_slot *from = slot_at(device, after);
	struct buffer_slot *next = slot_at(device, after + 1);

	device->buffer.wished[(after + 1) % BUFFER_PATH] = *to;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const int64_t distance = (int64_t)to->position[i] - from->position[i];

		device->buffer.step[i] = buffer_axes(device) >> i & 1 ?
						 step_of(device, i, distance,
							 (int64_t)to->position[i] -
								 to_before->position[i]) :
						 0;
		next->position[i] = from->position[i] + device->buffer.step[i];
	}
}

static uint64_t last_sent(const struct buffer *buffer)
{
	return buffer->end + (buffer->open || buffer->doubt ? buffer->sent : 0);
}

/* The command that a slot was made from. The slot is pending, or was sent not long ago. */
static const struct buffer_slot *wished(const struct buffer *buffer, uint64_t slot)
{
	const uint64_t last = last_sent(buffer);

	return slot <= last ? &buffer->wished[slot % BUFFER_PATH] :
			      &buffer->slot[(buffer->first + (uint32_t)(slot - last) - 1) %
					    BUFFER_PENDING];
}

/*
 * The slot that the reported position is compared with: the last one that the device is known to
 * have executed. If that is more than LATE_SLOTS older than the lead, a newer slot is used, and the
 * rest counts as error. The slots that motion begins with only fill the buffer; they are skipped.
 */
static uint64_t slot_then(const struct buffer *buffer, uint64_t made)
{
	const uint64_t most = (uint64_t)buffer->lead + LATE_SLOTS;
	uint64_t then = made > buffer->seen + most ? made - most : buffer->seen;

	if (buffer->busy && then >= buffer->rest && then <= buffer->begun)
		then = buffer->begun + 1;
	return then < made ? then : made;
}

void buffer_tell_error(struct device *device)
{
	const struct buffer *buffer = &device->buffer;
	const uint64_t made = last_sent(buffer) + buffer->pending;
	const bool late = buffer->synced && !threading_stretched(device);
	const uint64_t then = late ? slot_then(buffer, made) : made;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct pokeys_axis *axis = &device->image.engine.axis[i];
		const bool is_driven = axis->mode == POKEYS_AXIS_BUFFERED && axis->enabled;

		axis->delayed = !is_driven ? 0 :
					     (int32_t)((uint32_t)wished(buffer, made)->position[i] -
						       (uint32_t)wished(buffer, then)->position[i]);
		if (is_driven)
			axis->following_error = (int32_t)((uint32_t)moving_axis_asked(device, i) -
							  (uint32_t)axis->delayed -
							  (uint32_t)axis->position);
	}
}

bool buffer_path_reaches(const struct device *device, const struct buffer_slot *to, uint32_t n)
{
	const struct buffer *buffer = &device->buffer;
	const struct buffer_slot *from = &buffer->path[last_sent(buffer) % BUFFER_PATH];

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis *axis = &device->image.engine.axis[i];
		const int64_t most = (int64_t)n * step_max(device, axis);
		const int64_t distance = (int64_t)to->position[i] - from->position[i];

		if (device->image.engine.task_axes >> i & 1 &&
		    (distance > most || distance < -most))
			return false;
	}
	return true;
}

void buffer_path_accept(struct device *device, uint32_t k)
{
	device->buffer.end += k;
}

bool buffer_path_is(const struct device *device, const int32_t position[POKEYS_AXES], uint64_t at)
{
	const struct buffer_slot *slot = &device->buffer.path[at % BUFFER_PATH];
	const uint8_t axes = buffer_axes(device);

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (axes >> i & 1 && position[i] != slot->position[i])
			return false;
	}
	return true;
}

bool buffer_path_within(const struct device *device, const int32_t position[POKEYS_AXES],
			uint64_t at)
{
	const struct buffer_slot *to = &device->buffer.path[at % BUFFER_PATH];
	const struct buffer_slot *from = &device->buffer.path[(at ? at - 1 : 0) % BUFFER_PATH];
	const uint8_t axes = buffer_axes(device);

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const int32_t a = from->position[i], b = to->position[i];

		if (axes >> i & 1 &&
		    (position[i] < (a < b ? a : b) || position[i] > (a < b ? b : a)))
			return false;
	}
	return true;
}

bool buffer_path_find(const struct device *device, const int32_t position[POKEYS_AXES],
		      uint64_t first, uint64_t last, uint64_t *at)
{
	const bool stretched = threading_stretched(device);

	for (uint64_t n = first; n <= last; n++) {
		*at = n;
		if (stretched ? buffer_path_within(device, position, n) :
				buffer_path_is(device, position, n))
			return true;
	}
	return false;
}
