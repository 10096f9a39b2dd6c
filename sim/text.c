// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Bounded text. A reply of the control socket is built with it: too long a
 * one loses lines at its end, never a part of a line, so what a script parses
 * is always what it looks like.
 */
#include "sim/text.h"

#include <stdio.h>

void sim_text_init(struct sim_text *text, char *buffer, size_t size)
{
	text->at = buffer;
	text->size = size;
	text->used = 0;
	buffer[0] = '\0';
}

void sim_text_vadd(struct sim_text *text, const char *format, va_list args)
{
	size_t room = text->size - text->used;
	int len = vsnprintf(text->at + text->used, room, format, args);

	if (len < 0 || (size_t)len >= room)
		text->at[text->used] = '\0';
	else
		text->used += (size_t)len;
}

void sim_text_add(struct sim_text *text, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	sim_text_vadd(text, format, args);
	va_end(args);
}
