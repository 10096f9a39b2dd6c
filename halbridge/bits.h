/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Between bits of an image and the bools of HAL's pins, eight at a time.
 *
 * One multiplication moves eight of them; one by one, the two hundred inputs
 * and outputs of a device would cost more than all the rest of the exchange.
 * Bit i of a byte is bool i; both sides are little-endian. Realtime.
 */
#ifndef HALBRIDGE_BITS_H
#define HALBRIDGE_BITS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "bool i is byte i of a word");
_Static_assert(sizeof(bool) == 1, "a bool is a byte of a word");

#define BITS_ONES	UINT64_C(0x0101010101010101)

/* 8 * bytes bools from bits that were XORed with `invert` (NULL: none). */
static inline void bits_to_bools(bool *to, const uint8_t *from, const uint8_t *invert, size_t bytes)
{
	for (size_t i = 0; i < bytes; i++) {
		uint8_t byte = invert ? from[i] ^ invert[i] : from[i];
		uint64_t spread = byte * BITS_ONES & UINT64_C(0x8040201008040201);

		spread = (spread + UINT64_C(0x7f7f7f7f7f7f7f7f)) >> 7 & BITS_ONES;
		memcpy(to + 8 * i, &spread, sizeof(spread));
	}
}

/* The inverse of 8 * bytes bools. */
static inline void bools_invert(bool *to, const bool *from, size_t bytes)
{
	for (size_t i = 0; i < bytes; i++) {
		uint64_t eight;

		memcpy(&eight, from + 8 * i, sizeof(eight));
		eight ^= BITS_ONES;
		memcpy(to + 8 * i, &eight, sizeof(eight));
	}
}

/* Bits from 8 * bytes bools; they may be parameters, so each word is read once. */
static inline void bools_to_bits(uint8_t *to, const volatile bool *from, size_t bytes)
{
	for (size_t i = 0; i < bytes; i++) {
		uint64_t eight;

		memcpy(&eight, (const bool *)from + 8 * i, sizeof(eight));
		to[i] = (uint8_t)((eight & BITS_ONES) * UINT64_C(0x0102040810204080) >> 56);
	}
}

#endif
