// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One value: text in, typed field out, or what is wrong with it.
 *
 * Numbers are taken whole or not at all: "10ms", "0x10", "1e400", "nan" and
 * an empty value are faults, not 10, 0, infinity or a default. strtoll() and
 * strtod() would let each of them through in a different way, which is why the
 * text is looked at before they are called. Nothing here knows about files or
 * lines.
 */
#include <arpa/inet.h>
#include <string.h>
#include "daemon/control/config_key.h"
#include "settings/list.h"
#include "settings/text.h"

static const char *store_integer(const struct config_key *key, const char *text, void *field)
{
	const struct settings_word *word = settings_find_word(key->words, text);
	int64_t value = word ? word->value : 0;
	const char *wrong = word ? NULL : settings_whole(text, key->minimum, key->maximum, &value);

	if (!wrong)
		memcpy(field, &value, sizeof(value));
	return wrong;
}

static const char *store_real(const struct config_key *key, const char *text, void *field)
{
	const struct settings_word *word = settings_find_word(key->words, text);
	double value = word ? (double)word->value : 0;
	const char *wrong = word ? NULL : settings_real(text, key->minimum, key->maximum, &value);

	if (!wrong)
		memcpy(field, &value, sizeof(value));
	return wrong;
}

static const char *store_text(const struct config_key *key, const char *text, char *field)
{
	size_t length = strlen(text);

	if (key->type == CONFIG_FILE && *text != '/')
		return "is not a path from /";
	if (strpbrk(text, " \t\"'"))
		return "has a blank or a quote in it";
	if (key->type == CONFIG_TEXT && strchr(text, '/'))
		return "has a slash in it";
	if (length >= key->size)
		return "is too long";
	memcpy(field, text, length + 1);
	return NULL;
}

/* inet_pton() takes four decimal numbers and nothing else. */
static const char *parse_address(const char *text, uint32_t *out)
{
	struct in_addr address;

	if (inet_pton(AF_INET, text, &address) != 1)
		return "is not an IPv4 address";
	*out = ntohl(address.s_addr);
	if (!*out)
		return "is no device's address";
	return NULL;
}

/* From 224.0.0.0 on are groups and broadcasts: many, or all, would hear what one is told. */
static const char *store_address(const char *text, void *field)
{
	uint32_t address;
	const char *wrong = parse_address(text, &address);

	if (wrong && strchr(text, ':') && strchr(text, ':') == strrchr(text, ':'))
		wrong = "is not an IPv4 address; a port is set with the key port";
	if (!wrong && address >> 28 >= 14)
		wrong = "is no device's address";
	if (!wrong)
		memcpy(field, &address, sizeof(address));
	return wrong;
}

static const char *store_address_list(const char *text, struct config_list *field)
{
	struct config_list list = { 0 };
	char part[32];

	while (list_part(&text, part, sizeof(part))) {
		uint32_t address;
		const char *wrong = parse_address(part, &address);

		if (wrong)
			return wrong;
		for (uint32_t i = 0; i < list.count; i++)
			if (list.address[i] == address)
				return "names an address twice";
		if (list.count == CONFIG_ADDRESSES)
			return "has too many addresses";
		list.address[list.count++] = address;
	}
	*field = list;
	return NULL;
}

/* One part of a list: a word of one bit, a pin or a range of pins. */
static const char *add_pins(const struct config_key *key, const char *part, uint64_t *pins)
{
	const struct settings_word *word = settings_find_word(key->words, part);
	const uint64_t bit = word ? (uint64_t)word->value : 0;
	int first, last;
	const char *wrong;

	if (word && (!bit || bit & (bit - 1)))
		return "has a word in it that has to stand alone";
	if (*pins & bit)
		return "names something twice";
	*pins |= bit;
	if (word)
		return NULL;
	wrong = list_range(part, (int)key->minimum, (int)key->maximum, &first, &last);
	for (int pin = first; !wrong && pin <= last; pin++) {
		if (*pins & UINT64_C(1) << (pin - 1))
			wrong = "names a pin twice";
		*pins |= UINT64_C(1) << (pin - 1);
	}
	return wrong;
}

static const char *store_pin_list(const struct config_key *key, const char *text, void *field)
{
	const struct settings_word *word = settings_find_word(key->words, text);
	uint64_t pins = word ? (uint64_t)word->value : 0;
	char part[16];

	while (!word && list_part(&text, part, sizeof(part))) {
		const char *wrong = add_pins(key, part, &pins);

		if (wrong)
			return wrong;
	}
	memcpy(field, &pins, sizeof(pins));
	return NULL;
}

/* "25:100000": degrees Celsius, and ohm or volts at them. */
static const char *store_point(char *part, struct sensor_point *point)
{
	char *colon = strchr(part, ':');
	const char *wrong;

	if (!colon)
		return "has a part without a colon in it";
	*colon = '\0';
	wrong = settings_real(part, -300, 3000, &point->celsius);
	return wrong ? wrong : settings_real(colon + 1, 0, 1e9, &point->at);
}

static const char *store_points(const char *text, struct config_points *field)
{
	struct config_points points = { 0 };
	char part[48];

	while (list_part(&text, part, sizeof(part))) {
		const char *wrong;

		if (points.count == SENSOR_POINTS)
			return "has too many points";
		wrong = store_point(part, &points.point[points.count++]);
		if (wrong)
			return wrong;
	}
	*field = points;
	return NULL;
}

const char *config_store(const struct config_key *key, uint32_t index, const char *text, void *raw)
{
	void *field = (char *)raw + key->offset + (size_t)index * key->stride;

	switch (key->type) {
	case CONFIG_INTEGER:
		return store_integer(key, text, field);
	case CONFIG_REAL:
		return store_real(key, text, field);
	case CONFIG_TEXT:
	case CONFIG_FILE:
		return store_text(key, text, field);
	case CONFIG_ADDRESS:
		return store_address(text, field);
	case CONFIG_ADDRESS_LIST:
		return store_address_list(text, field);
	case CONFIG_PIN_LIST:
		return store_pin_list(key, text, field);
	case CONFIG_POINTS:
		return store_points(text, field);
	case CONFIG_SETTING:
		return settings_store(key->setting, index, text, field);
	}
	return settings_not_allowed;
}

static size_t allowed(const struct config_key *key, char *text, size_t size)
{
	size_t at = settings_append(text, size, 0, "%s", "");

	for (const struct settings_word *word = key->words; word && word->name; word++)
		at = settings_append(text, size, at, "%s%s", at ? " | " : "", word->name);
	switch (key->type) {
	case CONFIG_INTEGER:
	case CONFIG_REAL:
		if (key->minimum <= key->maximum)
			at = settings_append(text, size, at, "%s%.10g..%.10g", at ? " | " : "",
					     key->minimum, key->maximum);
		return at;
	case CONFIG_TEXT:
		return settings_append(text, size, at, "a name of at most %zu characters",
				       key->size - 1);
	case CONFIG_FILE:
		return settings_append(text, size, at, "a path from / of at most %zu characters",
				       key->size - 1);
	case CONFIG_ADDRESS:
		return settings_append(text, size, at, "an IPv4 address such as 192.168.1.20");
	case CONFIG_ADDRESS_LIST:
		return settings_append(text, size, at,
				       "at most %d IPv4 addresses with commas "
				       "between",
				       CONFIG_ADDRESSES);
	case CONFIG_PIN_LIST:
		return settings_append(text, size, at, "%spins %g..%g as a list such as %g-%g,%g",
				       at ? " | " : "", key->minimum, key->maximum, key->minimum,
				       key->minimum + 2, key->minimum + 4);
	case CONFIG_POINTS:
		return settings_append(text, size, at,
				       "at most %d points with commas between, "
				       "such as 25:100000, 150:1641",
				       SENSOR_POINTS);
	case CONFIG_SETTING:
		return settings_allowed(key->setting, text, size);
	}
	return at;
}

size_t config_allowed(const struct config_key *key, char *text, size_t size)
{
	const size_t at = allowed(key, text, size);

	return key->unit ? settings_append(text, size, at, " %s", key->unit) : at;
}

/*
 * Members that are written to the device together with a key that is given; so
 * these hold for those that are not.
 */
static void settings_defaults(struct pokeys_settings *settings)
{
	memset(settings, 0, sizeof(*settings));
	settings->ultra_options = 4;         /* counts four edges */
	settings->failsafe_timeout = 10;     /* 1 s */
	settings->failsafe_peripherals = 15; /* all of them */
}

void config_defaults(enum config_section section, void *raw)
{
	const struct config_key *key;

	if (section == CONFIG_DEVICE)
		settings_defaults(&((struct config_raw_device *)raw)->settings);
	for (size_t i = 0; (key = config_key_at(i)); i++) {
		if (key->section != section || key->type == CONFIG_SETTING)
			continue;
		for (uint32_t n = 0; n < (key->count ? key->count : 1); n++) {
			memset((char *)raw + key->offset + (size_t)n * key->stride, 0, key->size);
			if (key->fallback)
				config_store(key, n, key->fallback, raw);
		}
	}
}
