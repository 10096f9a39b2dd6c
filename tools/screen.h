/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A terminal that is drawn again and again without flicker, or, if the output
 * is no terminal, one page after another.
 */
#ifndef TOOLS_SCREEN_H
#define TOOLS_SCREEN_H

#include <stdbool.h>
#include <stdio.h>

struct screen {
	bool terminal;
	unsigned int rows, columns, row;
	bool first;
};

void screen_open(struct screen *screen);
void screen_begin(struct screen *screen);

/* One line, cut to the width; lines below the last row are not drawn. */
void screen_line(struct screen *screen, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

void screen_end(struct screen *screen);
void screen_close(struct screen *screen);

#endif
