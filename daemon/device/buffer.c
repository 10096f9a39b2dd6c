/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Buffered mode (protocol sections 3.24.5 and 5.3): one slot a millisecond,
 * filled ahead of time, closed by the positions that are read back.
 *
 * The trap: a fill has no number. Sent twice it moves twice, and one without
 * an answer was executed or not. So there is one fill at a time, it is never
 * sent again, and nothing is filled behind one in doubt until a status tells:
 *
 *  - A device whose status counts free slots says at once whether they are in.
 *  - Otherwise they are in when the axes are seen beyond the slots of before.
 *  - Otherwise, and whenever a position is on no slot of the path (a copy was
 *    executed, a fill came late), nothing is filled until the axes have stood
 *    still and the buffer must be empty. Then the path begins anew where they
 *    are, and the next slots carry what is missing.
 *
 * The truth is always the device's position, the wish an absolute one: no loss
 * can add a step or take one away, it can only make the axes late.
 *
 * Motion from rest begins with slots that stand still, as many as a lost fill
 * takes to be found out and mended (4 and three deadlines; 7 on a quiet wire).
 * Slots are made by our clock and taken by the device's. What is in the buffer
 * says how the two drift apart; slots are made a little faster or slower then,
 * each with the position wished at its own time.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define LEAD_LEAST 4
#define LEAD_MOST 64
#define PATIENCE_MOST (20 * MS)
#define DRIFT_PART 1000		/* of a slot's time, for each slot too many */

uint8_t buffer_axes(const struct device *device)
{
	uint8_t axes = 0;

	for (unsigned int i = 0; i < device->image.engine.axes_enabled && i < POKEYS_AXES; i++) {
		if (device->image.engine.axis[i].mode == POKEYS_AXIS_BUFFERED)
			axes |= (uint8_t)(1u << i);
	}
	return axes;
}

static bool is_on(const struct device *device)
{
	return device->motion.phase == MOTION_ON && !device->motion.verify &&
	       device->image.engine.state == WIRE_ENGINE_RUNNING;
}

bool buffer_ready(const struct device *device)
{
	return device->buffer.cleared || !buffer_axes(device);
}

void buffer_lose_sync(struct device *device)
{
	struct buffer *buffer = &device->buffer;

	if (buffer->synced)
		device->image.engine.buffer_resyncs++;
	if (buffer->doubt)
		buffer_fill_failed(device);
	buffer->synced = buffer->doubt = buffer->busy = false;
	buffer->pending = 0;
	buffer->still_ns = device->now_ns;
}

static uint32_t level(const struct device *device)
{
	return device->buffer.end - device->buffer.seen;
}

/* An answer that has not come by then is not awaited. */
uint64_t buffer_patience(const struct device *device)
{
	const struct pokeys_statistics *measured = &device->mailbox.statistics;
	const uint64_t usual = measured->rtt_smoothed_ns + 4 * measured->rtt_variation_ns;

	return usual < BUFFER_SLOT_NS ? BUFFER_SLOT_NS : usual > PATIENCE_MOST ? PATIENCE_MOST : usual;
}

/* Slots that the device has to be ahead, for a lost fill to do no harm. */
static uint8_t lead(const struct device *device)
{
	const uint64_t slots = LEAD_LEAST + 3 * ((buffer_patience(device) + BUFFER_SLOT_NS - 1) / BUFFER_SLOT_NS);

	return (uint8_t)(slots < LEAD_MOST ? slots : LEAD_MOST);
}

static void push(struct buffer *buffer, const struct buffer_slot *slot)
{
	if (buffer->pending == BUFFER_PENDING)
		return;		/* absolute positions: the next one says it all */
	buffer->slot[(buffer->first + buffer->pending++) % BUFFER_PENDING] = *slot;
}

/* Where the axes are wished to be at a time between the last two commands. */
static void wish_at(const struct device *device, uint64_t t_ns, struct buffer_slot *out)
{
	const struct buffer *buffer = &device->buffer;
	const int64_t whole = (int64_t)(device->tick_ns - buffer->tick_ns);
	const int64_t part = (int64_t)(t_ns - buffer->tick_ns);

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const int64_t before = buffer->wish_before[i];
		const int64_t way = device->intake.axis[i].position - before;

		out->position[i] = (int32_t)(before + (whole > 0 ? way * part / whole : way));
	}
}

/* All that is wished has been sent, and nothing moves. */
static bool at_rest(const struct device *device)
{
	const struct buffer *buffer = &device->buffer;
	const struct buffer_slot *end = &buffer->path[buffer->end % BUFFER_PATH];
	const uint8_t axes = buffer_axes(device);

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (!(axes >> i & 1))
			continue;
		if (buffer->step[i] || (device->motion.driven >> i & 1 &&
					device->intake.axis[i].position != end->position[i]))
			return false;
	}
	return !buffer->pending && !buffer->open;
}

static void begin_motion(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	const struct buffer_slot here = buffer->path[buffer->end % BUFFER_PATH];

	buffer->busy = true;
	buffer->lead = lead(device);
	for (unsigned int i = 0; i < buffer->lead; i++)
		push(buffer, &here);
	buffer->made_ns = buffer->tick_ns;
}

/* A slot's time by our clock, so that the device's buffer stays as full as it is to be. */
static uint64_t slot_time(const struct device *device)
{
	const int64_t more = (int64_t)level(device) + device->buffer.pending -
			     device->buffer.lead;

	return (uint64_t)((int64_t)BUFFER_SLOT_NS + more * (int64_t)(BUFFER_SLOT_NS / DRIFT_PART));
}

static void make_slots(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	const uint64_t time = slot_time(device);
	struct buffer_slot slot;

	while (buffer->made_ns + time <= device->tick_ns) {
		buffer->made_ns += time;
		wish_at(device, buffer->made_ns, &slot);
		push(buffer, &slot);
	}
}

static void remember_wish(struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		device->buffer.wish_before[i] = device->intake.axis[i].position;
	device->buffer.tick_ns = device->tick_ns;
}

void buffer_update(struct device *device)
{
	struct buffer *buffer = &device->buffer;

	if (!buffer_axes(device))
		return;
	if (device->motion.phase == MOTION_OFF || device->motion.phase == MOTION_TASK)
		buffer->cleared = false;
	if (device->motion.phase != MOTION_ON && buffer->synced)
		buffer_lose_sync(device);
	if (buffer->synced && is_on(device)) {
		if (!buffer->busy && !at_rest(device))
			begin_motion(device);
		else if (buffer->busy && at_rest(device))
			buffer->busy = false;
		if (buffer->busy)
			make_slots(device);
	}
	remember_wish(device);
	device->image.engine.buffer_level = (uint8_t)level(device);
}

static bool clear_due(const struct device *device)
{
	return device->motion.phase == MOTION_HOLD && !device->buffer.cleared &&
	       !device->buffer.clear_open && !device->buffer.open && buffer_axes(device);
}

static bool fill_due(const struct device *device)
{
	const struct buffer *buffer = &device->buffer;

	return is_on(device) && buffer->synced && buffer->pending && !buffer->open &&
	       !buffer->doubt && level(device) < LEAD_MOST;
}

static void clear_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	(void)context;
	device->now_ns = now_ns;
	device->buffer.clear_open = false;
	device->buffer.cleared = answered(entry) && device->motion.phase == MOTION_HOLD;
}

bool buffer_send(struct device *device)
{
	if (clear_due(device))
		return device->buffer.clear_open =
			request_send(device, WIRE_OP_PULSE_BUFFER_CLEAR, NULL, clear_ended, NULL,
				     NULL);
	return fill_due(device) && buffer_fill(device);
}
