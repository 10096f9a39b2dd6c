/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older component took count=N or names=A,B as halcompile makes them:
 * pokeys.0 to pokeys.N-1, or names of one's own, and either or none. A prefix
 * has to leave room for the longest name, which fills HAL's 47 characters
 * behind "pokeys.0".
 */
#include "halbridge/pokeys_options.h"
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "shm/runtime.h"

enum { PREFIX_MOST = sizeof("pokeys.0") - 1 };

static int read_count(struct pokeys_options *options, const char *text, char *why, size_t size)
{
	char *end;
	long count = strtol(text, &end, 10);

	if (end == text || *end || count < 1 || count > TABLE_DEVICES) {
		snprintf(why, size, "count=%s: must be 1 to %d", text, TABLE_DEVICES);
		return -EINVAL;
	}
	options->count = (size_t)count;
	for (unsigned int i = 0; i < options->count; i++)
		snprintf(options->prefix[i], INSTANCE_PREFIX, "pokeys.%u", i);
	return 0;
}

/* HAL would take a blank, and no line of a HAL file could name the pin. */
static bool is_prefix(const char *name, size_t length)
{
	if (!length || length > PREFIX_MOST)
		return false;
	for (size_t i = 0; i < length; i++) {
		if (name[i] <= ' ' || name[i] >= 0x7f)
			return false;
	}
	return true;
}

static bool is_taken(const struct pokeys_options *options, const char *name, size_t length)
{
	for (size_t i = 0; i < options->count; i++) {
		if (strlen(options->prefix[i]) == length &&
		    !memcmp(options->prefix[i], name, length))
			return true;
	}
	return false;
}

static int read_names(struct pokeys_options *options, const char *text, char *why, size_t size)
{
	options->count = 0;
	for (const char *name = text; name;) {
		size_t length = strcspn(name, ",");

		if (!is_prefix(name, length) || options->count == TABLE_DEVICES) {
			snprintf(why, size,
				 "names=%s: at most %d names of 1 to %d characters, "
				 "for HAL's names end at %d, without blanks",
				 text, TABLE_DEVICES, PREFIX_MOST, TABLE_NAME_MAX);
			return -EINVAL;
		}
		if (is_taken(options, name, length)) {
			snprintf(why, size, "names=%s: '%.*s' is there twice", text, (int)length,
				 name);
			return -EINVAL;
		}
		snprintf(options->prefix[options->count++], INSTANCE_PREFIX, "%.*s", (int)length,
			 name);
		name = name[length] ? name + length + 1 : NULL;
	}
	return 0;
}

static int read_runtime(struct pokeys_options *options, const char *text, char *why, size_t size)
{
	int length = snprintf(why, size, "runtime=: ");

	options->runtime = text;
	return runtime_check_directory(text, why + length, size - (size_t)length) ? -EINVAL : 0;
}

static int read_loops(struct pokeys_options *options, const char *text, char *why, size_t size)
{
	static const struct {
		const char *word;
		unsigned int schemes;
	} loops[] = {
		{ "heaters", TABLE_HEATER | TABLE_HEATER_GAIN },
		{ "servos", TABLE_SERVO | TABLE_SERVO_GAIN },
		{ "all", TABLE_HEATER | TABLE_HEATER_GAIN | TABLE_SERVO | TABLE_SERVO_GAIN },
	};

	for (size_t i = 0; i < sizeof(loops) / sizeof(loops[0]); i++) {
		if (strcmp(text, loops[i].word))
			continue;
		options->schemes = loops[i].schemes;
		return 0;
	}
	snprintf(why, size, "loops=%s: must be heaters, servos or all", text);
	return -EINVAL;
}

int pokeys_options_read(struct pokeys_options *options, int argc, char **argv, char *why,
			size_t size)
{
	int r;

	memset(options, 0, sizeof(*options));
	r = read_count(options, "1", why, size);
	for (int i = 1; i < argc && !r; i++) {
		if (!strncmp(argv[i], "count=", 6)) {
			r = read_count(options, argv[i] + 6, why, size);
		} else if (!strncmp(argv[i], "names=", 6)) {
			r = read_names(options, argv[i] + 6, why, size);
		} else if (!strncmp(argv[i], "runtime=", 8)) {
			r = read_runtime(options, argv[i] + 8, why, size);
		} else if (!strncmp(argv[i], "loops=", 6)) {
			r = read_loops(options, argv[i] + 6, why, size);
		} else {
			snprintf(why, size, "there is no option %s; pokeys --help lists them",
				 argv[i]);
			r = -EINVAL;
		}
	}
	return r;
}
