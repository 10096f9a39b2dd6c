/* SPDX-License-Identifier: MIT */
#ifndef WIRE_LAYOUT_H
#define WIRE_LAYOUT_H

/*
 * The description of one direction of one operation: where each member of a
 * struct stands in the packet. Encode and decode of both sides walk the same
 * table, so they cannot disagree.
 *
 * The kind of a field follows from the type of the member, its count from the
 * member's size; a field that would not fit into the packet does not compile.
 */

#include "wire/packet.h"

enum wire_kind {
	WIRE_KIND_U8,  /* also int8_t */
	WIRE_KIND_U16, /* also int16_t */
	WIRE_KIND_U16BE,
	WIRE_KIND_U32, /* also int32_t */
	WIRE_KIND_F32,
	WIRE_KIND_U56,  /* uint64_t bitmap of seven bytes */
	WIRE_KIND_TEXT, /* char[n + 1] for n bytes; decode adds the NUL */
};

struct wire_field {
	uint8_t at;      /* first byte in the packet */
	uint8_t kind;    /* enum wire_kind */
	uint8_t count;   /* consecutive elements */
	uint8_t max;     /* upper limit of a u8 count field, 0: none */
	uint8_t reps;    /* blocks of count elements */
	uint8_t stride;  /* packet bytes from block to block */
	uint16_t offset; /* in the struct */
	uint16_t step;   /* struct bytes from block to block */
};

struct wire_layout {
	const struct wire_field *fields;
	uint16_t count;
	uint16_t size; /* of the struct */
};

/*
 * Packs the fields into p, leaving bytes no field covers alone. Unpacks them
 * into value, which is cleared first. Bounded, realtime safe.
 */
void wire_pack(const struct wire_layout *layout, uint8_t p[WIRE_PK], const void *value);
void wire_unpack(const struct wire_layout *layout, const uint8_t p[WIRE_PK], void *value);

/* Bytes a kind takes in the packet for each element. */
uint8_t wire_kind_size(uint8_t kind);

#define WIRE_MEMBER(tag, member) (((struct wire_##tag *)0)->member)

#define WIRE_KIND_OF(m) _Generic((m), \
	uint8_t: WIRE_KIND_U8, uint8_t *: WIRE_KIND_U8, int8_t: WIRE_KIND_U8, \
	uint16_t: WIRE_KIND_U16, uint16_t *: WIRE_KIND_U16, \
	int16_t: WIRE_KIND_U16, int16_t *: WIRE_KIND_U16, \
	uint32_t: WIRE_KIND_U32, uint32_t *: WIRE_KIND_U32, \
	int32_t: WIRE_KIND_U32, int32_t *: WIRE_KIND_U32, \
	float: WIRE_KIND_F32)

#define WIRE_ELEM_OF(m) _Generic((m), \
	uint8_t: 1, uint8_t *: 1, int8_t: 1, \
	uint16_t: 2, uint16_t *: 2, int16_t: 2, int16_t *: 2, \
	uint32_t: 4, uint32_t *: 4, int32_t: 4, int32_t *: 4, \
	float: 4)

/* Zero, or a compile error when the last byte would lie outside the packet. */
#define WIRE_FITS(end) (0 * sizeof(char[(end) <= WIRE_PK ? 1 : -1]))

#define WIRE_FIELD(tag, member, pos, kind_, count_, bytes, max_) { \
	.at = (pos) + WIRE_FITS((pos) + (bytes)), \
	.kind = (kind_), .count = (count_), .max = (max_), .reps = 1, \
	.offset = offsetof(struct wire_##tag, member) }

#define WIRE_COUNT_OF(tag, member) \
	(sizeof(WIRE_MEMBER(tag, member)) / WIRE_ELEM_OF(WIRE_MEMBER(tag, member)))

/* A scalar or an array, little-endian. */
#define WIRE_F(tag, member, pos) \
	WIRE_FIELD(tag, member, pos, WIRE_KIND_OF(WIRE_MEMBER(tag, member)), \
		   WIRE_COUNT_OF(tag, member), sizeof(WIRE_MEMBER(tag, member)), 0)

/* A u8 count of something which must not exceed max. */
#define WIRE_N(tag, member, pos, max) \
	WIRE_FIELD(tag, member, pos, WIRE_KIND_U8, 1, 1, max)

/* uint16_t, big-endian. */
#define WIRE_BE(tag, member, pos) \
	WIRE_FIELD(tag, member, pos, WIRE_KIND_U16BE, WIRE_COUNT_OF(tag, member), \
		   sizeof(WIRE_MEMBER(tag, member)), 0)

/* uint64_t, seven bytes. */
#define WIRE_PINS(tag, member, pos) \
	WIRE_FIELD(tag, member, pos, WIRE_KIND_U56, 1, 7, 0)

/* char[n + 1]. */
#define WIRE_TEXT(tag, member, pos) \
	WIRE_FIELD(tag, member, pos, WIRE_KIND_TEXT, sizeof(WIRE_MEMBER(tag, member)) - 1, \
		   sizeof(WIRE_MEMBER(tag, member)) - 1, 0)

/* Member m of every struct of an array, every stride_ packet bytes from pos. */
#define WIRE_EACH_N(tag, array, m, pos, stride_, max_) { \
	.at = (pos) + WIRE_FITS((pos) + (stride_) * (WIRE_REPS(tag, array) - 1) + \
				sizeof(WIRE_MEMBER(tag, array[0].m))), \
	.kind = WIRE_KIND_OF(WIRE_MEMBER(tag, array[0].m)), \
	.count = WIRE_COUNT_OF(tag, array[0].m), .max = (max_), \
	.reps = WIRE_REPS(tag, array), .stride = (stride_), \
	.offset = offsetof(struct wire_##tag, array[0].m), \
	.step = sizeof(WIRE_MEMBER(tag, array[0])) }
#define WIRE_EACH(tag, array, m, pos, stride_) WIRE_EACH_N(tag, array, m, pos, stride_, 0)
#define WIRE_REPS(tag, array) \
	(sizeof(WIRE_MEMBER(tag, array)) / sizeof(WIRE_MEMBER(tag, array[0])))

/* The layout of struct wire_<tag>, found by the operation table as wire_layout_<tag>. */
#define WIRE_LAYOUT(tag, ...) \
	const struct wire_layout wire_layout_##tag = { \
		.fields = (const struct wire_field[]){ __VA_ARGS__ }, \
		.count = sizeof((const struct wire_field[]){ __VA_ARGS__ }) / \
			 sizeof(struct wire_field), \
		.size = sizeof(struct wire_##tag), \
	}

#endif
