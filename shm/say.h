/* SPDX-License-Identifier: MIT */
/* One line for a person, beside the number for the program. */
#ifndef SHM_SAY_H
#define SHM_SAY_H

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

/* Write the line (if there is room for one) and hand `code` through. */
static inline int say(char *why, size_t size, int code, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

static inline int say(char *why, size_t size, int code, const char *format, ...)
{
	va_list arguments;

	if (!why || !size)
		return code;
	va_start(arguments, format);
	vsnprintf(why, size, format, arguments);
	va_end(arguments);
	return code;
}

#endif
