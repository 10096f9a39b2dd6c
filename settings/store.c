/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * From what a person wrote to a member of struct pokeys_settings.
 *
 * Numbers are taken whole or not at all: "10ms", "0x10", "1e400", "nan" and an
 * empty value are faults, not 10, 0, infinity or a default. All is judged
 * before anything is stored, so that a refused value leaves no half of itself.
 */
#include <string.h>
#include "settings/list.h"
#include "settings/private.h"
#include "settings/text.h"

static const char *store_number(const struct settings_key *key, uint32_t index, const char *text,
				struct pokeys_settings *settings)
{
	const struct settings_word *word = settings_find_word(key->words, text);
	int64_t scale = key->scale > 0 ? (int64_t)key->scale : 1;
	const char *wrong = NULL;
	int64_t value = 0;

	if (word) {
		value = word->value;
	} else {
		wrong = settings_whole(text, key->minimum, key->maximum, &value);
		if (!wrong && value % scale)
			wrong = "is between two steps";
		if (!wrong)
			value = value / scale + key->bias;
	}
	if (!wrong)
		field_put(key, index, settings, value);
	return wrong;
}

static const char *store_real(const struct settings_key *key, uint32_t index, const char *text,
			      struct pokeys_settings *settings)
{
	double value = 0;
	const char *wrong = settings_real(text, key->minimum, key->maximum, &value);
	const float single = (float)value;

	if (!wrong)
		memcpy(field_at(key, index, settings), &single, sizeof(single));
	return wrong;
}

/* A list of terminals in the order it is written, 0-based, none twice. */
static const char *parse_pins(const struct settings_key *key, const char *text,
			      struct pin_list *list)
{
	uint64_t seen = 0;
	char part[16];

	list->count = 0;
	if (!strcmp(text, "none") && key->type != SETTINGS_PIN_PAIR)
		return NULL;
	while (list_part(&text, part, sizeof(part))) {
		int first, last;
		const char *wrong = list_range(part, (int)key->minimum, (int)key->maximum, &first,
					       &last);

		if (wrong)
			return wrong;
		for (int pin = first - 1; pin < last; pin++) {
			if (seen >> pin & 1)
				return "names a pin twice";
			seen |= UINT64_C(1) << pin;
			list->pin[list->count++] = (uint8_t)pin;
		}
	}
	return NULL;
}

static void put_functions(const struct settings_key *key, const struct pin_list *list,
			  struct pokeys_settings *settings)
{
	for (uint32_t i = 0; i < list->count; i++) {
		uint8_t pin = list->pin[i];

		settings->pin_function[pin] |= (uint8_t)key->bits;
		settings->pin_set[pin / 8] |= (uint8_t)(1u << pin % 8);
	}
}

static void put_bits(const struct pin_list *list, uint8_t *field, size_t size)
{
	memset(field, 0, size);
	for (uint32_t i = 0; i < list->count; i++)
		field[list->pin[i] / 8] |= (uint8_t)(1u << list->pin[i] % 8);
}

static const char *store_pins(const struct settings_key *key, uint32_t index, const char *text,
			      struct pokeys_settings *settings)
{
	struct pin_list list;
	const char *wrong = parse_pins(key, text, &list);
	uint8_t *field = field_at(key, index, settings);

	if (wrong)
		return wrong;
	if (key->type == SETTINGS_PIN_PAIR && list.count != 2)
		return "is not two pins";
	if (key->type == SETTINGS_PIN_ROW && list.count > key->size)
		return "has too many pins";
	if (key->type == SETTINGS_PIN_FUNCTION || key->type == SETTINGS_PIN_FLAG)
		put_functions(key, &list, settings);
	else if (key->type == SETTINGS_PIN_BITS)
		put_bits(&list, field, key->size);
	else
		memcpy(field, list.pin, list.count);
	if (key->type == SETTINGS_PIN_ROW) {
		memset(field + list.count, 0, key->size - list.count);
		((uint8_t *)settings)[key->counted] = (uint8_t)list.count;
	}
	return NULL;
}

static const char *store_bytes(const struct settings_key *key, uint32_t index, const char *text,
			       struct pokeys_settings *settings)
{
	uint8_t bytes[16] = { 0 };
	size_t count = 0;
	char part[16];

	while (list_part(&text, part, sizeof(part))) {
		int64_t value;
		const char *wrong = settings_whole(part, key->minimum, key->maximum, &value);

		if (wrong)
			return wrong;
		if (count == key->size)
			return "has too many numbers";
		bytes[count++] = (uint8_t)value;
	}
	memcpy(field_at(key, index, settings), bytes, key->size);
	return NULL;
}

static const char *store_text(const struct settings_key *key, const char *text,
			      struct pokeys_settings *settings)
{
	char *field = field_at(key, 0, settings);
	size_t length = strlen(text);

	for (size_t i = 0; i < length; i++)
		if (text[i] < ' ' || text[i] > '~' || strchr("\"';#", text[i]))
			return "has a character in it that is not allowed";
	if (length > NAME_LENGTH)
		return "is too long";
	memset(field, 0, key->size);
	memcpy(field, text, length);
	return NULL;
}

static const char *store_any(const struct settings_key *key, uint32_t index, const char *text,
			     struct pokeys_settings *settings)
{
	switch (key->type) {
	case SETTINGS_NUMBER:
		return store_number(key, index, text, settings);
	case SETTINGS_REAL:
		return store_real(key, index, text, settings);
	case SETTINGS_BYTES:
		return store_bytes(key, index, text, settings);
	case SETTINGS_TEXT:
		return store_text(key, text, settings);
	case SETTINGS_PIN_FUNCTION:
	case SETTINGS_PIN_FLAG:
	case SETTINGS_PIN_PAIR:
	case SETTINGS_PIN_ROW:
	case SETTINGS_PIN_BITS:
		return store_pins(key, index, text, settings);
	}
	return settings_not_allowed;
}

const char *settings_store(const struct settings_key *key, uint32_t index, const char *text,
			   struct pokeys_settings *settings)
{
	const char *wrong;

	if (!strcmp(text, "leave"))
		return NULL;
	wrong = *text ? store_any(key, index, text, settings) : "has no value";
	if (!wrong)
		set_put(key, index, settings);
	return wrong;
}
