// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The control thread feeds the watchdog, so it must not be stopped by whoever
 * reads its messages: a pager that sleeps on the other end of a pipe, a
 * terminal after ^S, a journal that is gone. O_NONBLOCK is no way out, it
 * belongs to the open file and would change it for the shell that started us.
 * A socket takes MSG_DONTWAIT; a pipe that poll() calls writable has room for
 * a page, and a line is shorter than that.
 */
#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>
#include "daemon/control/log.h"

enum { LINE_SIZE = 1024 };

static struct {
	const char *program;
	int fd, level;
	bool journal, socket;
	uint64_t dropped, told;
} self = { .program = "pokeysd", .fd = STDERR_FILENO, .level = 6 };

static bool is_journal(const struct stat *st)
{
	const char *stream = getenv("JOURNAL_STREAM");
	unsigned long long device, inode;

	return stream && sscanf(stream, "%llu:%llu", &device, &inode) == 2 &&
	       device == (unsigned long long)st->st_dev && inode == (unsigned long long)st->st_ino;
}

void log_program(const char *name)
{
	self.program = name;
}

void log_open(int fd, int level)
{
	struct stat st = { 0 };

	self.fd = fd;
	self.level = level;
	if (fstat(fd, &st) == 0) {
		self.journal = is_journal(&st);
		self.socket = S_ISSOCK(st.st_mode);
	}
}

/* All of it at once, or not. */
static bool put(const char *text, size_t length)
{
	struct pollfd ready = { .fd = self.fd, .events = POLLOUT };

	if (self.socket)
		return send(self.fd, text, length, MSG_DONTWAIT | MSG_NOSIGNAL) == (ssize_t)length;
	if (poll(&ready, 1, 0) != 1 || !(ready.revents & POLLOUT))
		return false;
	return write(self.fd, text, length) == (ssize_t)length;
}

/* The text of a line is one line, whatever was printed into it. */
static size_t finish(char *line, size_t length)
{
	if (length > LINE_SIZE - 2)
		length = LINE_SIZE - 2;
	for (size_t i = 0; i < length; i++)
		if ((unsigned char)line[i] < 0x20 || line[i] == 0x7f)
			line[i] = '?';
	line[length] = '\n';
	return length + 1;
}

void log_line(int level, const char *format, ...)
{
	char line[LINE_SIZE];
	size_t at = 0;
	va_list arguments;
	int length;

	if (level > self.level)
		return;
	if (self.journal)
		at = (size_t)snprintf(line, sizeof(line), "<%d>", level);
	else
		at = (size_t)snprintf(line, sizeof(line), "%s: ", self.program);
	if (self.dropped != self.told)
		at += (size_t)snprintf(line + at, sizeof(line) - at, "(%llu messages lost) ",
				       (unsigned long long)(self.dropped - self.told));
	va_start(arguments, format);
	length = vsnprintf(line + at, sizeof(line) - at, format, arguments);
	va_end(arguments);
	if (put(line, finish(line, at + (length > 0 ? (size_t)length : 0))))
		self.told = self.dropped;
	else
		self.dropped++;
}

uint64_t log_dropped(void)
{
	return self.dropped;
}

bool log_permit(struct log_limit *limit, uint64_t now_ns, uint32_t *held)
{
	*held = 0;
	if (!limit->start_ns || now_ns - limit->start_ns >= LOG_WHILE_NS) {
		*held = limit->held;
		limit->start_ns = now_ns;
		limit->passed = 0;
		limit->held = 0;
	}
	if (limit->passed < LOG_BURST) {
		limit->passed++;
		return true;
	}
	limit->held++;
	return false;
}
