/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Buffered mode (protocol sections 3.24.5 and 5.3): one slot a millisecond,
 * filled ahead of time, closed by the positions that are read back.
 *
 * The trap: a fill has no number. Sent twice it moves twice, and one without
 * an answer was executed or not. So there is one fill at a time, it is never
 * sent again, and nothing is filled behind one in doubt until a status tells:
 *
 *  - A device whose status counts free slots says at once whether they are in. A status that
 *    was sent after the fill says so before the fill's reply can be given up.
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
 * takes to be found out and mended (4 and three times that; 7 on a quiet wire), or more if
 * the device was silent for longer within the last minute or so. If it is silent for longer
 * than ever while the axes move, slots are made faster until the lead is long enough.
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
#define DRIFT_SLOTS (2 * BUFFER_USUAL)	/* ... and for no more than these */

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
	return (device->buffer.cleared && !threading_dirty(device)) || !buffer_axes(device);
}

void buffer_lose_sync(struct device *device)
{
	struct buffer *buffer = &device->buffer;

	if (buffer->synced)
		device->image.engine.buffer_resyncs++;
	if (buffer->synced && device->motion.phase == MOTION_ON)
		buffer_abandon(device);
	threading_spoil(device, POKEYS_TASK_FAILED);
	if (buffer->doubt)
		buffer_fill_failed(device);
	buffer->synced = buffer->doubt = buffer->busy = false;
	buffer->pending = 0;
	buffer->still_ns = device->now_ns;
}

uint32_t buffer_level(const struct device *device)
{
	return (uint32_t)(device->buffer.end - device->buffer.seen);
}

/* An answer that has not come by then is not awaited. */
uint64_t buffer_patience(const struct device *device)
{
	const struct pokeys_statistics *measured = &device->mailbox.statistics;
	const uint64_t usual = measured->rtt_smoothed_ns + 4 * measured->rtt_variation_ns;

	if (usual < BUFFER_SLOT_NS)
		return BUFFER_SLOT_NS;
	return usual > PATIENCE_MOST ? PATIENCE_MOST : usual;
}

uint64_t buffer_disorder(const struct device *device)
{
	const uint64_t seen = device->buffer.disorder_ns;
	/* with one status at a time, none overtakes another */
	const uint64_t spread = device->pipeline.depth > 1 ?
					0 :
					2 * device->mailbox.statistics.rtt_variation_ns;

	return (seen > spread ? seen : spread) + BUFFER_SLOT_NS;
}

/* After such a time a lost fill is found out, ns. */
static uint64_t found_out(const struct device *device)
{
	const struct pokeys_statistics *measured = &device->mailbox.statistics;
	const uint64_t patience = buffer_patience(device);
	const uint64_t cycle = device->config.period_ns * device->config.fast_divider;
	const uint64_t status = buffer_disorder(device) + measured->rtt_smoothed_ns +
				measured->rtt_variation_ns +
				(cycle > BUFFER_SLOT_NS ? cycle - BUFFER_SLOT_NS : 0);

	return device->buffer.tells_free && status < patience ? status : patience;
}

static uint64_t slots_of(uint64_t ns)
{
	return (ns + BUFFER_SLOT_NS - 1) / BUFFER_SLOT_NS;
}

/* Slots that the device has to be ahead, for lost fills and the usual silences to do no harm. */
uint8_t buffer_lead(const struct device *device)
{
	const uint64_t lost = slots_of(found_out(device));
	const uint64_t silent = slots_of(device->buffer.silence_ns);
	const uint64_t slots = LEAD_LEAST + lost + (silent > 2 * lost ? silent : 2 * lost);

	return (uint8_t)(slots < LEAD_MOST ? slots : LEAD_MOST);
}

static void push(struct device *device, const struct buffer_slot *slot)
{
	struct buffer *buffer = &device->buffer;

	if (buffer->pending >= (threading_stretched(device) ? BUFFER_STRETCHED : BUFFER_USUAL)) {
		threading_spoil(device, POKEYS_TASK_BEHIND);
		return; /* absolute positions: the next one says it all */
	}
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
		const int64_t way = moving_axis_wish(device, i)->position - before;

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
					moving_axis_wish(device, i)->position != end->position[i]))
			return false;
	}
	return !buffer->pending && !buffer->open;
}

static bool moves(const struct device *device)
{
	const struct buffer *buffer = &device->buffer;
	bool moving = false;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		moving = moving || buffer->step[i];
	return moving;
}

bool buffer_settled(const struct device *device)
{
	return device->buffer.synced && !device->buffer.doubt && !moves(device) &&
	       buffer_arrived(device);
}

bool buffer_arrived(const struct device *device)
{
	const struct buffer *buffer = &device->buffer;
	const int32_t *end = buffer->path[buffer->end % BUFFER_PATH].position;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (device->motion.driven & buffer_axes(device) & 1u << i &&
		    moving_axis_wish(device, i)->position != end[i])
			return false;
	}
	for (uint32_t n = 0; n < buffer->pending; n++) {
		if (!buffer_path_is(device,
				    buffer->slot[(buffer->first + n) % BUFFER_PENDING].position,
				    buffer->end))
			return false;
	}
	return true;
}

/* Slots that nothing was heard about since the last reply. */
static uint32_t unheard(const struct device *device)
{
	const uint64_t slots = (device->now_ns - device->buffer.came_ns) / BUFFER_SLOT_NS;

	return slots < BUFFER_PATH ? (uint32_t)slots : BUFFER_PATH;
}

/* Slots of the motion before that the device has still to execute. */
static uint32_t left_for_sure(const struct device *device)
{
	/* by the clock, it is known to about a slot */
	const uint32_t doubt = device->buffer.tells_free ? 0 : 2;
	const uint32_t level = buffer_level(device), since = unheard(device) + 1 + doubt;

	return level > since ? level - since : 0;
}

static void begin_motion(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	const struct buffer_slot here = buffer->path[buffer->end % BUFFER_PATH];

	buffer->busy = true;
	buffer->lead = buffer_lead(device);
	buffer->led_ns = device->tick_ns;
	buffer->rest = buffer->end + (buffer->open ? buffer->sent : 0) + buffer->pending;
	for (uint32_t i = left_for_sure(device); i < buffer->lead && !threading_paces(device); i++)
		push(device, &here);
	buffer->made_ns = buffer->tick_ns;
	buffer->begun = buffer->end + (buffer->open ? buffer->sent : 0) + buffer->pending;
}

/* Slots that stand still need not be sent. */
static void come_to_rest(struct device *device)
{
	device->buffer.busy = false;
	device->buffer.pending = 0;
}

/* A slot's time by our clock, so that the device's buffer stays as full as it is to be. */
static uint64_t slot_time(const struct device *device)
{
	int64_t more = (int64_t)buffer_level(device) + device->buffer.pending - device->buffer.lead;

	if (threading_paces(device))
		more = 0;
	if (more > DRIFT_SLOTS)
		more = DRIFT_SLOTS;
	return (uint64_t)((int64_t)BUFFER_SLOT_NS + more * (int64_t)(BUFFER_SLOT_NS / DRIFT_PART));
}

/* During a motion. It falls slowly, because a wire that was bad may be so again. */
static void adapt_lead(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	const uint8_t lead = buffer_lead(device);

	if (lead == buffer->lead ||
	    (lead < buffer->lead && device->tick_ns - buffer->led_ns < SECOND))
		return;
	buffer->lead = lead > buffer->lead ? lead : (uint8_t)(buffer->lead - 1);
	buffer->led_ns = device->tick_ns;
}

static void make_slots(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	struct buffer_slot slot;
	uint64_t time;

	if (!threading_paces(device))
		adapt_lead(device);
	time = slot_time(device);
	while (buffer->made_ns + time <= device->tick_ns) {
		buffer->made_ns += time;
		wish_at(device, buffer->made_ns, &slot);
		if (!buffer_stands(device, &slot))
			push(device, &slot);
	}
}

static void remember_wish(struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		device->buffer.wish_before[i] = moving_axis_wish(device, i)->position;
	device->buffer.tick_ns = device->tick_ns;
}

void buffer_update(struct device *device)
{
	struct buffer *buffer = &device->buffer;

	if (!buffer_axes(device))
		return;
	if (device->motion.phase == MOTION_OFF || device->motion.phase == MOTION_TASK)
		buffer->cleared = false;
	if (device->motion.phase != MOTION_ON && buffer->synced) {
		buffer_leave(device);
		buffer_lose_sync(device);
	}
	if (buffer->synced && is_on(device)) {
		const bool rest = threading_stretched(device) ? buffer_settled(device) :
								at_rest(device);

		if (!buffer->busy && !rest)
			begin_motion(device);
		else if (rest)
			come_to_rest(device);
		if (buffer->busy)
			make_slots(device);
	}
	remember_wish(device);
	buffer_tell_error(device);
	device->image.engine.buffer_level = (uint8_t)buffer_level(device);
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
	       !buffer->doubt && buffer_level(device) < LEAD_MOST && !threading_holds(device) &&
	       buffer_fill_worth_it(device);
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
		return device->buffer.clear_open = request_send(device, WIRE_OP_PULSE_BUFFER_CLEAR,
								NULL, clear_ended, NULL, NULL);
	return fill_due(device) && buffer_fill(device);
}
