/* SPDX-License-Identifier: MIT */
#ifndef WIRE_SHA1_H
#define WIRE_SHA1_H

#include <stddef.h>
#include <stdint.h>

#define WIRE_SHA1_MESSAGE 32	/* bytes of the only kind of message there is */
#define WIRE_SHA1_DIGEST 20

/* SHA-1 (FIPS 180-4) of 32 bytes. Realtime safe. */
void wire_sha1(const uint8_t message[WIRE_SHA1_MESSAGE], uint8_t digest[WIRE_SHA1_DIGEST]);

/*
 * What 0xE2 wants: the hash over password XOR seed. The password ends at a NUL
 * or after 32 characters; shorter ones count as padded with zeros, which the
 * sources do not say (protocol section 1.11). Realtime safe.
 */
void wire_password_hash(const char *password, const uint8_t seed[WIRE_SHA1_MESSAGE],
			uint8_t hash[WIRE_SHA1_DIGEST]);

#endif
