/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A text under construction, in a buffer of fixed size. Any thread; cold. */
#ifndef SETTINGS_LINE_H
#define SETTINGS_LINE_H

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

struct line {
	char *text;
	size_t size, length;
};

/* Append; what does not fit is cut. */
static inline void put(struct line *line, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

static inline void put(struct line *line, const char *format, ...)
{
	const size_t room = line->size - line->length;
	va_list arguments;
	int n;

	va_start(arguments, format);
	n = vsnprintf(line->text + line->length, room, format, arguments);
	va_end(arguments);
	if (n > 0)
		line->length += (size_t)n < room ? (size_t)n : room - 1;
}

#endif
