/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A device's settings as lines of pokeysd.conf, and what of them is wanted otherwise. */
#ifndef TOOLS_CONFIG_PRINT_H
#define TOOLS_CONFIG_PRINT_H

#include <stdio.h>
#include <pokeys/settings.h>
#include "settings/key.h"
#include "tools/json.h"

/* What the device has: a [device NAME] section. */
void config_print_show(const char *device, const struct pokeys_report *report, FILE *to);
void config_print_show_json(const char *device, const struct pokeys_report *report, FILE *to);

/* What is wanted and what the device has instead, a line each. Returns how many. */
unsigned int config_print_diff(const struct pokeys_report *report, FILE *to);
unsigned int config_print_diff_json(const char *device, const struct pokeys_report *report,
				    FILE *to);

/* What both JSON documents begin with. */
void config_print_head(struct json *json, const char *device, const struct pokeys_report *report);

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
