/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysd.conf over arbitrary bytes: a file is accepted whole and then
 * everything in it is within its limits, or it is refused with at least one
 * line that can be printed anywhere, and then nothing of it is used.
 */

#include <stdlib.h>
#include <string.h>
#include "daemon/control/config.h"

static void hold(bool fact)
{
	if (!fact)
		abort();
}

static void complain(void *context, const char *line)
{
	int *lines = context;

	hold(*line && strlen(line) < 1024);
	for (; *line; line++)
		hold(*line >= 0x20 && *line < 0x7f);
	++*lines;
}

static void device_is_sound(const struct config *config, const struct device_config *device)
{
	const struct pokeys_settings *settings = &device->settings;

	hold(device->name[0] && strlen(device->name) < sizeof(device->name));
	hold(device->address || device->serial);
	hold(device->port && device->fast_divider);
	hold(device->stale_after_ns > config->loop.period_ns * device->fast_divider);
	hold(device->lost_after_ns > device->stale_after_ns);
	hold(device->mailbox.deadline_ceiling_ns >= device->mailbox.deadline_floor_ns);
	hold(device->mailbox.window >= 1 && device->mailbox.window <= POKEYS_WINDOW_MAX);
	hold(settings->axes <= POKEYS_AXES && settings->emergency_pin <= POKEYS_PINS + 10);
	for (int i = 0; i < POKEYS_PINS; i++) {
		uint8_t function = settings->pin_function[i] & 0x0e;

		hold(!(function & (function - 1)));
		hold(!(device->safe_outputs[i / 8] & ~device->safe_mask[i / 8]));
	}
	for (int i = 0; i < POKEYS_AXES; i++)
		hold(!(settings->axis[i].options & 0x20) ||
		     settings->axis[i].soft_minimum < settings->axis[i].soft_maximum);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct config config;
	char *text = malloc(size); /* of exactly this size, for the sanitizer to watch */
	int lines = 0, faults;

	if (!text)
		return 0;
	memcpy(text, data, size);
	memset(&config, 0xa5, sizeof(config));
	faults = config_parse("f", text, size, &config, complain, &lines);
	hold(faults >= 0 && (faults > 0) == (lines > 0));
	if (faults) {
		hold(config.devices == 0xa5a5a5a5);
	} else {
		hold(config.devices >= 1 && config.devices <= TRANSPORT_CHANNELS);
		hold(config.loop.period_ns >= 250000 && config.loop.period_ns <= 4000000);
		hold(config.runtime_directory[0] == '/');
		for (uint32_t i = 0; i < config.devices; i++)
			device_is_sound(&config, &config.device[i]);
	}
	free(text);
	return 0;
}
