// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The client's side of the handover, and the two functions that both sides
 * carry a message and a descriptor with.
 *
 * The other side is a process that may hang or end at any moment: every wait
 * has a limit, every message is checked whole, and a descriptor that comes
 * with a message that is not wanted is closed; of several one is taken in.
 */
#include <errno.h>
#include <poll.h>
#include <stdbool.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>
#include "daemon/transport/handover.h"

union carried {
	struct cmsghdr align;
	char room[CMSG_SPACE(sizeof(int))];
};

long handover_send(int connection, const void *message, unsigned long length, int fd)
{
	struct iovec body = { (void *)(unsigned long)message, length };
	union carried carried = { 0 };
	struct msghdr m = { .msg_iov = &body, .msg_iovlen = 1 };
	ssize_t sent;

	if (fd >= 0) {
		struct cmsghdr *c;

		m.msg_control = carried.room;
		m.msg_controllen = sizeof(carried.room);
		c = CMSG_FIRSTHDR(&m);
		c->cmsg_level = SOL_SOCKET;
		c->cmsg_type = SCM_RIGHTS;
		c->cmsg_len = CMSG_LEN(sizeof(fd));
		memcpy(CMSG_DATA(c), &fd, sizeof(fd));
	}
	do {
		sent = sendmsg(connection, &m, MSG_NOSIGNAL);
	} while (sent < 0 && errno == EINTR);
	return sent < 0 ? -errno : sent;
}

long handover_receive(int connection, void *message, unsigned long length, int *fd)
{
	struct iovec body = { message, length };
	union carried carried = { 0 };
	struct msghdr m = {
		.msg_iov = &body,
		.msg_iovlen = 1,
		/* not all of the room: its padding would take a second descriptor in */
		.msg_control = carried.room,
		.msg_controllen = CMSG_LEN(sizeof(*fd)),
	};
	ssize_t got;

	*fd = -1;
	do { /* a ring that was closed a moment ago interrupts as well */
		got = recvmsg(connection, &m, MSG_CMSG_CLOEXEC);
	} while (got < 0 && errno == EINTR);
	if (got < 0)
		return -errno;
	for (struct cmsghdr *c = CMSG_FIRSTHDR(&m); c; c = CMSG_NXTHDR(&m, c))
		if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SCM_RIGHTS &&
		    c->cmsg_len == CMSG_LEN(sizeof(*fd)))
			memcpy(fd, CMSG_DATA(c), sizeof(*fd));
	return got;
}

int handover_connect(const char *path, unsigned int limit_ms)
{
	const struct timeval limit = { limit_ms / 1000, (limit_ms % 1000) * 1000 };
	struct sockaddr_un at = { .sun_family = AF_UNIX };
	int fd;

	if (strlen(path) >= sizeof(at.sun_path))
		return -ENAMETOOLONG;
	strcpy(at.sun_path, path);
	fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
	if (fd < 0)
		return -errno;
	setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
	setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
	if (connect(fd, (struct sockaddr *)&at, sizeof(at)) < 0) {
		int rc = -errno;

		close(fd);
		return rc;
	}
	return fd;
}

/* Question and answer. 0 or -errno; *came is closed again unless all is well. */
static int exchange(int connection, const struct handover_request *request, int fd,
		    struct handover_answer *answer, int *came)
{
	long n = handover_send(connection, request, sizeof(*request), fd);

	*came = -1;
	if (n < 0)
		return (int)n;
	n = handover_receive(connection, answer, sizeof(*answer), came);
	if (n == (long)sizeof(*answer) && answer->version == HANDOVER_VERSION &&
	    answer->result == 0)
		return 0;
	if (*came >= 0)
		close(*came);
	*came = -1;
	if (n < 0)
		return n == -EAGAIN ? -ETIMEDOUT : (int)n;
	if (n != (long)sizeof(*answer) || answer->version != HANDOVER_VERSION)
		return n ? -EPROTO : -ECONNRESET;
	return answer->result < 0 ? answer->result : -EPROTO;
}

int handover_ask(int connection, __u32 index, int *fd)
{
	const struct handover_request request = {
		.version = HANDOVER_VERSION,
		.what = HANDOVER_ASK,
		.index = index,
	};
	struct handover_answer answer = { 0 };
	int rc = exchange(connection, &request, -1, &answer, fd);

	if (rc == 0 && *fd < 0)
		rc = -EPROTO;
	return rc;
}

int handover_join(int connection, __u32 index, __u32 queue, const __u16 port[HANDOVER_PORTS],
		  int fd)
{
	struct handover_request request = {
		.version = HANDOVER_VERSION,
		.what = HANDOVER_JOIN,
		.index = index,
		.queue = queue,
	};
	struct handover_answer answer = { 0 };
	int came, rc;

	memcpy(request.port, port, sizeof(request.port));
	rc = exchange(connection, &request, fd, &answer, &came);
	if (came >= 0)
		close(came);
	return rc;
}

_Bool handover_alive(int connection)
{
	struct pollfd p = { .fd = connection, .events = POLLIN };

	/* it says nothing unasked, so what is readable is its end */
	return poll(&p, 1, 0) == 0;
}
