/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a status says about the motion buffer: what has been executed, whether
 * the fill in doubt is in, whether the axes are still on the path at all.
 *
 * A status that was asked for before the newest fill had ended may be from
 * before or after it, and says only how far the axes are. Statuses may overtake
 * each other: an older position on the path says nothing new and nothing bad.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define STILL_NS (20 * MS)
#define DRY_NS (3 * BUFFER_SLOT_NS)
#define DISORDER_FADES 65536	/* statuses: a minute */
#define SILENCE_FADES_NS (60 * SECOND)
#define SILENCE_MOST_NS (50 * MS)	/* a longer one outlasts any lead */
#define SILENCE_LOST_NS (200 * MS)	/* the link is lost, or was */
#define OLDER 64	/* slots behind the one seen last that a late status may show */

void buffer_learn_silence(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	const uint64_t silent_ns = device->now_ns - buffer->came_ns;

	buffer->came_ns = device->now_ns;
	if (silent_ns > SILENCE_LOST_NS || device->motion.phase != MOTION_ON)
		return;
	buffer->silence_ns -= buffer->silence_ns * silent_ns / SILENCE_FADES_NS;
	if (silent_ns > buffer->silence_ns)
		buffer->silence_ns = silent_ns < SILENCE_MOST_NS ? silent_ns : SILENCE_MOST_NS;
}

void buffer_learn_order(struct device *device, uint64_t asked_ns)
{
	struct buffer *buffer = &device->buffer;

	buffer_learn_silence(device);
	if (asked_ns < buffer->asked_ns) {
		if (buffer->asked_ns - asked_ns > buffer->disorder_ns)
			buffer->disorder_ns = buffer->asked_ns - asked_ns;
		return;
	}
	buffer->asked_ns = asked_ns;
	buffer->disorder_ns -= buffer->disorder_ns / DISORDER_FADES;
}

/* Does the device count free slots? They are all free at least once, at the beginning. */
static void learn_slots(struct buffer *buffer, uint8_t slots)
{
	if (slots > buffer->slots_high)
		buffer->slots_high = slots;
	buffer->tells_free = buffer->tells_free || slots < buffer->slots_high;
}

/* Others may move as they like: what is in the buffer is none of theirs. */
static void watch_rest(struct device *device, const int32_t position[POKEYS_AXES])
{
	struct buffer *buffer = &device->buffer;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (!(buffer_axes(device) >> i & 1) || buffer->still[i] == position[i])
			continue;
		buffer->still[i] = position[i];
		buffer->still_ns = device->now_ns;
	}
}

static uint32_t used(const struct buffer *buffer, const struct wire_pulse_status_rep *status)
{
	return buffer->slots_high - status->buffer_slots;
}

/* The axes stand, and nothing can be left that moves them. */
static void try_sync(struct device *device, const struct wire_pulse_status_rep *status)
{
	struct buffer *buffer = &device->buffer;

	if (buffer->open || device->now_ns < buffer->empty_ns ||
	    device->now_ns - buffer->still_ns < STILL_NS ||
	    (buffer->tells_free && used(buffer, status)))
		return;
	buffer_path_begin(device, status->position);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (buffer_axes(device) >> i & 1)
			device->image.engine.axis[i].reference = status->position[i];
	}
	buffer->synced = true;
	buffer->pending = 0;
}

void buffer_resolve(struct device *device, bool executed)
{
	struct buffer *buffer = &device->buffer;

	buffer->doubt = false;
	if (executed) {
		buffer_path_accept(device, buffer->sent);
		if (buffer->in_parts)
			buffer->parts = BUFFER_PARTS_TAKEN;
		return;
	}
	buffer_fill_failed(device);
	buffer_take_back(device, buffer->sent);
}

static bool on_path(const struct device *device, const int32_t position[POKEYS_AXES], uint64_t end,
		    uint32_t left)
{
	if (left > end || end - left + OLDER < device->buffer.seen)
		return false;
	if (!threading_stretched(device))
		return buffer_path_is(device, position, end - left);
	/* the slot under way is out of the buffer, or still in it */
	return buffer_path_within(device, position, end - left) ||
	       (left && buffer_path_within(device, position, end - left + 1));
}

/* Do level and positions match a device that has the newest fill (*in), or lacks it (*out)? */
static void look_for_fill(const struct device *device, const struct wire_pulse_status_rep *status,
			  bool *in, bool *out)
{
	const struct buffer *buffer = &device->buffer;
	const uint32_t left = used(buffer, status);

	*in = on_path(device, status->position, buffer->end + buffer->sent, left);
	*out = on_path(device, status->position, buffer->end, left);
}

static void judge_by_level(struct device *device, const struct wire_pulse_status_rep *status)
{
	const struct buffer *buffer = &device->buffer;
	bool in, out;

	look_for_fill(device, status, &in, &out);
	if (in != out)
		buffer_resolve(device, in);
	else if (!in || device->now_ns >= buffer->empty_ns)
		buffer_lose_sync(device);
}

/*
 * The fill is under way. A status that was sent so much later that it cannot have overtaken the
 * fill shows whether its slots are in the device: earlier than the fill's reply can be given up.
 */
static void judge_under_way(struct device *device, const struct wire_pulse_status_rep *status)
{
	bool in, out;

	look_for_fill(device, status, &in, &out);
	if (in != out)
		buffer_fill_known(device, in);
}

/* The axes are beyond the slots of before: those of the newest fill are being played. */
static bool is_played(const struct device *device, const int32_t position[POKEYS_AXES])
{
	const struct buffer *buffer = &device->buffer;
	uint64_t at;

	return !buffer_path_find(device, position, buffer->seen, buffer->end, &at) &&
	       buffer_path_find(device, position, buffer->end + 1, buffer->end + buffer->sent, &at);
}

static void judge_by_position(struct device *device, const struct wire_pulse_status_rep *status)
{
	struct buffer *buffer = &device->buffer;
	uint64_t at;

	if (buffer_path_find(device, status->position, buffer->seen, buffer->end, &at)) {
		if (device->now_ns >= buffer->empty_ns) {
			buffer_resolve(device, false); /* seen by now, or it has no motion */
			buffer_lose_sync(device);
		}
		return;
	}
	if (is_played(device, status->position))
		buffer_resolve(device, true);
}

/* Does the path's slot move an axis? */
static bool moves_at(const struct buffer *buffer, uint64_t at)
{
	return at && memcmp(&buffer->path[at % BUFFER_PATH], &buffer->path[(at - 1) % BUFFER_PATH],
			    sizeof(buffer->path[0]));
}

static void ran_dry(struct device *device, uint64_t at)
{
	if (device->buffer.dry == at)
		return;
	device->buffer.dry = at;
	device->image.engine.buffer_underruns++;
}

/*
 * All that is known to be in the device was played, and its last slot moved: the axes were stopped
 * without a ramp. A fill under way may have come in time, but not if they stand.
 */
static void judge_dry(struct device *device)
{
	const struct buffer *buffer = &device->buffer;

	if (!threading_stretched(device) && buffer->seen == buffer->end &&
	    moves_at(buffer, buffer->end) &&
	    ((!buffer->open && !buffer->doubt) || device->now_ns - buffer->still_ns >= DRY_NS))
		ran_dry(device, buffer->end);
}

static uint64_t last_slot(const struct buffer *buffer)
{
	return buffer->end + (buffer->open || buffer->doubt ? buffer->sent : 0);
}

/* The axes stop after `end` or, if a fill under way came, after `last`. */
static void stop_there(struct device *device, uint64_t last)
{
	const struct buffer *buffer = &device->buffer;

	if (moves_at(buffer, buffer->end) || moves_at(buffer, last))
		ran_dry(device, buffer->end);
}

void buffer_abandon(struct device *device)
{
	if (!threading_stretched(device))
		stop_there(device, last_slot(&device->buffer));
}

void buffer_leave(struct device *device)
{
	struct buffer *buffer = &device->buffer;

	buffer->leaving = buffer->busy && !threading_stretched(device);
	buffer->last = last_slot(buffer);
}

void buffer_begin(struct device *device)
{
	struct buffer *buffer = &device->buffer;

	if (buffer->synced)
		buffer_leave(device);
	/* the connection was lost for longer than what was left could last */
	if (buffer->leaving)
		stop_there(device, buffer->last);
	memset(buffer, 0, sizeof(*buffer));
}

/* Was it stopped in time, or after it had played all? A fill that was under way is in, or not. */
static void judge_leaving(struct device *device, const struct wire_pulse_status_rep *status)
{
	struct buffer *buffer = &device->buffer;

	if (!buffer->leaving)
		return;
	if (moves_at(buffer, buffer->end) && buffer_path_is(device, status->position, buffer->end))
		ran_dry(device, buffer->end);
	else if (moves_at(buffer, buffer->last) &&
		 buffer_path_is(device, status->position, buffer->last))
		ran_dry(device, buffer->last);
	else if (status->engine_state == WIRE_ENGINE_RUNNING)
		return;
	buffer->leaving = false;
}

void buffer_pace(struct device *device, uint64_t at, uint64_t t_ns)
{
	device->buffer.pace = at;
	device->buffer.pace_ns = t_ns;
}

/* How many slots the device has executed at a time, by the clock. */
static uint64_t paced(const struct buffer *buffer, uint64_t t_ns)
{
	return t_ns < buffer->pace_ns ? buffer->pace :
					buffer->pace + (t_ns - buffer->pace_ns) / BUFFER_SLOT_NS;
}

/*
 * A slow axis is at the same position after many slots, from `first` on. Which of them it is says
 * the clock: otherwise, the level would be overestimated by them, and slots would be made later
 * than they are played. Where the two disagree, the position is right: it was read after it was
 * asked for, and not later than now.
 */
static uint64_t by_the_clock(struct device *device, const int32_t position[POKEYS_AXES],
			     uint64_t first, uint64_t end, uint64_t asked_ns)
{
	const struct buffer *buffer = &device->buffer;
	const uint64_t expected = paced(buffer, device->now_ns);
	uint64_t at = first;

	while (at < end && at < expected && buffer_path_is(device, position, at + 1))
		at++;
	if (at > expected)
		buffer_pace(device, at, device->now_ns);
	else if (at < paced(buffer, asked_ns))
		buffer_pace(device, at, asked_ns);
	return at;
}

/* How far it is; false if it is nowhere on the path. */
static bool follow(struct device *device, const struct wire_pulse_status_rep *status, bool newest,
		   uint64_t asked_ns)
{
	struct buffer *buffer = &device->buffer;
	const uint64_t last = last_slot(buffer);
	const uint64_t before = buffer->seen;
	uint64_t at;

	if (newest && buffer->tells_free) {
		if (!on_path(device, status->position, buffer->end, used(buffer, status)))
			return false;
		at = buffer->end - used(buffer, status);
	} else if ((threading_stretched(device) ? !buffer->tells_free :
						  device->now_ns >= buffer->empty_ns) &&
		   buffer_path_is(device, status->position, buffer->end)) {
		at = buffer->end;
	} else if (!buffer_path_find(device, status->position, before, last, &at)) {
		return buffer_path_find(device, status->position,
					before > OLDER ? before - OLDER : 0, before, &at);
	} else if (!buffer->tells_free && !threading_stretched(device)) {
		at = by_the_clock(device, status->position, at, last, asked_ns);
	}
	if (at > buffer->end)
		at = buffer->end;
	if (at > before)
		buffer->seen = at;
	judge_dry(device);
	return true;
}

/*
 * All that was sent should have been played, and the axes stand somewhere else on the path: some of
 * it is not in the device, though it was accepted. A device that tells how much is left says so.
 */
void buffer_watch(struct device *device, const struct wire_pulse_status_rep *status,
		  uint64_t asked_ns)
{
	const struct buffer *buffer = &device->buffer;

	if (buffer->synced && !buffer->doubt && !buffer->open && !buffer->tells_free &&
	    status->engine_state == WIRE_ENGINE_RUNNING && !threading_paces(device) &&
	    asked_ns >= buffer->ended_ns && asked_ns >= buffer->empty_ns + STILL_NS &&
	    asked_ns >= buffer->still_ns + STILL_NS &&
	    !buffer_path_is(device, status->position, buffer->end))
		buffer_lose_sync(device);
}

static void judge_status(struct device *device, const struct wire_pulse_status_rep *status,
			 uint64_t asked_ns)
{
	struct buffer *buffer = &device->buffer;
	const bool newest = asked_ns >= buffer->ended_ns && !buffer->open;

	learn_slots(buffer, status->buffer_slots);
	watch_rest(device, status->position);
	if (device->motion.phase != MOTION_ON || status->engine_state != WIRE_ENGINE_RUNNING) {
		judge_leaving(device, status);
		return;
	}
	if (!buffer->synced) {
		if (newest)
			try_sync(device, status);
		return;
	}
	if (buffer->open && buffer->tells_free && !threading_stretched(device) &&
	    asked_ns >= buffer->sent_ns + buffer_disorder(device))
		judge_under_way(device, status);
	else if (buffer->open && !buffer->tells_free && !threading_stretched(device) &&
		 asked_ns >= buffer->sent_ns && is_played(device, status->position))
		buffer_fill_known(device, true);
	if (buffer->doubt && newest) {
		if (threading_paces(device))
			buffer_judge_stretched(device, status->position, used(buffer, status));
		else if (buffer->tells_free)
			judge_by_level(device, status);
		else
			judge_by_position(device, status);
	}
	if (buffer->synced && !follow(device, status, newest && !buffer->doubt, asked_ns))
		buffer_lose_sync(device);
	if (newest)
		buffer_judge_dry(device, status->position);
}

void buffer_status(struct device *device, const struct wire_pulse_status_rep *status,
		   uint64_t asked_ns)
{
	if (!buffer_axes(device))
		return;
	judge_status(device, status, asked_ns);
	buffer_tell_error(device);
}
