// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One request and its answer, each one packet (SOCK_SEQPACKET): there is
 * nothing to assemble, and an answer that was cut off cannot be taken for a
 * whole one. "ok ..." or "refused ..." and then words for a person.
 */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "shm/runtime.h"
#include "tools/order.h"
#include "tools/probe.h"

enum { ANSWER_MS = 10000 };

static int attach(const char *runtime_directory, char text[ORDER_TEXT_MAX])
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
	int length = snprintf(address.sun_path, sizeof(address.sun_path), "%s/control",
			      runtime_directory);
	int error;

	if (fd >= 0 && length < (int)sizeof(address.sun_path) &&
	    !connect(fd, (const struct sockaddr *)&address, sizeof(address)))
		return fd;
	error = fd < 0 ? errno : length >= (int)sizeof(address.sun_path) ? ENAMETOOLONG : errno;
	if (fd >= 0)
		close(fd);
	if (error == ENOENT || error == ECONNREFUSED)
		snprintf(text, ORDER_TEXT_MAX,
			 "no daemon takes orders in %s; start it (systemctl "
			 "start pokeysd), or name another folder with --runtime-directory",
			 runtime_directory);
	else if (error == EACCES)
		runtime_denied(runtime_directory, text, ORDER_TEXT_MAX);
	else
		snprintf(text, ORDER_TEXT_MAX, "%s: %s", address.sun_path, strerror(error));
	return -error;
}

static int take_answer(int fd, char text[ORDER_TEXT_MAX])
{
	struct pollfd poll_fd = { .fd = fd, .events = POLLIN };
	char answer[ORDER_TEXT_MAX];
	ssize_t length = -1;

	if (poll(&poll_fd, 1, ANSWER_MS) > 0)
		length = recv(fd, answer, sizeof(answer) - 1, 0);
	if (length <= 0) {
		snprintf(text, ORDER_TEXT_MAX,
			 "the daemon did not answer%s; its journal may say "
			 "more (journalctl -u pokeysd)",
			 length ? " in time" : ", it ended");
		return -ETIMEDOUT;
	}
	answer[length] = '\0';
	if (!strncmp(answer, "ok ", 3)) {
		memcpy(text, answer + 3, (size_t)length - 2);
		return 0;
	}
	snprintf(text, ORDER_TEXT_MAX, "%s", strncmp(answer, "refused ", 8) ? answer : answer + 8);
	return -EPERM;
}

int order_give(const char *runtime_directory, const char *verb, const char *device,
	       char text[ORDER_TEXT_MAX])
{
	char request[128];
	int length = snprintf(request, sizeof(request), "config %s %s", verb, device);
	int fd, result;

	if (length >= (int)sizeof(request)) {
		snprintf(text, ORDER_TEXT_MAX, "there is no device of so long a name");
		return -EINVAL;
	}
	fd = attach(runtime_directory, text);
	if (fd < 0)
		return fd;
	if (send(fd, request, (size_t)length, MSG_NOSIGNAL) == length) {
		result = take_answer(fd, text);
	} else {
		result = -errno;
		snprintf(text, ORDER_TEXT_MAX, "the daemon takes no order: %s", strerror(errno));
	}
	close(fd);
	return result;
}

/* As its lock says, if it lives: whoever may not give orders may be allowed to read that. */
static int named_in_lock(const char *runtime_directory)
{
	char path[128], text[32] = "";
	int process = 0;
	int fd;

	snprintf(path, sizeof(path), "%s/lock", runtime_directory);
	fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	if (fd < 0)
		return 0;
	if (read(fd, text, sizeof(text) - 1) > 0)
		process = atoi(text);
	close(fd);
	return process > 0 && probe_text("", text, sizeof(text), "/proc/%d/comm", process) &&
			       !strcmp(text, "pokeysd") ?
		       process :
		       0;
}

int order_daemon(const char *runtime_directory)
{
	struct ucred who = { 0 };
	socklen_t size = sizeof(who);
	char text[ORDER_TEXT_MAX];
	int fd = attach(runtime_directory, text);

	if (fd < 0)
		return named_in_lock(runtime_directory);
	if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &who, &size))
		who.pid = 0;
	close(fd);
	return who.pid;
}
