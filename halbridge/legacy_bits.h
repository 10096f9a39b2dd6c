/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Parameters of an axis that stand in a byte as well. Cold, without side effects.
 */
#ifndef HALBRIDGE_LEGACY_BITS_H
#define HALBRIDGE_LEGACY_BITS_H

#include <stddef.h>
#include <stdint.h>
#include "halbridge/values.h"

/* Bits of a byte that have parameters of their own, least first. */
struct legacy_bits {
	uint8_t count;
	struct {
		uint8_t bit;
		uint16_t at; /* in struct legacy_axis_settings */
		uint8_t size;
	} of[8];
};

extern const struct legacy_bits legacy_options, legacy_switches, legacy_homing;

/* A member of one or four bytes as a number. */
int32_t legacy_load(const struct legacy_axis_settings *set, size_t at, size_t size);
void legacy_store(struct legacy_axis_settings *set, size_t at, size_t size, int32_t value);

/* The byte that the parameters make. */
uint32_t legacy_build(const struct legacy_axis_settings *set, const struct legacy_bits *bits);

/* The bits have the say; the byte only while all of them are false. What it is then. */
uint32_t legacy_settle(struct legacy_axis_settings *set, const struct legacy_bits *bits,
		       uint32_t byte);

#endif
