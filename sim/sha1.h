/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_SHA1_H
#define SIM_SHA1_H

#include <stddef.h>
#include <stdint.h>

/* SHA-1 (FIPS 180-4) of one message of at most 55 bytes: a single block. */
void sim_sha1_short(const uint8_t *message, size_t len, uint8_t digest[20]);

#endif
