// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * sd_notify(3)'s protocol, by ourselves: its own implementation waits when the
 * service manager does not read, and whoever waits here feeds no watchdog and
 * takes no SIGTERM. A datagram that does not fit is not sent; a state that was
 * not sent stays news and is tried again in the next round.
 *
 * READY is said once, with the first status, after the realtime loop has run
 * and the shared memory is published: whatever systemd starts after us finds a
 * daemon that works, though not necessarily a device that answers. A device
 * that is switched off must not keep the machine's others from starting.
 *
 * A status is sent only when it has changed, for each one wakes PID 1.
 */
#include <errno.h>
#include <stddef.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "daemon/control/notify.h"
#include "daemon/control/report.h"

static char last[REPORT_STATUS_SIZE];
static bool said_ready;

/* $NOTIFY_SOCKET: a path, or "@" and a name in the abstract namespace. 0 = there is none. */
static socklen_t address(struct sockaddr_un *to)
{
	const char *name = getenv("NOTIFY_SOCKET");
	size_t length = name ? strlen(name) : 0;

	if (length < 2 || length >= sizeof(to->sun_path) || (*name != '/' && *name != '@'))
		return 0;
	memset(to, 0, sizeof(*to));
	to->sun_family = AF_UNIX;
	memcpy(to->sun_path, name, length);
	if (*name == '@')
		to->sun_path[0] = '\0';
	return (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length + (*name == '/'));
}

/* True = nothing is left to do: it was sent, or nobody wants it. */
static bool tell(const char *text)
{
	struct sockaddr_un to;
	socklen_t length = address(&to);
	bool sent;
	int fd;

	if (!length)
		return true;
	fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (fd < 0)
		return false;
	sent = sendto(fd, text, strlen(text), MSG_NOSIGNAL, (const struct sockaddr *)&to, length) >=
	       0;
	close(fd);
	return sent;
}

/* A number in the environment; 0 if it is not one. */
static uint64_t number(const char *name)
{
	const char *text = getenv(name);
	char *end;
	unsigned long long value;

	if (!text || *text < '0' || *text > '9')
		return 0;
	errno = 0;
	value = strtoull(text, &end, 10);
	return *end || errno ? 0 : value;
}

uint64_t notify_watchdog_limit(void)
{
	uint64_t limit_us = number("WATCHDOG_USEC");

	if (getenv("WATCHDOG_PID") && number("WATCHDOG_PID") != (uint64_t)getpid())
		return 0;
	return limit_us < UINT64_MAX / 1000 ? limit_us * 1000 : 0;
}

void notify_status(const char *status)
{
	char text[sizeof(last) + 32];

	if (said_ready && !strncmp(last, status, sizeof(last) - 1))
		return;
	snprintf(text, sizeof(text), "%sSTATUS=%.*s", said_ready ? "" : "READY=1\n",
		 (int)sizeof(last) - 1, status);
	if (!tell(text))
		return;
	said_ready = true;
	snprintf(last, sizeof(last), "%s", status);
}

void notify_alive(void)
{
	tell("WATCHDOG=1");
}

void notify_stopping(void)
{
	tell("STOPPING=1\nSTATUS=bringing the devices to their safe state");
}
