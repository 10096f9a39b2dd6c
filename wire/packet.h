/* SPDX-License-Identifier: MIT */
#ifndef WIRE_PACKET_H
#define WIRE_PACKET_H

/*
 * The 64-byte packet: header, checksum, validation (protocol sections 1.2 to
 * 1.5), and byte access at any alignment.
 *
 * Everything here is pure, bounded and free of allocation: safe in the
 * realtime loop and from any thread.
 */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define WIRE_PK 64		/* bytes in every request and every reply */
#define WIRE_PORT 20055		/* UDP and TCP, protocol section 1.1 */
#define WIRE_REQUEST 0xBB	/* @0 of a request */
#define WIRE_REPLY 0xAA		/* @0 of a reply */
#define WIRE_PAYLOAD_AT 8	/* first payload byte */
#define WIRE_PAYLOAD_LEN 56

#define WIRE_AT_MAGIC 0
#define WIRE_AT_OP 1
#define WIRE_AT_P1 2
#define WIRE_AT_P2 3
#define WIRE_AT_P3 4
#define WIRE_AT_P4 5
#define WIRE_AT_ID 6
#define WIRE_AT_SUM 7
#define WIRE_AT_CHECK 63	/* check byte of the pulse engine status */

/* @63 of a pulse engine status = this + check byte of the request, mod 256 */
#define WIRE_CHECK_BASE 0x5A

/* Why a packet was not taken. WIRE_OK is zero, the rest positive conditions. */
enum wire_reason {
	WIRE_OK = 0,
	WIRE_LENGTH,     /* not exactly 64 bytes */
	WIRE_MAGIC,      /* @0 is not the expected 0xAA / 0xBB */
	WIRE_CHECKSUM,   /* @7 is not the sum of @0..@6 */
	WIRE_ID,         /* request id @6 differs */
	WIRE_OPERATION,  /* operation @1 differs */
	WIRE_ECHO,       /* a parameter the device must echo differs */
	WIRE_CHECK_BYTE, /* @63 of a pulse engine status is wrong */
	WIRE_REASONS
};

/* Short lower-case name of a reason, for logs and metrics; never NULL. */
const char *wire_reason_name(enum wire_reason reason);

/* Sum of @0..@6 mod 256; the payload is not covered (section 1.3). */
uint8_t wire_checksum(const uint8_t p[WIRE_PK]);

/* Sets the request id @6 and the checksum @7; call last, after encoding. */
void wire_finish(uint8_t p[WIRE_PK], uint8_t id);

/*
 * Length, header byte and checksum of a received reply (client) or request
 * (device). The first failing rule in that order is the answer.
 */
enum wire_reason wire_check_reply(const uint8_t *p, size_t len);
enum wire_reason wire_check_request(const uint8_t *p, size_t len);

static inline uint8_t wire_packet_op(const uint8_t p[WIRE_PK])
{
	return p[WIRE_AT_OP];
}

static inline uint8_t wire_packet_id(const uint8_t p[WIRE_PK])
{
	return p[WIRE_AT_ID];
}

/* Unaligned little-endian and big-endian access. */

static inline uint16_t wire_get_u16(const uint8_t *p)
{
	return (uint16_t)(p[0] | p[1] << 8);
}

static inline uint16_t wire_get_u16be(const uint8_t *p)
{
	return (uint16_t)(p[0] << 8 | p[1]);
}

static inline uint32_t wire_get_u32(const uint8_t *p)
{
	return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static inline int32_t wire_get_i32(const uint8_t *p)
{
	return (int32_t)wire_get_u32(p);
}

/* Seven bytes: the 55-pin bitmap, pin n (0-based) = bit n. */
static inline uint64_t wire_get_u56(const uint8_t *p)
{
	return (uint64_t)wire_get_u32(p) | (uint64_t)wire_get_u16(p + 4) << 32 |
	       (uint64_t)p[6] << 48;
}

static inline float wire_get_f32(const uint8_t *p)
{
	uint32_t bits = wire_get_u32(p);
	float value;

	memcpy(&value, &bits, sizeof(value));
	return value;
}

static inline void wire_put_u16(uint8_t *p, uint16_t v)
{
	p[0] = (uint8_t)v;
	p[1] = (uint8_t)(v >> 8);
}

static inline void wire_put_u16be(uint8_t *p, uint16_t v)
{
	p[0] = (uint8_t)(v >> 8);
	p[1] = (uint8_t)v;
}

static inline void wire_put_u32(uint8_t *p, uint32_t v)
{
	p[0] = (uint8_t)v;
	p[1] = (uint8_t)(v >> 8);
	p[2] = (uint8_t)(v >> 16);
	p[3] = (uint8_t)(v >> 24);
}

static inline void wire_put_i32(uint8_t *p, int32_t v)
{
	wire_put_u32(p, (uint32_t)v);
}

static inline void wire_put_u56(uint8_t *p, uint64_t v)
{
	wire_put_u32(p, (uint32_t)v);
	wire_put_u16(p + 4, (uint16_t)(v >> 32));
	p[6] = (uint8_t)(v >> 48);
}

static inline void wire_put_f32(uint8_t *p, float v)
{
	uint32_t bits;

	memcpy(&bits, &v, sizeof(bits));
	wire_put_u32(p, bits);
}

#endif
