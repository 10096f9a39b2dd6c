/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What both shells do with a machine's INI file: the userspace component always,
 * as the older one did, the realtime module if it is told to (ini=).
 *
 * Much of what a machine was set up with stood there and in no HAL file, the
 * polarity of its emergency button among it.
 */
#include "halbridge/ini_adopt.h"
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <rtapi.h>
#include "shm/runtime.h"

enum { LIST = 600 };

static void complain(void *argument, const char *line)
{
	rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s\n", (const char *)argument, line);
}

/*
 * DEVICE_ID is the first instance's, DEVICE_ID_1 the second's ... 0 = the only one. A file
 * that names one in a way nobody understands does not mean any that happens to be there.
 */
static void adopt_serial(const struct ini_file *file, struct instance *instance)
{
	char key[24] = "DEVICE_ID";
	long serial;

	if (instance->number)
		snprintf(key, sizeof(key), "DEVICE_ID_%u", instance->number);
	serial = ini_whole(file, key, 0, UINT32_MAX, ini_file_find(file, "POKEYS", key) ? -1 : 0,
			   complain, instance->prefix);
	instance->no_serial = serial < 0;
	instance->serial = serial < 0 ? 0 : (uint32_t)serial;
}

/*
 * One line for all of them: most are there for a HAL file's setp, but one may be misspelt.
 * Not by rtapi_print_msg(): LinuxCNC's realtime prints errors alone, and shows those to
 * the operator at each start.
 */
static void say_unknown(const struct ini_file *file, struct instance *instance)
{
	char list[LIST];
	unsigned int count = ini_unknown(file, instance, list, sizeof(list));

	if (count)
		fprintf(stderr,
			"%s: %s: keys of [POKEYS] that only a HAL file can use, or that "
			"are misspelt (%u): %s\n",
			instance->prefix, file->path, count, list);
}

void ini_adopt(const struct ini_file *file, struct instance *instance)
{
	adopt_serial(file, instance);
	instance->values->legacy.choice.encoder_factor = true;
	ini_apply(file, instance, complain, instance->prefix);
	if (instance->number)
		return;
	say_unknown(file, instance);
	/* how long the old component searched; the daemon searches for ever */
	ini_whole(file, "COMM_TIMEOUT", 0, 600000, 2000, complain, instance->prefix);
}

int ini_runtime(const struct ini_file *file, const char **folder, char *why, size_t size)
{
	const struct ini_entry *entry = ini_file_find(file, "POKEYS", "RUNTIME_DIRECTORY");
	int length;

	if (!entry)
		return 0;
	length = snprintf(why, size, "%s:%u: [POKEYS]%s: ", file->path, entry->line, entry->key);
	if (length < 0 || (size_t)length >= size)
		return -EINVAL;
	*folder = entry->value;
	return runtime_check_directory(entry->value, why + length, size - (size_t)length) ?
		       -EINVAL :
		       0;
}
