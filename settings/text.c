// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Keys of the device's settings and keys that are the daemon's own stand in one file, so
 * a number that is one in the one key has to be one in the next.
 */
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "settings/text.h"

const char settings_not_allowed[] = "is not allowed";
const char settings_out_of_range[] = "is out of range";

const struct settings_word *settings_find_word(const struct settings_word *words, const char *text)
{
	for (const struct settings_word *word = words; word && word->name; word++)
		if (!strcmp(word->name, text))
			return word;
	return NULL;
}

const char *settings_whole(const char *text, double minimum, double maximum, int64_t *out)
{
	const bool negative = *text == '-';
	const size_t digits = strspn(text + negative, "0123456789");

	if (!digits || text[digits + negative] || maximum < minimum)
		return settings_not_allowed;
	errno = 0;
	*out = strtoll(text, NULL, 10);
	if (errno || (double)*out < minimum || (double)*out > maximum)
		return settings_out_of_range;
	return NULL;
}

const char *settings_real(const char *text, double minimum, double maximum, double *out)
{
	char *end;

	if (!*text || *text == '+' || text[strspn(text, "0123456789.eE+-")])
		return "is not a number";
	*out = strtod(text, &end);
	if (*end || end == text)
		return "is not a number";
	if (!isfinite(*out) || *out < minimum || *out > maximum)
		return settings_out_of_range;
	return NULL;
}

size_t settings_append(char *text, size_t size, size_t at, const char *format, ...)
{
	va_list arguments;
	int length;

	va_start(arguments, format);
	length = vsnprintf(text + at, size - at, format, arguments);
	va_end(arguments);
	at += length > 0 ? (size_t)length : 0;
	return at < size ? at : size - 1;
}
