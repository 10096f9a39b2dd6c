/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The motion buffer while the spindle plays it (threading.c).
 *
 * No clock says then how far the device is: not empty_ns, and not the millisecond.
 * What it says itself does: its positions, which may lie within a slot, and, where it
 * tells them, its free slots. So much is queued as there is room for.
 *
 * A fill without an answer is in if the positions are that far along the path, or the
 * slots left say so. Fills of a slot or two would leave that open, because a slot under
 * way may count or not: they wait for more unless it is urgent, or what the spindle has
 * to find there is not there yet: until then nothing is under way. What cannot be found
 * out shows when the device has come to the end of the slots of before.
 */

#include "daemon/device/internal.h"

#define STILL_NS (20 * MS)
#define WORTH_IT 4		/* slots */
#define URGENT 8

void buffer_stretch(struct device *device)
{
	device->buffer.busy = false;
	device->buffer.pending = 0;
}

void buffer_unstretch(struct device *device)
{
	struct buffer *buffer = &device->buffer;

	buffer->empty_ns = device->now_ns + buffer_level(device) * BUFFER_SLOT_NS;
	buffer->lead = buffer_lead(device);
}

uint16_t buffer_behind(const struct device *device)
{
	return (uint16_t)(buffer_level(device) + device->buffer.pending);
}

bool buffer_caught_up(const struct device *device)
{
	return !device->buffer.doubt && buffer_behind(device) <= device->buffer.lead;
}

bool buffer_loaded(const struct device *device)
{
	const uint32_t level = buffer_level(device);

	return level >= buffer_lead(device) || (level && buffer_settled(device));
}

/* Of the axes that the spindle leads; where others are meanwhile is not played. */
static bool same_place(const struct device *device, const struct buffer_slot *a,
		       const struct buffer_slot *b)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (device->image.engine.task_axes >> i & 1 && a->position[i] != b->position[i])
			return false;
	}
	return true;
}

/*
 * However long it stands, the spindle need not turn for that. The command may stand where
 * the axes have still to come to, which takes them slots; a fill of those is enough to wait.
 */
bool buffer_stands(const struct device *device, const struct buffer_slot *slot)
{
	const struct buffer *buffer = &device->buffer;
	const uint32_t last = buffer->first + buffer->pending - 1;

	return threading_paces(device) && buffer->pending >= 2 &&
	       same_place(device, slot, &buffer->slot[last % BUFFER_PENDING]) &&
	       same_place(device, slot, &buffer->slot[(last - 1) % BUFFER_PENDING]) &&
	       (buffer->pending >= BUFFER_FILL_MOST ||
		buffer_path_reaches(device, slot, buffer->pending - 1));
}

bool buffer_fill_worth_it(const struct device *device)
{
	return !threading_stretched(device) || device->buffer.pending >= WORTH_IT ||
	       buffer_level(device) < URGENT ||
	       !(threading_active(device) || buffer_loaded(device));
}

/* So many slots before `end`; the slot under way is out of the buffer, or still in it. */
static bool is_about(const struct device *device, const int32_t position[POKEYS_AXES], uint64_t end,
		     uint32_t left)
{
	uint64_t at;

	return left <= end && buffer_path_find(device, position, end - left, end - left + 1, &at);
}

/* By the slots left. While nothing is played each of them counts. */
static void judge_by_level(struct device *device, const int32_t position[POKEYS_AXES],
			   uint32_t left)
{
	struct buffer *buffer = &device->buffer;
	const uint64_t with = buffer->end + buffer->sent;
	bool in, out;

	if (!threading_active(device)) {
		in = left == with - buffer->seen;
		out = left == buffer->end - buffer->seen;
	} else if (left) {
		in = is_about(device, position, with, left);
		out = is_about(device, position, buffer->end, left);
		if (!in && !out)
			buffer_lose_sync(device);
	} else {
		in = buffer_path_is(device, position, with);
		out = !in && buffer_path_is(device, position, buffer->end);
	}
	if (in != out)
		buffer_resolve(device, in);
}

/* The axes go beyond the slots of before, or stand at their end although it is played. */
static void judge_by_position(struct device *device, const int32_t position[POKEYS_AXES])
{
	struct buffer *buffer = &device->buffer;
	uint64_t at;

	if (!buffer_path_find(device, position, buffer->seen, buffer->end, &at)) {
		if (buffer_path_find(device, position, buffer->end + 1, buffer->end + buffer->sent,
				     &at))
			buffer_resolve(device, true);
		return;
	}
	if (threading_active(device) && buffer_path_is(device, position, buffer->end) &&
	    device->now_ns - buffer->still_ns >= STILL_NS)
		threading_spoil(device, POKEYS_TASK_STARVED);
}

void buffer_judge_stretched(struct device *device, const int32_t position[POKEYS_AXES],
			    uint32_t left)
{
	if (device->buffer.tells_free)
		judge_by_level(device, position, left);
	else
		judge_by_position(device, position);
}

void buffer_judge_dry(struct device *device, const int32_t position[POKEYS_AXES])
{
	const struct buffer *buffer = &device->buffer;

	if (!threading_paces(device) || !threading_active(device) || buffer->doubt ||
	    !buffer->end || !buffer_path_is(device, position, buffer->end) ||
	    buffer_path_is(device, position, buffer->end - 1) || buffer_arrived(device))
		return;
	device->image.engine.buffer_underruns++;
	threading_spoil(device, POKEYS_TASK_STARVED);
}
