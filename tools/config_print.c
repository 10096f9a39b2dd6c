// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What a device is set up for, in the words of pokeysd.conf: the keys are those
 * of the one table that the daemon reads its file with, so what is printed here
 * can be put into it. What the table has no word for stands there as a comment.
 */
#include <string.h>
#include <pokeys/names.h>
#include "settings/key.h"
#include "tools/config_print.h"
#include "tools/json.h"

enum { DIGITAL = 0x06, INVERTED = 0x80 };

static const char *const state_names[] = {
	[POKEYS_CONFIG_UNKNOWN] = "unknown",   [POKEYS_CONFIG_WAITING] = "waiting",
	[POKEYS_CONFIG_APPLYING] = "applying", [POKEYS_CONFIG_APPLIED] = "applied",
	[POKEYS_CONFIG_REFUSED] = "refused",
};

#define PICK(names, which) \
	((which) < sizeof(names) / sizeof((names)[0]) && (names)[which] ? (names)[which] : "?")

const char *config_print_state(uint8_t state)
{
	return PICK(state_names, state);
}

bool config_is_pin_list(const struct settings_key *key)
{
	return key->type == SETTINGS_PIN_FUNCTION || key->type == SETTINGS_PIN_FLAG;
}

bool config_pin_has_list(uint8_t function, unsigned int pin)
{
	/* inverted-pins are inputs and outputs */
	if (function & INVERTED && !(function & DIGITAL))
		return false;
	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];

		if (key->type == SETTINGS_PIN_FUNCTION && (function & 0x7fu) == key->bits &&
		    pin + 1 >= (unsigned int)key->minimum && pin + 1 <= (unsigned int)key->maximum)
			return true;
	}
	return !function;
}

static void show_key(const struct settings_key *key, uint32_t index,
		     const struct pokeys_settings *device, FILE *to)
{
	char name[SETTINGS_NAME_MAX], text[SETTINGS_VALUE_MAX];
	bool said = settings_print(key, index, device, text);

	settings_name(key, index, name);
	if (said && !(config_is_pin_list(key) && !strcmp(text, "none")))
		fprintf(to, "%s = %s\n", name, text);
	else if (!said && *text)
		fprintf(to, "; %s: the device has %s, for which there is no word\n", name, text);
}

bool config_is_idle(const struct settings_key *key, uint32_t index,
		    const struct pokeys_settings *device)
{
	if (!strncmp(key->name, "axis.#.", 7))
		return device->set & POKEYS_SET_AXES && index >= device->axes;
	if (!strncmp(key->name, "encoder.#.", 10) && strcmp(key->name, "encoder.#.enable") != 0)
		return !(device->encoder[index].options & 1);
	return false;
}

size_t config_group(size_t first)
{
	const char *hash = strchr(settings_keys[first].name, '#');
	size_t length = hash ? (size_t)(hash - settings_keys[first].name) + 1 : 0;
	size_t count = 1;

	while (hash && first + count < settings_key_count &&
	       !strncmp(settings_keys[first + count].name, settings_keys[first].name, length))
		count++;
	return count;
}

/* All of one axis, then all of the next one. */
static void show_group(const struct settings_key *keys, size_t count,
		       const struct pokeys_settings *device, FILE *to)
{
	for (uint32_t n = 0; n < config_indices(keys); n++)
		for (size_t i = 0; i < count; i++)
			if (!config_is_idle(&keys[i], n, device))
				show_key(&keys[i], n, device, to);
}

void config_print_odd_pins(const struct pokeys_settings *device, FILE *to)
{
	char text[SETTINGS_VALUE_MAX];

	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++)
		if (config_pin_known(device, pin) &&
		    !config_pin_has_list(device->pin_function[pin], pin))
			fprintf(to, "; terminal %u: %s, for which there is no key\n", pin + 1,
				settings_pin_text(device->pin_function[pin], text));
}

void config_print_show(const char *device, uint32_t serial, const struct pokeys_report *report,
		       FILE *to)
{
	fprintf(to, "[device %s]\n", device);
	if (serial)
		fprintf(to, "serial = %u\n", serial);
	for (size_t i = 0; i < settings_key_count; i += config_group(i))
		show_group(&settings_keys[i], config_group(i), &report->device, to);
	config_print_odd_pins(&report->device, to);
}

/* A number as such, all else as it stands in a file. */
static void put_value(struct json *json, const char *name, const struct settings_key *key,
		      uint32_t index, const struct pokeys_settings *settings)
{
	char text[SETTINGS_VALUE_MAX];
	double number;

	if (settings_number(key, index, settings, &number))
		json_real(json, name, number);
	else if (settings_print(key, index, settings, text))
		json_text(json, name, text);
	else
		json_null(json, name);
}

void config_print_head(struct json *json, const char *device, const struct pokeys_report *report)
{
	json_object(json, NULL);
	json_unsigned(json, "format", 1);
	json_text(json, "device", device);
	json_text(json, "config_state", config_print_state(report->state));
	if (report->refused)
		json_text(json, "refused", pokeys_setting_name(report->refused));
	else
		json_null(json, "refused");
	json_unsigned(json, "refused_index", report->refused_index);
}

static void put_pin_functions(struct json *json, const struct pokeys_settings *settings)
{
	json_array(json, "pin_functions");
	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++) {
		if (config_pin_known(settings, pin))
			json_unsigned(json, NULL, settings->pin_function[pin]);
		else
			json_null(json, NULL);
	}
	json_end(json);
}

void config_print_show_json(const char *device, const struct pokeys_report *report, FILE *to)
{
	char name[SETTINGS_NAME_MAX];
	struct json json;

	json_init(&json, to);
	config_print_head(&json, device, report);
	put_pin_functions(&json, &report->device);
	json_object(&json, "settings");
	for (size_t i = 0; i < settings_key_count; i++)
		for (uint32_t n = 0; n < config_indices(&settings_keys[i]); n++)
			if (settings_given(&settings_keys[i], n, &report->device))
				put_value(&json, settings_name(&settings_keys[i], n, name),
					  &settings_keys[i], n, &report->device);
	json_end(&json);
	json_end(&json);
}
