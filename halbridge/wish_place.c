/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Where a setting stands in struct pokeys_settings.
 *
 * A place is whole bytes, some bits of a word, or one bit of a map; that a
 * setting is meant is said at another place, which several may share. On an
 * axis that is turned round (negative scale) the two soft limits change
 * places.
 */
#include <string.h>
#include "halbridge/wish.h"

#define AT(settings_, place_, index_)	\
	((settings_) + (place_)->offset + (index_) * (place_)->stride)

static uint32_t load(const struct pokeys_settings *settings, const struct wish_place *place,
		     unsigned int index)
{
	const unsigned char *at = AT((const unsigned char *)settings, place, index);
	unsigned int bit = index + place->shift;
	uint32_t word = 0;

	if (!place->size)
		return at[bit / 8] >> bit % 8 & 1;
	memcpy(&word, at, place->size);
	return place->bits ? (word & place->bits) >> place->shift : word;
}

static void store(struct pokeys_settings *settings, const struct wish_place *place,
		  unsigned int index, uint32_t value)
{
	unsigned char *at = AT((unsigned char *)settings, place, index);
	unsigned int bit = index + place->shift;
	uint32_t word = 0;

	if (!place->size) {
		at[bit / 8] = (unsigned char)((at[bit / 8] & ~(1u << bit % 8)) |
					      (value & 1) << bit % 8);
		return;
	}
	memcpy(&word, at, place->size);
	word = place->bits ? (word & ~place->bits) | (value << place->shift & place->bits) : value;
	memcpy(at, &word, place->size);
}

static bool is_mirrored(const struct wish_row *row, const struct wish_context *context)
{
	return context->scale < 0 && row->mirror.size;
}

static double number_of(const struct wish_row *row, uint32_t word)
{
	float real;

	memcpy(&real, &word, sizeof(real));
	switch ((enum wish_form)row->form) {
	case WISH_REAL:
		return (double)real;
	case WISH_SIGNED:
		return row->field.size == 2 ? (double)(int16_t)word : (double)(int32_t)word;
	case WISH_UNSIGNED:
		break;
	}
	return word;
}

static uint32_t word_of(const struct wish_row *row, double raw)
{
	float real = (float)raw;
	uint32_t word;

	memcpy(&word, &real, sizeof(word));
	return row->form == WISH_REAL ? word : (uint32_t)(int64_t)raw;
}

double wish_round(const struct wish_row *row, double raw)
{
	return number_of(row, word_of(row, raw));
}

double wish_load(const struct wish_row *row, const struct pokeys_settings *settings,
		 unsigned int index, const struct wish_context *context)
{
	return number_of(row, load(settings, is_mirrored(row, context) ? &row->mirror : &row->field,
				   index));
}

void wish_store(const struct wish_row *row, struct pokeys_settings *settings, unsigned int index,
		const struct wish_context *context, double raw)
{
	store(settings, is_mirrored(row, context) ? &row->mirror : &row->field, index,
	      word_of(row, raw));
}

static const struct wish_place *flag_of(const struct wish_row *row,
					const struct wish_context *context)
{
	return is_mirrored(row, context) ? &row->mirror_flag : &row->flag;
}

bool wish_is_set(const struct wish_row *row, const struct pokeys_settings *settings,
		 unsigned int index, const struct wish_context *context)
{
	return load(settings, flag_of(row, context), index) != 0;
}

void wish_flag(const struct wish_row *row, struct pokeys_settings *settings, unsigned int index,
	       const struct wish_context *context, bool meant)
{
	store(settings, flag_of(row, context), index, meant ? UINT32_MAX : 0);
}
