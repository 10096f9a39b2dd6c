/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Members of struct pokeys_settings by offset and size.
 *
 * A table of members in C is a table of bytes, so everything that touches a
 * member by its offset is here, and goes through memcpy: sizes 1, 2 and 4,
 * signed or not, and parts of a byte.
 */
#include <stdio.h>
#include <string.h>
#include "settings/private.h"

void *field_at(const struct settings_key *key, uint32_t index, struct pokeys_settings *settings)
{
	return (char *)settings + key->offset + (size_t)index * key->stride;
}

const void *field_of(const struct settings_key *key, uint32_t index,
		     const struct pokeys_settings *settings)
{
	return (const char *)settings + key->offset + (size_t)index * key->stride;
}

static uint32_t read_bits(const void *from, size_t size)
{
	uint32_t value = 0;

	memcpy(&value, from, size); /* little-endian, as all of shared memory */
	return value;
}

int64_t field_get(const struct settings_key *key, uint32_t index,
		  const struct pokeys_settings *settings)
{
	uint32_t value = read_bits(field_of(key, index, settings), key->size);

	if (key->bits)
		return value & key->bits;
	if (key->is_signed)
		return key->size == 2 ? (int16_t)value : (int32_t)value;
	return value;
}

void field_put(const struct settings_key *key, uint32_t index, struct pokeys_settings *settings,
	       int64_t value)
{
	void *field = field_at(key, index, settings);
	uint32_t old = read_bits(field, key->size);
	uint32_t next = key->bits ? (old & ~key->bits) | (uint32_t)value : (uint32_t)value;

	memcpy(field, &next, key->size);
}

void set_put(const struct settings_key *key, uint32_t index, struct pokeys_settings *settings)
{
	char *set = (char *)settings + key->set_offset + (size_t)index * key->stride;
	uint32_t bits;

	if (!key->set_bits)
		return;
	bits = read_bits(set, key->set_size) | key->set_bits;
	memcpy(set, &bits, key->set_size);
}

bool settings_given(const struct settings_key *key, uint32_t index,
		    const struct pokeys_settings *settings)
{
	const char *set = (const char *)settings + key->set_offset + (size_t)index * key->stride;

	if (key->set_bits)
		return (read_bits(set, key->set_size) & key->set_bits) == key->set_bits;
	for (size_t i = 0; i < sizeof(settings->pin_set); i++)
		if (settings->pin_set[i])
			return true;
	return false;
}

const char *settings_name(const struct settings_key *key, uint32_t index,
			  char out[SETTINGS_NAME_MAX])
{
	const char *hash = strchr(key->name, '#');

	if (hash)
		snprintf(out, SETTINGS_NAME_MAX, "%.*s%u%s", (int)(hash - key->name), key->name,
			 index, hash + 1);
	else
		snprintf(out, SETTINGS_NAME_MAX, "%s", key->name);
	return out;
}
