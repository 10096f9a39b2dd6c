/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A terminal that is drawn again and again without flicker, or, if the output
 * is no terminal, one page after another.
 */
#ifndef TOOLS_SCREEN_H
#define TOOLS_SCREEN_H

#include <stdbool.h>
#include <stdio.h>
#include <termios.h>

struct screen {
	bool terminal;
	unsigned int rows, columns, row;
	bool first;
	bool left;             /* nobody reads the output any more */
	bool keys;             /* the keyboard is ours: keys come at once, and are not shown */
	struct termios before; /* its settings, to be given back */
};

void screen_open(struct screen *screen);
void screen_begin(struct screen *screen);

/* One line, cut to the width; lines below the last row are not drawn. */
void screen_line(struct screen *screen, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

void screen_end(struct screen *screen);

/*
 * Wait for `seconds`, or until the user presses q, `signal_fd` (a signalfd, -1 = none) has a
 * signal, or nobody reads the output any more. True: the user wants to leave. Without a keyboard
 * no key counts.
 */
bool screen_wait(struct screen *screen, double seconds, int signal_fd);

void screen_close(struct screen *screen);

/*
 * From now on SIGINT and SIGTERM only come in at this signalfd (-1 = there is none), and SIGPIPE
 * is ignored.
 */
int screen_signals(void);

#endif
