/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A bad parameter must stop loadrt with one line that says what to write
 * instead: whoever reads it has a machine that does not start.
 *
 * Without names= the first device has both schemes and the others have the
 * canonical one: two sets of 4500 names do not leave room in HAL's memory for
 * LinuxCNC. Those of a machine of the older component (ini=) have its names, as
 * with "loadusr pokeys".
 *
 * HAL's loader has no list type that tells "too many", so devices= is one
 * string and is taken apart here.
 */
#include "halbridge/settings.h"
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include "shm/runtime.h"

static bool known(const struct settings *settings, const char *name)
{
	for (size_t i = 0; i < settings->count; i++) {
		if (!strcmp(settings->device[i], name))
			return true;
	}
	return false;
}

static int add_device(struct settings *settings, const char *name, size_t length, char *why,
		      size_t size)
{
	char *to = settings->device[settings->count];

	if (settings->count == TABLE_DEVICES) {
		snprintf(why, size, "devices=: more than %d names", TABLE_DEVICES);
		return -EINVAL;
	}
	snprintf(to, POKEYS_SHM_NAME_MAX, "%.*s", (int)length, name);
	if (length >= POKEYS_SHM_NAME_MAX || !runtime_device_name_ok(to)) {
		snprintf(why, size,
			 "devices=: '%.*s' is not a device name: 1 to %d of "
			 "A-Z a-z 0-9 _ -, as in pokeysd.conf's [device NAME]",
			 (int)length, name, POKEYS_SHM_NAME_MAX - 1);
		return -EINVAL;
	}
	if (known(settings, to)) {
		snprintf(why, size, "devices=: '%s' is named twice", to);
		return -EINVAL;
	}
	settings->count++;
	return 0;
}

static int read_devices(struct settings *settings, const char *devices, char *why, size_t size)
{
	if (!devices || !*devices) {
		settings->count = 1;
		return 0;
	}
	for (const char *name = devices; name;) {
		size_t length = strcspn(name, ",");
		int r = add_device(settings, name, length, why, size);

		if (r)
			return r;
		name = name[length] ? name + length + 1 : NULL;
	}
	return 0;
}

static int read_names(struct settings *settings, const char *names, bool older, char *why,
		      size_t size)
{
	static const char *const words[] = {
		[TABLE_CANONICAL] = "canonical", [TABLE_LEGACY] = "legacy",
		[TABLE_BOTH] = "both",           [TABLE_ALL] = "all",
		[TABLE_CORE] = "core",           [TABLE_HEATERS] = "heaters",
		[TABLE_SERVOS] = "servos",       [TABLE_LOOPS] = "loops",
	};
	const unsigned int further = older ? TABLE_LEGACY : TABLE_CANONICAL;

	for (unsigned int i = 0; i < TABLE_DEVICES; i++)
		settings->schemes[i] = i ? further : TABLE_BOTH;
	if (!names || !*names)
		return 0;
	for (unsigned int i = TABLE_CORE; i < sizeof(words) / sizeof(words[0]); i++) {
		if (!words[i] || strcmp(names, words[i]))
			continue;
		for (unsigned int k = 0; k < TABLE_DEVICES; k++)
			settings->schemes[k] = i;
		return 0;
	}
	snprintf(why, size,
		 "names=%s: must be both, canonical, core, legacy, heaters, servos, "
		 "loops or all",
		 names);
	return -EINVAL;
}

static int read_runtime(struct settings *settings, const char *runtime, char *why, size_t size)
{
	int length = snprintf(why, size, "runtime=: ");

	settings->runtime = runtime && *runtime ? runtime : NULL;
	if (!settings->runtime)
		return 0;
	return runtime_check_directory(runtime, why + length, size - (size_t)length) ? -EINVAL : 0;
}

int settings_read(struct settings *settings, const char *devices, const char *names, bool older,
		  const char *runtime, char *why, size_t size)
{
	int r;

	memset(settings, 0, sizeof(*settings));
	r = read_devices(settings, devices, why, size);
	if (!r)
		r = read_names(settings, names, older, why, size);
	for (unsigned int i = 0; i < TABLE_DEVICES && older; i++)
		settings->schemes[i] |= settings->schemes[i] & TABLE_LEGACY ? TABLE_FORMER : 0u;
	if (!r)
		r = read_runtime(settings, runtime, why, size);
	return r;
}
