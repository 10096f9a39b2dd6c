/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A pin's value as HAL sees it, and as bytes to compare.
 */
#ifndef HALBRIDGE_CELL_H
#define HALBRIDGE_CELL_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/binding.h"

/* HAL's view of the same bytes. */
typedef volatile bool pin_bit;
typedef volatile uint64_t pin_float;
typedef volatile uint32_t pin_word;

static inline uint64_t cell_load(const void *at, unsigned int type)
{
	if (type == TABLE_BIT)
		return *(const pin_bit *)at;
	return type == TABLE_FLOAT ? *(const pin_float *)at : *(const pin_word *)at;
}

static inline void cell_store(void *at, unsigned int type, uint64_t value)
{
	if (type == TABLE_BIT)
		*(pin_bit *)at = value != 0;
	else if (type == TABLE_FLOAT)
		*(pin_float *)at = value;
	else
		*(pin_word *)at = (uint32_t)value;
}

static inline void cell_copy(void *to, const void *from, unsigned int type)
{
	if (type == TABLE_BIT)
		*(pin_bit *)to = *(const pin_bit *)from;
	else if (type == TABLE_FLOAT)
		*(pin_float *)to = *(const pin_float *)from;
	else
		*(pin_word *)to = *(const pin_word *)from;
}

static inline void *cell_member(const struct binding *binding, const struct binding_slot *slot)
{
	return (unsigned char *)binding->values + slot->offset;
}

#endif
