// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Lines are overwritten in place and cleared to their end, never the whole
 * screen at once: that is what flickers. The last row gets no newline, which
 * would scroll the first one away. Nothing is sent that a plain VT100 does not
 * know.
 */
#include <stdarg.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include "tools/screen.h"

enum { ROWS = 24, COLUMNS = 80, COLUMNS_MAX = 250 };

void screen_open(struct screen *screen)
{
	*screen = (struct screen){ .terminal = isatty(STDOUT_FILENO), .first = true };
	if (screen->terminal)
		fputs("\x1b[?25l\x1b[2J", stdout);
}

void screen_begin(struct screen *screen)
{
	struct winsize size = { 0 };

	screen->rows = 1000;
	screen->columns = COLUMNS_MAX;
	if (screen->terminal) {
		bool known = !ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) && size.ws_row && size.ws_col;

		screen->rows = known ? size.ws_row : ROWS;
		screen->columns = known && size.ws_col < COLUMNS_MAX ? size.ws_col : COLUMNS;
		fputs("\x1b[H", stdout);
	} else if (!screen->first) {
		fputc('\n', stdout);
	}
	screen->first = false;
	screen->row = 0;
}

void screen_line(struct screen *screen, const char *format, ...)
{
	char text[COLUMNS_MAX + 1];
	va_list arguments;

	if (screen->row >= screen->rows)
		return;
	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	for (char *c = text; *c; c++)
		if ((unsigned char)*c < 0x20 || (unsigned char)*c >= 0x7f)
			*c = '?';
	if (strlen(text) > screen->columns)
		text[screen->columns] = '\0';
	if (screen->terminal)
		printf("%s%s\x1b[K", screen->row ? "\r\n" : "", text);
	else
		puts(text);
	screen->row++;
}

void screen_end(struct screen *screen)
{
	if (screen->terminal)
		fputs("\x1b[J", stdout);
	fflush(stdout);
}

void screen_close(struct screen *screen)
{
	if (screen->terminal)
		fputs("\r\n\x1b[?25h", stdout);
	fflush(stdout);
}
