/* SPDX-License-Identifier: MIT */
/*
 * SHA-1 for the password check of 0xE2 (protocol section 1.11), which hashes
 * 32 bytes. One block is enough, so only one block is implemented: no state, no
 * allocation, always the same number of steps. It is the device's protocol, not
 * a choice: SHA-1 keeps nothing secret any more.
 */
#include "wire/sha1.h"

#include <string.h>

static uint32_t rotate(uint32_t x, int n)
{
	return (x << n) | (x >> (32 - n));
}

static uint32_t mix(int t, uint32_t b, uint32_t c, uint32_t d)
{
	if (t < 20)
		return ((b & c) | (~b & d)) + 0x5a827999u;
	if (t < 40)
		return (b ^ c ^ d) + 0x6ed9eba1u;
	if (t < 60)
		return ((b & c) | (b & d) | (c & d)) + 0x8f1bbcdcu;
	return (b ^ c ^ d) + 0xca62c1d6u;
}

static void schedule(const uint8_t block[64], uint32_t w[80])
{
	for (int t = 0; t < 16; t++)
		w[t] = (uint32_t)block[4 * t] << 24 | (uint32_t)block[4 * t + 1] << 16 |
		       (uint32_t)block[4 * t + 2] << 8 | block[4 * t + 3];
	for (int t = 16; t < 80; t++)
		w[t] = rotate(w[t - 3] ^ w[t - 8] ^ w[t - 14] ^ w[t - 16], 1);
}

void wire_sha1(const uint8_t message[WIRE_SHA1_MESSAGE], uint8_t digest[WIRE_SHA1_DIGEST])
{
	uint32_t h[5] = { 0x67452301u, 0xefcdab89u, 0x98badcfeu, 0x10325476u, 0xc3d2e1f0u };
	uint32_t a = h[0], b = h[1], c = h[2], d = h[3], e = h[4];
	uint8_t block[64] = { 0 };
	uint32_t w[80];

	memcpy(block, message, WIRE_SHA1_MESSAGE);
	block[WIRE_SHA1_MESSAGE] = 0x80;
	block[62] = (uint8_t)(WIRE_SHA1_MESSAGE >> 5);
	block[63] = (uint8_t)(WIRE_SHA1_MESSAGE << 3);
	schedule(block, w);
	for (int t = 0; t < 80; t++) {
		uint32_t next = rotate(a, 5) + mix(t, b, c, d) + e + w[t];

		e = d;
		d = c;
		c = rotate(b, 30);
		b = a;
		a = next;
	}
	h[0] += a;
	h[1] += b;
	h[2] += c;
	h[3] += d;
	h[4] += e;
	for (int i = 0; i < 20; i++)
		digest[i] = (uint8_t)(h[i / 4] >> (24 - 8 * (i % 4)));
}

void wire_password_hash(const char *password, const uint8_t seed[WIRE_SHA1_MESSAGE],
			uint8_t hash[WIRE_SHA1_DIGEST])
{
	const size_t length = strnlen(password, WIRE_SHA1_MESSAGE);
	uint8_t mixed[WIRE_SHA1_MESSAGE];

	memcpy(mixed, seed, sizeof(mixed));
	for (size_t i = 0; i < length; i++)
		mixed[i] ^= (uint8_t)password[i];
	wire_sha1(mixed, hash);
}
