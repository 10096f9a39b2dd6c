// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Ways with a plain socket.
 *
 *   blocking  sendto, select, recvfrom, one question after the other: what the
 *             vendor's library does
 *   sleeping  all questions at once, then poll and recv
 *   spinning  all at once, then recv in a tight loop: the least that a socket
 *             can cost
 *   batching  the same with sendmmsg and recvmmsg: few system calls
 */
#include <poll.h>
#include <sys/select.h>
#include <sys/socket.h>
#include "bench/client.h"

static const char *nothing(struct client *c)
{
	(void)c;
	return NULL;
}

/* Whether the answer came; what was given up before and comes now is not it. */
static bool blocking_await(struct client *c, int i)
{
	struct timeval limit = { .tv_usec = CLIENT_TIMEOUT_NS / 1000 };
	uint8_t packet[ASK_PACKET * 2];
	ssize_t length;
	fd_set set;

	do {
		FD_ZERO(&set);
		FD_SET(c->fd, &set);
		if (select(c->fd + 1, &set, NULL, NULL, &limit) != 1)
			return false;
		length = recvfrom(c->fd, packet, sizeof(packet), 0, NULL, NULL);
	} while (ask_match(&c->ask, packet, length) != i);
	return true;
}

static void blocking(struct client *c)
{
	for (int i = 0; i < c->ask.count; i++) {
		uint64_t begin = client_now();

		ask_stamp(&c->ask, i);
		c->open |= 1u << i;
		if (sendto(c->fd, c->ask.question[i], ASK_PACKET, 0, NULL, 0) != ASK_PACKET ||
		    !blocking_await(c, i))
			return;
		c->open &= ~(1u << i);
		if (i == c->ask.count - 1)
			samples_add(&c->newest, client_now() - begin);
	}
}

static void send_all(struct client *c)
{
	client_stamp_all(c);
	for (int i = 0; i < c->ask.count; i++)
		send(c->fd, c->ask.question[i], ASK_PACKET, MSG_DONTWAIT);
}

static void receive_one(struct client *c)
{
	uint8_t packet[ASK_PACKET * 2];
	ssize_t length = recv(c->fd, packet, sizeof(packet), MSG_DONTWAIT);

	client_take(c, packet, length);
}

static void sleeping(struct client *c)
{
	send_all(c);
	while (c->open && !client_late(c)) {
		struct pollfd p = { .fd = c->fd, .events = POLLIN };

		poll(&p, 1, (int)(CLIENT_TIMEOUT_NS / 1000000));
		receive_one(c);
	}
}

static void spinning(struct client *c)
{
	send_all(c);
	while (c->open && !client_late(c))
		receive_one(c);
}

static void batching(struct client *c)
{
	static uint8_t packet[ASK_MAX][ASK_PACKET * 2];
	struct mmsghdr out[ASK_MAX] = { 0 }, in[ASK_MAX] = { 0 };
	struct iovec from[ASK_MAX], to[ASK_MAX];

	for (int i = 0; i < c->ask.count; i++) {
		from[i] = (struct iovec){ c->ask.question[i], ASK_PACKET };
		out[i].msg_hdr = (struct msghdr){ .msg_iov = &from[i], .msg_iovlen = 1 };
		to[i] = (struct iovec){ packet[i], sizeof(packet[i]) };
		in[i].msg_hdr = (struct msghdr){ .msg_iov = &to[i], .msg_iovlen = 1 };
	}
	client_stamp_all(c);
	sendmmsg(c->fd, out, (unsigned int)c->ask.count, MSG_DONTWAIT);
	while (c->open && !client_late(c)) {
		int n = recvmmsg(c->fd, in, ASK_MAX, MSG_DONTWAIT, NULL);

		for (int i = 0; i < n; i++)
			client_take(c, packet[i], (ssize_t)in[i].msg_len);
	}
}

const struct client_way client_socket_ways[] = {
	{ "blocking", false, nothing, blocking },
	{ "sleeping", false, nothing, sleeping },
	{ "spinning", true, nothing, spinning },
	{ "batching", true, nothing, batching },
	{ 0 },
};
