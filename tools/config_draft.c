// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A device's settings as a commented part of a new pokeysd.conf: help once for each key, then
 * the keys, all of one axis or encoder together.
 */
#include <string.h>
#include "tools/config_draft.h"
#include "tools/config_print.h"

enum { COLUMNS = 96 };

static void print_help(const struct settings_key *key, FILE *to)
{
	const char *word = key->help;
	size_t column = 0;

	while (*word) {
		const size_t length = strcspn(word, " ");

		if (column && column + 1 + length > COLUMNS)
			column = 0;
		if (!column)
			fputs(word == key->help ? "#" : "\n#", to);
		fprintf(to, " %.*s", (int)length, word);
		column += 1 + length;
		word += length + strspn(word + length, " ");
	}
	if (key->unit)
		fprintf(to, " [%s]", key->unit);
	fputc('\n', to);
}

/* Says of everything that it is off, none or 0. */
static const struct pokeys_settings *nothing_set_up(void)
{
	static struct pokeys_settings settings;

	settings.set = UINT32_MAX;
	memset(settings.pin_set, 0xff, sizeof(settings.pin_set));
	for (size_t i = 0; i < sizeof(settings.encoder) / sizeof(settings.encoder[0]); i++) {
		settings.encoder[i].options_mask = UINT8_MAX;
		settings.encoder[i].pins_set = UINT8_MAX;
	}
	for (size_t i = 0; i < POKEYS_AXES; i++) {
		settings.axis[i].set = UINT32_MAX;
		settings.axis[i].options_mask = UINT8_MAX;
		settings.axis[i].switches_mask = UINT8_MAX;
	}
	return &settings;
}

static bool is_nothing(const struct settings_key *key, uint32_t index, const char *text)
{
	char blank[SETTINGS_VALUE_MAX];

	settings_print(key, index, nothing_set_up(), blank);
	return !strcmp(text, blank);
}

/* False: the device has said nothing of it. */
static bool print_key(const struct settings_key *key, uint32_t index,
		      const struct pokeys_settings *device, bool first, FILE *to)
{
	char name[SETTINGS_NAME_MAX], text[SETTINGS_VALUE_MAX];
	const bool said = settings_print(key, index, device, text);

	if (!said && !*text)
		return false;
	settings_name(key, index, name);
	if (first)
		print_help(key, to);
	if (!said)
		fprintf(to, "; %s: the device has %s, for which there is no word\n", name, text);
	else if (is_nothing(key, index, text) && strcmp(key->name, "axis.#.mode") != 0)
		fprintf(to, "; %s =%s%s\n", name, config_is_pin_list(key) ? "" : " ",
			config_is_pin_list(key) ? "" : text);
	else
		fprintf(to, "%s = %s\n", name, text);
	return true;
}

/* All of one axis, then all of the next one. */
static void print_group(const struct settings_key *keys, size_t count,
			const struct pokeys_settings *device, FILE *to)
{
	bool first = true;

	for (uint32_t n = 0; n < config_indices(keys); n++) {
		bool any = false;

		for (size_t i = 0; i < count; i++) {
			if (config_is_idle(&keys[i], n, device))
				continue;
			if (!any && strchr(keys->name, '#'))
				fputc('\n', to);
			any = true;
			print_key(&keys[i], n, device, first, to);
		}
		first = first && !any;
	}
}

void config_draft_settings(const struct pokeys_settings *device, FILE *to)
{
	fputs("\n# What the device is set up for at present. pokeysd changes in the device\n"
	      "# what is changed here, and leaves all else as it is.\n", to);
	for (size_t i = 0; i < settings_key_count; i += config_group(i))
		print_group(&settings_keys[i], config_group(i), device, to);
	config_print_odd_pins(device, to);
}
