/* SPDX-License-Identifier: MIT */
/*
 * Slots of the motion buffer and the multi-part fill: protocol sections
 * 3.24.5 and 1.6.
 *
 * A fill is the one request which must never be sent twice by mistake: it
 * carries relative steps and no sequence number. The stride of a slot is the
 * axis count of the request, whatever the receiver believes about axes, and
 * neither slot count nor axis count of a packet is believed: every access is
 * checked against the bytes which are really there.
 *
 * A slot is sign and magnitude, not two's complement: -1 is 0x81.
 */

#include "wire/pulse.h"

static size_t width_bytes(uint8_t width)
{
	return width == WIRE_SLOTS_16BIT ? 2 : 1;
}

unsigned int wire_slots_max(uint8_t width, uint8_t axes, size_t len)
{
	if (!axes || axes > WIRE_AXES)
		return 0;
	return (unsigned int)(len / (width_bytes(width) * axes));
}

bool wire_fill_fits(uint8_t width, uint8_t slots, uint8_t axes, size_t len)
{
	return slots <= wire_slots_max(width, axes, len);
}

static unsigned int magnitude(int steps, unsigned int max)
{
	const unsigned int n = steps < 0 ? 0u - (unsigned int)steps : (unsigned int)steps;

	return n > max ? max : n;
}

uint8_t wire_slot8(int steps)
{
	return (uint8_t)(magnitude(steps, WIRE_SLOT8_MAX) | (steps < 0 ? 0x80u : 0u));
}

uint16_t wire_slot16(int steps)
{
	return (uint16_t)(magnitude(steps, WIRE_SLOT16_MAX) | (steps < 0 ? 0x8000u : 0u));
}

int wire_slot8_steps(uint8_t code)
{
	const int n = code & WIRE_SLOT8_MAX;

	return code & 0x80 ? -n : n;
}

int wire_slot16_steps(uint16_t code)
{
	const int n = code & WIRE_SLOT16_MAX;

	return code & 0x8000 ? -n : n;
}

/* Byte offset of one value, or len when it is not there. */
static size_t slot_at(size_t len, uint8_t width, uint8_t axes, unsigned int slot, unsigned int axis)
{
	if (axis >= axes || slot >= wire_slots_max(width, axes, len))
		return len;
	return ((size_t)slot * axes + axis) * width_bytes(width);
}

int wire_slot_get(const uint8_t *data, size_t len, uint8_t width, uint8_t axes, unsigned int slot,
		  unsigned int axis)
{
	const size_t at = slot_at(len, width, axes, slot, axis);

	if (at >= len)
		return 0;
	if (width_bytes(width) == 2)
		return wire_slot16_steps(wire_get_u16(data + at));
	return wire_slot8_steps(data[at]);
}

bool wire_slot_set(uint8_t *data, size_t len, uint8_t width, uint8_t axes, unsigned int slot,
		   unsigned int axis, int steps)
{
	const size_t at = slot_at(len, width, axes, slot, axis);

	if (at >= len)
		return false;
	if (width_bytes(width) == 2)
		wire_put_u16(data + at, wire_slot16(steps));
	else
		data[at] = wire_slot8(steps);
	return true;
}

static uint8_t part_mark(unsigned int i)
{
	uint8_t mark = (uint8_t)i;

	if (i == 0)
		mark |= WIRE_MULTI_START;
	if (i == WIRE_MULTI_PARTS - 1)
		mark |= WIRE_MULTI_STOP;
	return mark;
}

static bool multi_fits(const struct wire_multi *fill, size_t len)
{
	if (fill->width != WIRE_SLOTS_8BIT && fill->width != WIRE_SLOTS_16BIT)
		return false;
	return len <= WIRE_MULTI_DATA && wire_fill_fits(fill->width, fill->slots, fill->axes, len);
}

bool wire_multi_build(uint8_t p[WIRE_MULTI_BYTES], uint8_t id, const struct wire_multi *fill,
		      const uint8_t *data, size_t len)
{
	struct wire_pulse_fill_part_req part = {
		.width = fill->width,
		.slots = fill->slots,
		.axes = fill->axes,
	};

	if (!multi_fits(fill, len))
		return false;
	for (unsigned int i = 0; i < WIRE_MULTI_PARTS; i++) {
		const size_t from = (size_t)i * WIRE_FILL_DATA;
		const size_t left = len > from ? len - from : 0;

		part.part = part_mark(i);
		memset(part.data, 0, sizeof(part.data));
		if (left)
			memcpy(part.data, data + from,
			       left < WIRE_FILL_DATA ? left : WIRE_FILL_DATA);
		wire_pulse_fill_part_encode_req(p + i * WIRE_PK, &part);
		wire_finish(p + i * WIRE_PK, (uint8_t)(id + i));
	}
	return true;
}

static bool part_belongs(const uint8_t *p, unsigned int i, uint8_t first_id)
{
	return wire_check_request(p, WIRE_PK) == WIRE_OK &&
	       wire_packet_op(p) == wire_op(WIRE_OP_PULSE_FILL_PART)->id &&
	       p[WIRE_AT_P1] == part_mark(i) && wire_packet_id(p) == (uint8_t)(first_id + i);
}

bool wire_multi_parse(const uint8_t p[WIRE_MULTI_BYTES], struct wire_multi *fill,
		      uint8_t data[WIRE_MULTI_DATA])
{
	struct wire_pulse_fill_part_req part;
	const uint8_t first_id = wire_packet_id(p);

	for (unsigned int i = 0; i < WIRE_MULTI_PARTS; i++) {
		if (!part_belongs(p + i * WIRE_PK, i, first_id))
			return false;
		wire_pulse_fill_part_decode_req(p + i * WIRE_PK, &part);
		/* only the first part's numbers count (section 1.6) */
		if (i == 0)
			*fill = (struct wire_multi){ part.width, part.slots, part.axes };
		memcpy(data + (size_t)i * WIRE_FILL_DATA, part.data, WIRE_FILL_DATA);
	}
	return multi_fits(fill, WIRE_MULTI_DATA);
}
