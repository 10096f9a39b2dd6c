/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Slots into a fill: one packet of bytes, one of 16-bit steps, or eight packets
 * in one datagram (protocol sections 1.6 and 3.24.5).
 *
 * A byte holds 127 pulses, and no generator that is known makes more in a slot
 * than 125, so 16 bits go only where a step needs them. One packet holds seven
 * slots of eight axes, three if they are wide. Where more than that wait, because
 * motion begins far ahead of a slow wire or a fill was lost, eight parts go
 * instead: a fill is answered before the next one leaves, so what counts is how
 * much one carries.
 *
 * Whether a device takes parts is not documented. So it is tried: one that
 * takes none of their slots, or does not answer the first two, gets none again.
 * Losing such a fill costs what losing any other costs.
 *
 * The mailbox knows the last part alone, whose id the answer has; the others are
 * made when it leaves.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define PARTS_TRIES 2

/* The room that steps of this width have in one packet, or in all parts; slots. */
static uint32_t room(const struct device *device, uint8_t width, bool parts)
{
	const uint32_t slots = wire_slots_max(width, device->image.engine.axes_enabled,
					      parts ? WIRE_MULTI_DATA : WIRE_FILL_DATA);

	return slots < BUFFER_FILL_MOST ? slots : BUFFER_FILL_MOST;
}

static bool too_wide(const struct buffer *buffer)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (buffer->step[i] > WIRE_SLOT8_MAX || buffer->step[i] < -WIRE_SLOT8_MAX)
			return true;
	}
	return false;
}

/* The path of the slots that go now, behind its end, and the fill that carries them. */
static void take_slots(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	const bool may = buffer->parts != BUFFER_PARTS_NOT;
	uint8_t width = WIRE_SLOTS_8BIT;
	uint32_t most = room(device, width, may), k;

	for (k = 0; k < most && k < buffer->pending; k++) {
		buffer_path_step(device, buffer->end + k,
				 &buffer->slot[(buffer->first + k) % BUFFER_PENDING],
				 &buffer->slot[(buffer->first + k - 1) % BUFFER_PENDING]);
		if (width == WIRE_SLOTS_8BIT && too_wide(buffer)) {
			width = WIRE_SLOTS_16BIT;
			most = room(device, width, may);
		}
	}
	k = k < most ? k : most;
	buffer->in_parts = k > room(device, width, false);
	buffer->fill = (struct wire_multi){
		.width = width,
		.slots = (uint8_t)k,
		.axes = device->image.engine.axes_enabled,
	};
}

static void encode(struct buffer *buffer)
{
	const struct wire_multi *fill = &buffer->fill;

	memset(buffer->data, 0, sizeof(buffer->data));
	for (unsigned int n = 0; n < fill->slots; n++) {
		const int32_t *from = buffer->path[(buffer->end + n) % BUFFER_PATH].position;
		const int32_t *to = buffer->path[(buffer->end + n + 1) % BUFFER_PATH].position;

		for (unsigned int i = 0; i < fill->axes; i++) {
			buffer->step[i] = to[i] - from[i];
			wire_slot_set(buffer->data, sizeof(buffer->data), fill->width, fill->axes,
				      n, i, buffer->step[i]);
		}
	}
}

bool buffer_in_parts(const struct device *device, const uint8_t packet[WIRE_PK],
		     uint8_t all[WIRE_MULTI_BYTES])
{
	const struct buffer *buffer = &device->buffer;

	return packet[WIRE_AT_OP] == wire_op(WIRE_OP_PULSE_FILL_PART)->id &&
	       wire_multi_build(all, (uint8_t)(wire_packet_id(packet) - (WIRE_MULTI_PARTS - 1)),
				&buffer->fill, buffer->data, sizeof(buffer->data));
}

void buffer_take_back(struct device *device, uint32_t n)
{
	struct buffer *buffer = &device->buffer;
	const struct buffer_slot *end = &buffer->path[buffer->end % BUFFER_PATH];
	const struct buffer_slot *before = &buffer->path[(buffer->end - 1) % BUFFER_PATH];

	buffer->first = (buffer->first + BUFFER_PENDING - n) % BUFFER_PENDING;
	buffer->pending += n;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		buffer->step[i] = buffer->end ? end->position[i] - before->position[i] : 0;
}

void buffer_fill_failed(struct device *device)
{
	struct buffer *buffer = &device->buffer;

	if (buffer->in_parts && buffer->parts == BUFFER_PARTS_UNKNOWN &&
	    ++buffer->parts_lost >= PARTS_TRIES)
		buffer->parts = BUFFER_PARTS_NOT;
}

/* The device has told how many of them it took: the others wait again. */
static void take_answer(struct device *device, uint8_t accepted)
{
	struct buffer *buffer = &device->buffer;

	if (buffer->in_parts && buffer->parts == BUFFER_PARTS_UNKNOWN)
		buffer->parts = accepted ? BUFFER_PARTS_TAKEN : BUFFER_PARTS_NOT;
	if (!buffer->synced)
		return;
	if (accepted > buffer->sent) {
		buffer_lose_sync(device);
		return;
	}
	buffer_path_accept(device, accepted);
	if (accepted < buffer->sent)
		buffer_take_back(device, (uint32_t)buffer->sent - accepted);
	buffer->sent = accepted;
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct buffer *buffer = &device->buffer;
	struct wire_pulse_fill_rep reply;

	(void)context;
	device->now_ns = now_ns;
	if (!buffer->open)
		return; /* it was not sent: what is known of the one before holds */
	buffer->open = false;
	buffer->ended_ns = now_ns;
	buffer->doubt = buffer->synced && !answered(entry);
	if (!answered(entry))
		return;
	buffer_learn_silence(device);
	wire_pulse_fill8_decode_rep(entry->response_buffer, &reply);
	buffer_judge_dry(device, reply.status.position);
	take_answer(device, reply.accepted);
	if (decode_engine(device, &reply.status, entry->timestamp_first_sent,
			  entry->timestamp_received))
		buffer_status(device, &reply.status, now_ns);
	meter_reply(device, entry, true);
}

void buffer_fill_known(struct device *device, bool executed)
{
	if (request_cancel(device, ended, NULL))
		buffer_resolve(device, executed);
}

static void sent(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	const uint64_t now = device->now_ns;
	const uint32_t k = buffer->fill.slots;
	/* its clock may be slower than ours, for as long as the motion has lasted */
	const uint64_t played_ns = now + buffer_level(device) * BUFFER_SLOT_NS;

	if (!buffer_level(device))
		buffer_pace(device, buffer->end, now);
	buffer->open = true;
	buffer->sent_ns = now;
	buffer->sent = (uint8_t)k;
	buffer->first = (buffer->first + k) % BUFFER_PENDING;
	buffer->pending -= k;
	buffer->empty_ns = (buffer->empty_ns > played_ns ? buffer->empty_ns : played_ns) +
			   k * BUFFER_SLOT_NS;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (buffer_axes(device) >> i & 1) {
			device->image.engine.axis[i].reference =
				buffer->path[(buffer->end + k) % BUFFER_PATH].position[i];
			device->image.engine.axis[i].t_reference_ns = now;
		}
	}
}

/*
 * A device that does not tell its level shows that it lacks a fill only when it has played all of
 * before, and nothing can be filled until then. So there is no reason to give up earlier: the reply
 * may only be late.
 */
static uint64_t patience(const struct device *device)
{
	const uint64_t usual = buffer_patience(device);
	const uint64_t played = buffer_level(device) * BUFFER_SLOT_NS;

	return device->buffer.tells_free || usual > played ? usual : played;
}

static bool send_packet(struct device *device)
{
	const struct buffer *buffer = &device->buffer;
	struct wire_pulse_fill_req fill = {
		.slots = buffer->fill.slots,
		.axes = buffer->fill.axes,
	};

	memcpy(fill.data, buffer->data, sizeof(fill.data));
	return request_send_patiently(device,
				      buffer->fill.width == WIRE_SLOTS_16BIT ?
					      WIRE_OP_PULSE_FILL16 :
					      WIRE_OP_PULSE_FILL8,
				      &fill, ended, patience(device));
}

static bool send_parts(struct device *device)
{
	const struct buffer *buffer = &device->buffer;
	struct wire_pulse_fill_part_req last = {
		.part = (WIRE_MULTI_PARTS - 1) | WIRE_MULTI_STOP,
		.width = buffer->fill.width,
		.slots = buffer->fill.slots,
		.axes = buffer->fill.axes,
	};

	memcpy(last.data, &buffer->data[WIRE_MULTI_DATA - WIRE_FILL_DATA], sizeof(last.data));
	return request_send_patiently(device, WIRE_OP_PULSE_FILL_PART, &last, ended,
				      patience(device));
}

bool buffer_fill(struct device *device)
{
	struct buffer *buffer = &device->buffer;
	int32_t before[POKEYS_AXES];

	memcpy(before, buffer->step, sizeof(before));
	take_slots(device);
	encode(buffer);
	if (!buffer->fill.slots || !(buffer->in_parts ? send_parts(device) : send_packet(device))) {
		memcpy(buffer->step, before, sizeof(before));
		return false;
	}
	sent(device);
	return true;
}
