/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One UDP socket per device, connected to it, so that the kernel drops what
 * comes from anybody else before it costs us anything.
 *
 * Five traps stand around connect():
 *  - a first connect() fixes the local address as well. Connecting again to a
 *    device on another network keeps the old one and goes nowhere; so the
 *    association is dissolved first (connect to AF_UNSPEC).
 *  - dissolving also takes away SO_BINDTODEVICE; it is set again.
 *  - neither empties the queue: packets of the old peer may still be in it.
 *    They are handed up with their true source, and the mailbox refuses them.
 *  - SO_BINDTODEVICE stands for the interface that had the name then. One that went
 *    and came back is another, so it is set at each aim, whatever the last one came to.
 *  - on an interface that has no address yet connect() takes 0.0.0.0 for ours and
 *    keeps it: nothing fails from then on, and nothing is answered. That is refused.
 */
#include <errno.h>
#include <string.h>
#include <unistd.h>
#include <arpa/inet.h>
#include "daemon/transport/udp.h"

enum { PORT_TRIES = 16 };

static int bind_interface(const struct udp *udp)
{
	if (!udp->interface[0])
		return 0;
	if (setsockopt(udp->fd, SOL_SOCKET, SO_BINDTODEVICE, udp->interface,
		       (socklen_t)strlen(udp->interface) + 1) < 0)
		return -errno;
	return 0;
}

static int set_up(struct udp *udp, const struct transport_options *options)
{
	int on = 1, poll_us = (int)options->busy_poll_us;

	if (options->interface) {
		if (strlen(options->interface) >= sizeof udp->interface)
			return -ENODEV;
		strcpy(udp->interface, options->interface);
	}
	if (setsockopt(udp->fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) < 0)
		return -errno;
	/* A wish: it wants CAP_NET_ADMIN, and without it all still works. */
	if (poll_us)
		setsockopt(udp->fd, SOL_SOCKET, SO_BUSY_POLL, &poll_us, sizeof poll_us);
	return bind_interface(udp);
}

/*
 * A port that stays when the association is dissolved. The kernel keeps one
 * only if it was asked for by its number, so a free one is found first.
 */
static int keep_port(const struct udp *udp)
{
	struct sockaddr_in any = { .sin_family = AF_INET };
	int rc = -EADDRINUSE;

	for (int i = 0; i < PORT_TRIES && rc == -EADDRINUSE; i++) {
		int other = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, IPPROTO_UDP);
		socklen_t size = sizeof any;

		if (other < 0)
			return -errno;
		any.sin_port = 0;
		rc = bind(other, (struct sockaddr *)&any, sizeof any) < 0 ||
				     getsockname(other, (struct sockaddr *)&any, &size) < 0 ?
			     -errno :
			     0;
		close(other);
		if (rc == 0 && bind(udp->fd, (struct sockaddr *)&any, sizeof any) < 0)
			rc = -errno;
	}
	return rc;
}

int udp_open(struct udp *udp, const struct transport_options *options)
{
	int rc;

	udp->connected = udp->aside = false;
	udp->interface[0] = '\0';
	udp->fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_UDP);
	if (udp->fd < 0) {
		udp->fd = -1;
		return -errno;
	}
	rc = set_up(udp, options);
	if (rc == 0 && options->keep_port)
		rc = keep_port(udp);
	if (rc < 0)
		udp_close(udp);
	return rc;
}

void udp_close(struct udp *udp)
{
	if (udp->fd >= 0)
		close(udp->fd);
	udp->fd = -1;
	udp->connected = udp->aside = false;
}

static int dissolve(struct udp *udp, uint64_t *calls)
{
	struct sockaddr nobody = { .sa_family = AF_UNSPEC };

	(*calls)++;
	if (connect(udp->fd, &nobody, sizeof nobody) < 0)
		return -errno;
	udp->connected = udp->aside = false;
	if (udp->interface[0])
		(*calls)++;
	return bind_interface(udp);
}

/* The route to the device leads elsewhere: two interfaces are in its network. */
static int bind_aside(struct udp *udp, uint16_t interface, uint64_t *calls)
{
	const int index = interface;

	if (!interface || udp->interface[0])
		return 0;
	(*calls)++;
	if (setsockopt(udp->fd, SOL_SOCKET, SO_BINDTOIFINDEX, &index, sizeof(index)) < 0)
		return -errno;
	udp->aside = true;
	return 0;
}

/* What connect() made our address, for whoever records packets. */
static void read_local(const struct udp *udp, struct transport_address *local, uint64_t *calls)
{
	struct sockaddr_in own;
	socklen_t length = sizeof own;

	(*calls)++;
	if (getsockname(udp->fd, (struct sockaddr *)&own, &length) < 0 || own.sin_family != AF_INET)
		return;
	local->address = ntohl(own.sin_addr.s_addr);
	local->port = ntohs(own.sin_port);
}

int udp_aim(struct udp *udp, const struct transport_address *to, struct transport_address *local,
	    uint64_t *calls)
{
	struct sockaddr_in peer = {
		.sin_family = AF_INET,
		.sin_port = htons(to->port),
		.sin_addr.s_addr = htonl(to->address),
	};
	int rc;

	*local = (struct transport_address){ 0 };
	if (udp->connected || udp->aside || udp->interface[0]) {
		rc = dissolve(udp, calls);
		if (rc < 0)
			return rc;
	}
	if (!to->address)
		return 0;
	rc = bind_aside(udp, to->interface, calls);
	if (rc < 0)
		return rc;
	(*calls)++;
	if (connect(udp->fd, (struct sockaddr *)&peer, sizeof peer) < 0)
		return -errno;
	udp->connected = true;
	read_local(udp, local, calls);
	return local->address ? 0 : -EADDRNOTAVAIL;
}

uint64_t udp_stamp(struct msghdr *message)
{
	for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c; c = CMSG_NXTHDR(message, c)) {
		struct timespec t;

		if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS)
			continue;
		if (c->cmsg_len < CMSG_LEN(sizeof t))
			continue;
		memcpy(&t, CMSG_DATA(c), sizeof t);
		return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
	}
	return 0;
}

void udp_source(const struct sockaddr_in *source, size_t length, struct transport_packet *out)
{
	out->address = 0;
	out->port = 0;
	if (length < sizeof *source || source->sin_family != AF_INET)
		return;
	out->address = ntohl(source->sin_addr.s_addr);
	out->port = ntohs(source->sin_port);
}
