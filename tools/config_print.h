/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A device's settings as lines of pokeysd.conf, and what of them is wanted otherwise. */
#ifndef TOOLS_CONFIG_PRINT_H
#define TOOLS_CONFIG_PRINT_H

#include <stdio.h>
#include <pokeys/settings.h>
#include "settings/key.h"
#include "tools/json.h"

/* What the device has: a [device NAME] section. `serial` is its serial number, 0 = not known. */
void config_print_show(const char *device, uint32_t serial, const struct pokeys_report *report,
		       FILE *to);
void config_print_show_json(const char *device, const struct pokeys_report *report, FILE *to);

/* What is wanted and what the device has instead, a line each. Returns how many. */
unsigned int config_print_diff(const struct pokeys_report *report, FILE *to);
unsigned int config_print_diff_json(const char *device, const struct pokeys_report *report,
				    FILE *to);

/* What both JSON documents begin with. */
void config_print_head(struct json *json, const char *device, const struct pokeys_report *report);

/* It is a list of the terminals that have a function. */
bool config_is_pin_list(const struct settings_key *key);

/*
 * Settings of encoders that do not count, and of axes that the device does not drive, are
 * meaningless. A file must not set those of such axes.
 */
bool config_is_idle(const struct settings_key *key, uint32_t index,
		    const struct pokeys_settings *device);

/* How many keys from `first` on are of the same thing: "axis.#.", "encoder.#.". */
size_t config_group(size_t first);

/* Whether a list of the file holds this function of a pin, from 0. */
bool config_pin_has_list(uint8_t function, unsigned int pin);

/* Functions of pins that no list of the file holds, as comments. */
void config_print_odd_pins(const struct pokeys_settings *device, FILE *to);

static inline uint32_t config_indices(const struct settings_key *key)
{
	return key->count ? key->count : 1;
}

static inline bool config_pin_known(const struct pokeys_settings *settings, unsigned int pin)
{
	return settings->pin_set[pin / 8] >> pin % 8 & 1;
}

/* "applied", "waiting", ... */
const char *config_print_state(uint8_t state);

#endif
