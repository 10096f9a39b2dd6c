// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Lines are overwritten in place and cleared to their end, never the whole
 * screen at once: that is what flickers. The last row gets no newline, which
 * would scroll the first one away. Nothing is sent that a plain VT100 does not
 * know.
 *
 * Keys are taken one at a time, so the terminal is taken out of its line mode, and only
 * while we are in the foreground: a background job that touches it would be stopped.
 */
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>
#include "tools/screen.h"

enum { ROWS = 24, COLUMNS = 80, COLUMNS_MAX = 250 };

/* At each page, for somebody may have stopped us and gone on with us. */
static void take_keys(struct screen *screen)
{
	struct termios raw;

	if (!screen->keys || tcgetpgrp(STDIN_FILENO) != getpgrp())
		return;
	raw = screen->before;
	raw.c_lflag &= ~(tcflag_t)(ICANON | ECHO);
	raw.c_cc[VMIN] = 1;
	raw.c_cc[VTIME] = 0;
	tcsetattr(STDIN_FILENO, TCSANOW, &raw);
}

void screen_open(struct screen *screen)
{
	*screen = (struct screen){ .terminal = isatty(STDOUT_FILENO), .first = true };
	if (!screen->terminal)
		return;
	screen->keys = !tcgetattr(STDIN_FILENO, &screen->before);
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
		take_keys(screen);
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

static double seconds_now(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

/* One key; true if it is the one to leave by. A keyboard that has gone is not asked again. */
static bool leaves(struct screen *screen)
{
	char key;
	ssize_t length = read(STDIN_FILENO, &key, 1);

	if (length < 1)
		screen->keys = false;
	return length == 1 && (key == 'q' || key == 'Q');
}

bool screen_wait(struct screen *screen, double seconds, int signal_fd)
{
	const double until = seconds_now() + seconds;
	double left;

	while ((left = until - seconds_now()) > 0) {
		bool ours = screen->keys && tcgetpgrp(STDIN_FILENO) == getpgrp();
		struct pollfd fds[] = {
			{ .fd = signal_fd, .events = POLLIN },
			{ .fd = ours ? STDIN_FILENO : -1, .events = POLLIN },
			{ .fd = STDOUT_FILENO }, /* a pipe that nobody reads any more */
		};

		if (poll(fds, 3, (int)(left * 1000) + 1) <= 0)
			continue;
		screen->left = fds[2].revents;
		if (screen->left || fds[0].revents || (fds[1].revents && leaves(screen)))
			return true;
	}
	return false;
}

void screen_close(struct screen *screen)
{
	if (screen->keys && tcgetpgrp(STDIN_FILENO) == getpgrp())
		tcsetattr(STDIN_FILENO, TCSANOW, &screen->before);
	if (screen->terminal)
		fputs("\r\n\x1b[?25h", stdout);
	fflush(stdout);
}

int screen_signals(void)
{
	sigset_t set;

	sigemptyset(&set);
	sigaddset(&set, SIGINT);
	sigaddset(&set, SIGTERM);
	sigprocmask(SIG_BLOCK, &set, NULL);
	signal(SIGPIPE, SIG_IGN);
	return signalfd(-1, &set, SFD_CLOEXEC);
}
