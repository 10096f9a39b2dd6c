// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * /proc and /sys, read through a root so that a test can show this program a
 * machine that nobody has, and so that a user's machine can be judged from a
 * copy. Files there are short and change in between; each is read once and
 * whole, and a file that is away or forbidden is no value, never a zero: a
 * check that takes "could not see" for "off" would call a bad machine good.
 */
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "tools/probe.h"

static bool read_whole(const char *path, char *text, size_t size)
{
	FILE *from = fopen(path, "re");
	size_t length;
	bool good;

	text[0] = '\0';
	if (!from)
		return false;
	length = fread(text, 1, size - 1, from);
	good = !ferror(from);
	fclose(from);
	while (length && text[length - 1] == '\n')
		length--;
	text[length] = '\0';
	return good;
}

bool probe_text(const char *root, char *text, size_t size, const char *format, ...)
{
	char path[512];
	va_list arguments;
	int length = snprintf(path, sizeof(path), "%s", root);

	text[0] = '\0';
	if (length < 0 || length >= (int)sizeof(path))
		return false;
	va_start(arguments, format);
	vsnprintf(path + length, sizeof(path) - (size_t)length, format, arguments);
	va_end(arguments);
	return read_whole(path, text, size);
}

bool probe_exists(const char *root, const char *format, ...)
{
	char path[256], whole[512];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(path, sizeof(path), format, arguments);
	va_end(arguments);
	return snprintf(whole, sizeof(whole), "%s%s", root, path) < (int)sizeof(whole) &&
	       access(whole, F_OK) == 0;
}

bool probe_number(const char *root, long *value, const char *format, ...)
{
	char path[256], text[64], *end;
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(path, sizeof(path), format, arguments);
	va_end(arguments);
	if (!probe_text(root, text, sizeof(text), "%s", path))
		return false;
	*value = strtol(text, &end, 0);
	return end != text;
}

/* The next "a", "a-b" or "a-N" (the last one) of a list; false at its end or in no list. */
static bool next_range(const char **list, long *first, long *last)
{
	char *end;

	*first = strtol(*list, &end, 10);
	if (end == *list)
		return false;
	*last = *first;
	if (end[0] == '-' && end[1] == 'N') {
		*last = LONG_MAX;
		end += 2;
	} else if (*end == '-') {
		*last = strtol(end + 1, &end, 10);
	}
	*list = end + (*end == ',');
	return true;
}

bool probe_list_has(const char *list, int cpu)
{
	long first, last;

	while (next_range(&list, &first, &last))
		if (cpu >= first && cpu <= last)
			return true;
	return false;
}

bool probe_list_has_above(const char *list, int cpu)
{
	long first, last;

	while (next_range(&list, &first, &last))
		if (last > cpu)
			return true;
	return false;
}

int probe_list_other(const char *list, int cpu)
{
	long first, last;

	while (next_range(&list, &first, &last)) {
		if (first != cpu)
			return (int)first;
		if (last > first)
			return (int)first + 1;
	}
	return -1;
}

bool probe_command_line(const char *root, const char *name, char *value, size_t size)
{
	char line[PROBE_TEXT], *rest = line, *word;
	size_t length = strlen(name);
	bool found = false;

	if (!probe_text(root, line, sizeof(line), "/proc/cmdline"))
		return false;
	while ((word = strsep(&rest, " "))) {
		if (strncmp(word, name, length) != 0 || (word[length] && word[length] != '='))
			continue;
		snprintf(value, size, "%s", word[length] ? word + length + 1 : "");
		found = true;
	}
	return found;
}

bool probe_line(const char *text, const char *name, char *value, size_t size)
{
	size_t length = strlen(name);

	for (; text; text = strchr(text, '\n')) {
		text += *text == '\n';
		if (strncmp(text, name, length) != 0)
			continue;
		text += length;
		text += strspn(text, ": \t");
		snprintf(value, size, "%.*s", (int)strcspn(text, "\n"), text);
		return true;
	}
	return false;
}

int probe_virtual(const char *root)
{
	char text[PROBE_TEXT], value[PROBE_TEXT];

	if (probe_text(root, text, sizeof(text), "/sys/hypervisor/type"))
		return 1;
	if (!probe_text(root, text, sizeof(text), "/proc/cpuinfo"))
		return -1;
	return probe_line(text, "flags", value, sizeof(value)) && strstr(value, " hypervisor");
}
