// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What is wanted and what the device has instead.
 *
 * Functions of terminals are lists in a file, and one terminal in another list
 * would make two lines of difference: those are compared terminal by terminal.
 */
#include "settings/key.h"
#include "tools/config_print.h"
#include "tools/json.h"

/* Told to as many as there are differences. */
struct difference {
	const char *name, *wanted, *device;
};

typedef void (*tell)(void *context, const struct difference *difference);

static unsigned int differing_pins(const struct pokeys_report *report, tell tell_one, void *context)
{
	char name[SETTINGS_NAME_MAX], wanted[SETTINGS_VALUE_MAX], device[SETTINGS_VALUE_MAX];
	unsigned int count = 0;

	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++) {
		const struct difference found = { name, wanted, device };

		if (!config_pin_known(&report->wanted, pin) ||
		    !config_pin_known(&report->device, pin) ||
		    report->wanted.pin_function[pin] == report->device.pin_function[pin])
			continue;
		snprintf(name, sizeof(name), "terminal %u", pin + 1);
		settings_pin_text(report->wanted.pin_function[pin], wanted);
		settings_pin_text(report->device.pin_function[pin], device);
		tell_one(context, &found);
		count++;
	}
	return count;
}

/*
 * A setting that the device does not have (a failsafe on a device without one)
 * is none that it has otherwise, once the daemon says that all is applied.
 */
static bool differs(const struct settings_key *key, uint32_t index,
		    const struct pokeys_report *report)
{
	if (!settings_differ(key, index, &report->wanted, &report->device))
		return false;
	return settings_given(key, index, &report->device) ||
	       report->state != POKEYS_CONFIG_APPLIED;
}

static unsigned int differing_keys(const struct pokeys_report *report, tell tell_one, void *context)
{
	char name[SETTINGS_NAME_MAX], wanted[SETTINGS_VALUE_MAX], device[SETTINGS_VALUE_MAX];
	const struct difference found = { name, wanted, device };
	unsigned int count = 0;

	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];

		for (uint32_t n = 0; n < config_indices(key); n++) {
			if (!differs(key, n, report))
				continue;
			settings_name(key, n, name);
			settings_print(key, n, &report->wanted, wanted);
			settings_print(key, n, &report->device, device);
			tell_one(context, &found);
			count++;
		}
	}
	return count;
}

static void tell_text(void *context, const struct difference *found)
{
	fprintf(context, "%s: %s is wanted, the device has %s\n", found->name, found->wanted,
		*found->device ? found->device : "none");
}

unsigned int config_print_diff(const struct pokeys_report *report, FILE *to)
{
	unsigned int pins = differing_pins(report, tell_text, to);

	return pins + differing_keys(report, tell_text, to);
}

static void tell_json(void *context, const struct difference *found)
{
	struct json *json = context;

	json_object(json, NULL);
	json_text(json, "key", found->name);
	json_text(json, "wanted", found->wanted);
	if (*found->device)
		json_text(json, "has", found->device);
	else
		json_null(json, "has");
	json_end(json);
}

unsigned int config_print_diff_json(const char *device, const struct pokeys_report *report,
				    FILE *to)
{
	struct json json;
	unsigned int count;

	json_init(&json, to);
	config_print_head(&json, device, report);
	json_array(&json, "differences");
	count = differing_pins(report, tell_json, &json);
	count += differing_keys(report, tell_json, &json);
	json_end(&json);
	json_end(&json);
	return count;
}
