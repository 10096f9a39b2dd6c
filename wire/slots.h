/* SPDX-License-Identifier: MIT */
#ifndef WIRE_SLOTS_H
#define WIRE_SLOTS_H

/*
 * Slots of the motion buffer and the multi-part fill: protocol sections
 * 3.24.5 and 1.6. Pure, bounded, realtime safe.
 */

#include "wire/packet.h"

#define WIRE_AXES 8
#define WIRE_FILL_DATA 56	/* bytes of slots in one packet */
#define WIRE_SLOTS_8BIT 0xFF	/* width of a slot's values: one byte */
#define WIRE_SLOTS_16BIT 0xFE	/* two */

#define WIRE_MULTI_PARTS 8
#define WIRE_MULTI_DATA (WIRE_MULTI_PARTS * WIRE_FILL_DATA)
#define WIRE_MULTI_BYTES (WIRE_MULTI_PARTS * WIRE_PK)
#define WIRE_MULTI_START 0x08	/* in the part byte, @2 */
#define WIRE_MULTI_STOP 0x10
#define WIRE_MULTI_INDEX 0x07	/* mask */

/*
 * One multi-part fill as one 512-byte datagram. data holds len bytes of
 * slots, at most WIRE_MULTI_DATA (the rest is sent as zeros); the parts get
 * the ids id .. id + 7, mod 256. The one reply carries the id of the last
 * part, wire_multi_reply_id(). Returns false, packet untouched, when slots
 * and axes ask for more bytes than len or the packet hold.
 */
struct wire_multi {
	uint8_t width; /* WIRE_SLOTS_8BIT or WIRE_SLOTS_16BIT */
	uint8_t slots;
	uint8_t axes;
};
bool wire_multi_build(uint8_t p[WIRE_MULTI_BYTES], uint8_t id, const struct wire_multi *fill,
		      const uint8_t *data, size_t len);

static inline uint8_t wire_multi_reply_id(uint8_t id)
{
	return (uint8_t)(id + WIRE_MULTI_PARTS - 1);
}

/*
 * The other direction: eight good parts in order become fill and data.
 * Returns false when header, checksum, operation, order, start or stop mark,
 * or ids do not belong together, or when slots and axes exceed the data.
 */
bool wire_multi_parse(const uint8_t p[WIRE_MULTI_BYTES], struct wire_multi *fill,
		      uint8_t data[WIRE_MULTI_DATA]);

/* Slots which fit into len bytes: width is WIRE_SLOTS_*; 0 when axes is 0 or above 8. */
unsigned int wire_slots_max(uint8_t width, uint8_t axes, size_t len);

/* Whether slots of axes values fit into len bytes. */
bool wire_fill_fits(uint8_t width, uint8_t slots, uint8_t axes, size_t len);

/* Steps one slot can carry: 127 or 32767; the device allows max_khz of them. */
#define WIRE_SLOT8_MAX 127
#define WIRE_SLOT16_MAX 32767

/* Codes steps (sign and magnitude); clamped to what the slot can carry. */
uint8_t wire_slot8(int steps);
uint16_t wire_slot16(int steps);
int wire_slot8_steps(uint8_t code);
int wire_slot16_steps(uint16_t code);

/* Steps of one axis in one slot, of len bytes of slots; 0 outside of them. */
int wire_slot_get(const uint8_t *data, size_t len, uint8_t width, uint8_t axes, unsigned int slot,
		  unsigned int axis);

/* Sets it; false, nothing changed, outside of the data. */
bool wire_slot_set(uint8_t *data, size_t len, uint8_t width, uint8_t axes, unsigned int slot,
		   unsigned int axis, int steps);

#endif
