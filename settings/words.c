/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What may be written, and what a function of a pin is called: for messages,
 * not for files. A message says all that is allowed at once, because whoever
 * got a value wrong would otherwise have to guess a second time.
 */
#include <stdio.h>
#include "settings/private.h"
#include "settings/text.h"

const char *settings_pin_text(uint8_t function, char text[SETTINGS_VALUE_MAX])
{
	static const struct {
		uint8_t bits;
		const char *name;
	} functions[] = {
		{ 0x00, "inactive" },        { 0x02, "digital input" }, { 0x04, "digital output" },
		{ 0x08, "analog input" },    { 0x10, "analog output" }, { 0x22, "triggered input" },
		{ 0x20, "triggered input" }, { 0x42, "counter input" }, { 0x40, "counter input" },
	};

	snprintf(text, SETTINGS_VALUE_MAX, "function 0x%02x", function);
	for (size_t i = 0; i < sizeof(functions) / sizeof(functions[0]); i++)
		if ((function & 0x7f) == functions[i].bits)
			snprintf(text, SETTINGS_VALUE_MAX, "%s%s", functions[i].name,
				 function & 0x80 ? ", inverted" : "");
	return text;
}

size_t settings_allowed(const struct settings_key *key, char *text, size_t size)
{
	bool scalar = key->type == SETTINGS_NUMBER || key->type == SETTINGS_REAL;
	size_t at = settings_append(text, size, 0, "%s", scalar ? "leave" : "");

	for (const struct settings_word *word = key->words; word && word->name; word++)
		at = settings_append(text, size, at, " | %s", word->name);
	switch (key->type) {
	case SETTINGS_NUMBER:
	case SETTINGS_REAL:
		if (key->minimum <= key->maximum)
			at = settings_append(text, size, at, " | %.10g..%.10g", key->minimum,
					     key->maximum);
		return at;
	case SETTINGS_BYTES:
		return settings_append(text, size, at,
				       "at most %zu numbers %g..%g with commas "
				       "between",
				       key->size, key->minimum, key->maximum);
	case SETTINGS_TEXT:
		return settings_append(text, size, at,
				       "at most %d printable characters, no "
				       "quotes, ; or #",
				       NAME_LENGTH);
	case SETTINGS_PIN_PAIR:
		return settings_append(text, size, at, "two pins %g..%g with a comma between",
				       key->minimum, key->maximum);
	case SETTINGS_PIN_ROW:
		return settings_append(text, size, at,
				       "at most %zu pins %g..%g with commas "
				       "between, in order",
				       key->size, key->minimum, key->maximum);
	case SETTINGS_PIN_FUNCTION:
	case SETTINGS_PIN_FLAG:
	case SETTINGS_PIN_BITS:
		return settings_append(text, size, at, "pins %g..%g as a list such as %g-%g,%g",
				       key->minimum, key->maximum, key->minimum, key->minimum + 2,
				       key->minimum + 4);
	}
	return at;
}
