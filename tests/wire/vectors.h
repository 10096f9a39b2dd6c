/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef TESTS_WIRE_VECTORS_H
#define TESTS_WIRE_VECTORS_H

/*
 * Where fields stand, also those which no golden packet shows: each byte of a
 * packet holds its own offset, so a decoded value tells where it was read.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "wire/packet.h"

static uint8_t counting[WIRE_PK];

static int vectors_count(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < WIRE_PK; i++)
		counting[i] = (uint8_t)i;
	return 0;
}

/* The value of a field which begins at @at. */
#define LE16(at) ((at) | ((at) + 1) << 8)
#define BE16(at) ((at) << 8 | ((at) + 1))
#define LE32(at) ((uint32_t)LE16(at) | (uint32_t)LE16((at) + 2) << 16)
#define LE56(at) ((uint64_t)LE32(at) | (uint64_t)LE16((at) + 4) << 32 | \
		  (uint64_t)((at) + 6) << 48)

/* Declares v, decoded from the counting packet as request or reply of an operation. */
#define REQ(name, tag, v) \
	struct wire_##tag v; \
	wire_##name##_decode_req(counting, &v)
#define REP(name, tag, v) \
	struct wire_##tag v; \
	wire_##name##_decode_rep(counting, &v)

#define AT(field, at) assert_int_equal(field, at)
#define AT16(field, at) assert_int_equal((uint16_t)(field), LE16(at))
#define AT32(field, at) assert_int_equal((uint32_t)(field), LE32(at))
#define AT56(field, at) assert_true((field) == LE56(at))
#define ATBYTES(field, at) assert_memory_equal(field, counting + (at), sizeof(field))
#define ATTEXT(field, at) assert_memory_equal(field, counting + (at), sizeof(field) - 1)

#endif
