/* SPDX-License-Identifier: MIT */
/*
 * One packer and one unpacker for every layout.
 *
 * Members are copied with memcpy and bytes are put together by hand: the
 * packet has 16 and 32-bit values at odd offsets (PWM duty at @9, back-off at
 * @45, mpg divider at @49), so a struct laid over the packet would be wrong
 * on the offsets, and an access through a cast pointer undefined.
 *
 * Counts are limited in both directions: a packet off the network must not
 * make its reader walk past an array, and a request must not claim more data
 * than it carries.
 */

#include "wire/layout.h"

uint8_t wire_kind_size(uint8_t kind)
{
	switch ((enum wire_kind)kind) {
	case WIRE_KIND_U8:
	case WIRE_KIND_TEXT:
		return 1;
	case WIRE_KIND_U16:
	case WIRE_KIND_U16BE:
		return 2;
	case WIRE_KIND_U32:
	case WIRE_KIND_F32:
		return 4;
	case WIRE_KIND_U56:
		return 7;
	}
	return 0;
}

/* Bytes an element takes in the struct: as in the packet but for bitmaps. */
static size_t member_size(uint8_t kind)
{
	return kind == WIRE_KIND_U56 ? sizeof(uint64_t) : wire_kind_size(kind);
}

static void put_wide(uint8_t kind, uint8_t *p, const uint8_t *member)
{
	uint16_t u16;
	uint32_t u32;
	uint64_t u64;

	switch ((enum wire_kind)kind) {
	case WIRE_KIND_U8:
	case WIRE_KIND_TEXT:
		break; /* copied as a whole by the caller */
	case WIRE_KIND_U16:
		memcpy(&u16, member, sizeof(u16));
		wire_put_u16(p, u16);
		break;
	case WIRE_KIND_U16BE:
		memcpy(&u16, member, sizeof(u16));
		wire_put_u16be(p, u16);
		break;
	case WIRE_KIND_U32:
	case WIRE_KIND_F32:
		memcpy(&u32, member, sizeof(u32));
		wire_put_u32(p, u32);
		break;
	case WIRE_KIND_U56:
		memcpy(&u64, member, sizeof(u64));
		wire_put_u56(p, u64);
		break;
	}
}

static void get_wide(uint8_t kind, const uint8_t *p, uint8_t *member)
{
	uint16_t u16;
	uint32_t u32;
	uint64_t u64;

	switch ((enum wire_kind)kind) {
	case WIRE_KIND_U8:
	case WIRE_KIND_TEXT:
		break; /* copied as a whole by the caller */
	case WIRE_KIND_U16:
	case WIRE_KIND_U16BE:
		u16 = kind == WIRE_KIND_U16 ? wire_get_u16(p) : wire_get_u16be(p);
		memcpy(member, &u16, sizeof(u16));
		break;
	case WIRE_KIND_U32:
	case WIRE_KIND_F32:
		u32 = wire_get_u32(p);
		memcpy(member, &u32, sizeof(u32));
		break;
	case WIRE_KIND_U56:
		u64 = wire_get_u56(p);
		memcpy(member, &u64, sizeof(u64));
		break;
	}
}

static uint8_t limit(uint8_t value, uint8_t max)
{
	return max && value > max ? max : value;
}

static void pack_field(const struct wire_field *f, uint8_t *p, const uint8_t *value)
{
	const size_t wide = wire_kind_size(f->kind);
	const size_t size = member_size(f->kind);

	for (unsigned int rep = 0; rep < f->reps; rep++) {
		uint8_t *to = p + f->at + rep * f->stride;
		const uint8_t *from = value + f->offset + rep * f->step;

		if (wide == 1)
			memcpy(to, from, f->count);
		for (unsigned int i = 0; wide > 1 && i < f->count; i++)
			put_wide(f->kind, to + i * wide, from + i * size);
		if (f->max)
			*to = limit(*to, f->max);
	}
}

static void unpack_field(const struct wire_field *f, const uint8_t *p, uint8_t *value)
{
	const size_t wide = wire_kind_size(f->kind);
	const size_t size = member_size(f->kind);

	for (unsigned int rep = 0; rep < f->reps; rep++) {
		const uint8_t *from = p + f->at + rep * f->stride;
		uint8_t *to = value + f->offset + rep * f->step;

		if (wide == 1)
			memcpy(to, from, f->count);
		for (unsigned int i = 0; wide > 1 && i < f->count; i++)
			get_wide(f->kind, from + i * wide, to + i * size);
		if (f->max)
			*to = limit(*to, f->max);
	}
}

void wire_pack(const struct wire_layout *layout, uint8_t p[WIRE_PK], const void *value)
{
	for (unsigned int i = 0; i < layout->count; i++)
		pack_field(&layout->fields[i], p, value);
}

void wire_unpack(const struct wire_layout *layout, const uint8_t p[WIRE_PK], void *value)
{
	if (!value)
		return;
	memset(value, 0, layout->size);
	for (unsigned int i = 0; i < layout->count; i++)
		unpack_field(&layout->fields[i], p, value);
}
