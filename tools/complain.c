// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One line for a person. It is apart from main so that the parts which
 * complain can be linked without it.
 */
#include <stdarg.h>
#include <stdio.h>
#include "tools/pokeysctl.h"

void complain(const char *format, ...)
{
	va_list arguments;

	fputs("pokeysctl: ", stderr);
	va_start(arguments, format);
	vfprintf(stderr, format, arguments);
	va_end(arguments);
	fputc('\n', stderr);
}
