/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Where a key's value stands, for this room's own files. */
#ifndef SETTINGS_PRIVATE_H
#define SETTINGS_PRIVATE_H

#include "settings/key.h"

enum { NAME_LENGTH = 20 }; /* of the device's name, protocol section 2.1 */

struct pin_list {
	uint32_t count;
	uint8_t pin[POKEYS_PINS]; /* 0-based */
};

void *field_at(const struct settings_key *key, uint32_t index, struct pokeys_settings *settings);
const void *field_of(const struct settings_key *key, uint32_t index,
		     const struct pokeys_settings *settings);

/* SETTINGS_NUMBER: the key's part of the field. */
int64_t field_get(const struct settings_key *key, uint32_t index,
		  const struct pokeys_settings *settings);
void field_put(const struct settings_key *key, uint32_t index, struct pokeys_settings *settings,
	       int64_t value);

/* Say that it is meant. Functions of pins have said so themselves. */
void set_put(const struct settings_key *key, uint32_t index, struct pokeys_settings *settings);

#endif
