/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * From a member of struct pokeys_settings to what a person would have written.
 *
 * What comes out goes in again and gives the same value; a value for which
 * there is no word and no range (a device may hold anything) is told as such
 * and not printed as something else.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "settings/private.h"
#include "settings/text.h"

static const struct settings_word *word_of(const struct settings_key *key, int64_t value)
{
	for (const struct settings_word *word = key->words; word && word->name; word++)
		if (word->value == value)
			return word;
	return NULL;
}

static double scale_of(const struct settings_key *key)
{
	return key->scale > 0 ? key->scale : 1;
}

/* The shortest decimal that is this float again. */
static void print_float(float value, char text[SETTINGS_VALUE_MAX])
{
	for (int digits = 6; digits <= 9; digits++) {
		snprintf(text, SETTINGS_VALUE_MAX, "%.*g", digits, (double)value);
		if (strtof(text, NULL) == value)
			return;
	}
}

static float real_of(const struct settings_key *key, uint32_t index,
		     const struct pokeys_settings *settings)
{
	float value;

	memcpy(&value, field_of(key, index, settings), sizeof(value));
	return value;
}

bool settings_number(const struct settings_key *key, uint32_t index,
		     const struct pokeys_settings *settings, double *out)
{
	int64_t field;

	if (!settings_given(key, index, settings))
		return false;
	if (key->type == SETTINGS_REAL) {
		*out = (double)real_of(key, index, settings);
	} else if (key->type == SETTINGS_NUMBER) {
		field = field_get(key, index, settings);
		if (word_of(key, field))
			return false;
		*out = (double)(field - key->bias) * scale_of(key);
	} else {
		return false;
	}
	return isfinite(*out) && *out >= key->minimum && *out <= key->maximum;
}

static bool print_number(const struct settings_key *key, uint32_t index,
			 const struct pokeys_settings *settings, char text[SETTINGS_VALUE_MAX])
{
	int64_t field = field_get(key, index, settings);
	const struct settings_word *word = word_of(key, field);
	double value;

	if (word) {
		snprintf(text, SETTINGS_VALUE_MAX, "%s", word->name);
		return true;
	}
	if (settings_number(key, index, settings, &value)) {
		snprintf(text, SETTINGS_VALUE_MAX, "%.0f", value);
		return true;
	}
	snprintf(text, SETTINGS_VALUE_MAX, "%lld", (long long)field);
	return false;
}

static bool print_real(const struct settings_key *key, uint32_t index,
		       const struct pokeys_settings *settings, char text[SETTINGS_VALUE_MAX])
{
	double value;

	print_float(real_of(key, index, settings), text);
	return settings_number(key, index, settings, &value);
}

/* Runs of at least three are written as a range. */
static void print_set(uint64_t pins, char text[SETTINGS_VALUE_MAX])
{
	size_t at = settings_append(text, SETTINGS_VALUE_MAX, 0, "%s", pins ? "" : "none");

	for (int first = 0; first < POKEYS_PINS; first++) {
		int last = first;

		if (!(pins >> first & 1))
			continue;
		while (pins >> (last + 1) & 1)
			last++;
		if (last - first < 2)
			last = first;
		at = settings_append(text, SETTINGS_VALUE_MAX, at, "%s%d", at ? "," : "",
				     first + 1);
		if (last > first)
			at = settings_append(text, SETTINGS_VALUE_MAX, at, "-%d", last + 1);
		first = last;
	}
}

static uint64_t functions_of(const struct settings_key *key, const struct pokeys_settings *settings)
{
	uint64_t pins = 0;

	for (int pin = (int)key->minimum - 1; pin < (int)key->maximum; pin++) {
		uint8_t function = settings->pin_function[pin];
		bool has = key->type == SETTINGS_PIN_FLAG ?
				   (function & key->bits) && function & 0x7f :
				   (function & 0x7fu) == key->bits;

		if (settings->pin_set[pin / 8] >> pin % 8 & 1 && has)
			pins |= UINT64_C(1) << pin;
	}
	return pins;
}

static void print_row(const uint8_t *pins, size_t count, char text[SETTINGS_VALUE_MAX])
{
	size_t at = settings_append(text, SETTINGS_VALUE_MAX, 0, "%s", count ? "" : "none");

	for (size_t i = 0; i < count; i++)
		at = settings_append(text, SETTINGS_VALUE_MAX, at, "%s%d", at ? "," : "",
				     pins[i] + 1);
}

static void print_bytes(const uint8_t *bytes, size_t count, char text[SETTINGS_VALUE_MAX])
{
	size_t at = 0;

	text[0] = '\0';
	for (size_t i = 0; i < count; i++)
		at = settings_append(text, SETTINGS_VALUE_MAX, at, "%s%d", at ? "," : "", bytes[i]);
}

static bool pins_in_range(const uint8_t *pins, size_t count)
{
	for (size_t i = 0; i < count; i++)
		if (pins[i] >= POKEYS_PINS)
			return false;
	return true;
}

static bool print_list(const struct settings_key *key, uint32_t index,
		       const struct pokeys_settings *settings, char text[SETTINGS_VALUE_MAX])
{
	const uint8_t *field = field_of(key, index, settings);
	size_t count = key->size;
	uint64_t pins = 0;

	if (key->type == SETTINGS_PIN_FUNCTION || key->type == SETTINGS_PIN_FLAG) {
		print_set(functions_of(key, settings), text);
		return true;
	}
	if (key->type == SETTINGS_PIN_BITS) {
		memcpy(&pins, field, sizeof(pins));
		print_set(pins & ((UINT64_C(1) << POKEYS_PINS) - 1), text);
		return true;
	}
	if (key->type == SETTINGS_PIN_ROW)
		count = ((const uint8_t *)settings)[key->counted];
	if (count > key->size)
		count = key->size;
	if (key->type == SETTINGS_BYTES)
		print_bytes(field, count, text);
	else
		print_row(field, count, text);
	return key->type == SETTINGS_BYTES || pins_in_range(field, count);
}

/* A device may call itself anything; what a file cannot hold is not printed. */
static bool print_text(const struct settings_key *key, const struct pokeys_settings *settings,
		       char text[SETTINGS_VALUE_MAX])
{
	snprintf(text, SETTINGS_VALUE_MAX, "%.*s", NAME_LENGTH,
		 (const char *)field_of(key, 0, settings));
	for (const char *c = text; *c; c++)
		if (*c < ' ' || *c > '~')
			text[0] = '\0';
	return *text;
}

/* A device may have what we would refuse, two channels at one terminal for one. */
static bool goes_in_again(const struct settings_key *key, uint32_t index, const char *text)
{
	struct pokeys_settings copy = { 0 };

	return !settings_store(key, index, text, &copy);
}

static bool print_any(const struct settings_key *key, uint32_t index,
		      const struct pokeys_settings *settings, char text[SETTINGS_VALUE_MAX])
{
	switch (key->type) {
	case SETTINGS_NUMBER:
		return print_number(key, index, settings, text);
	case SETTINGS_REAL:
		return print_real(key, index, settings, text);
	case SETTINGS_TEXT:
		return print_text(key, settings, text);
	case SETTINGS_BYTES:
	case SETTINGS_PIN_FUNCTION:
	case SETTINGS_PIN_FLAG:
	case SETTINGS_PIN_PAIR:
	case SETTINGS_PIN_ROW:
	case SETTINGS_PIN_BITS:
		return print_list(key, index, settings, text);
	}
	return false;
}

bool settings_print(const struct settings_key *key, uint32_t index,
		    const struct pokeys_settings *settings, char text[SETTINGS_VALUE_MAX])
{
	text[0] = '\0';
	return settings_given(key, index, settings) && print_any(key, index, settings, text) &&
	       goes_in_again(key, index, text);
}

bool settings_differ(const struct settings_key *key, uint32_t index,
		     const struct pokeys_settings *wanted, const struct pokeys_settings *device)
{
	char one[SETTINGS_VALUE_MAX], other[SETTINGS_VALUE_MAX];
	float want, has;

	if (key->type == SETTINGS_PIN_FUNCTION || key->type == SETTINGS_PIN_FLAG ||
	    !settings_given(key, index, wanted))
		return false;
	if (!settings_given(key, index, device))
		return true;
	if (key->type == SETTINGS_REAL) {
		/* the device counts in milliseconds: not every float survives the way */
		want = real_of(key, index, wanted);
		has = real_of(key, index, device);
		return !(fabsf(want - has) <= fabsf(want) * 1e-6f);
	}
	settings_print(key, index, wanted, one);
	settings_print(key, index, device, other);
	return strcmp(one, other) != 0;
}
