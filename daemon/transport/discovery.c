/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Discovery: an empty datagram to the broadcast address of each interface.
 *
 * Protocol section 1.9. Not to 255.255.255.255: that leaves through one
 * interface only, the one of the default route, where the machine's devices
 * rarely are. The loopback interface has no broadcast flag; 127.0.0.1 reaches
 * a simulator bound to it or to all addresses, 127.255.255.255 one that
 * listens for broadcasts, so both are asked. A device which hears the question
 * twice answers twice, and the caller has to live with that anyway, for a
 * machine may have two interfaces in one network.
 *
 * Answers are handed out raw: they are judged by those who know the format.
 */
#include <errno.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include <arpa/inet.h>
#include "daemon/transport/discovery.h"
#include "daemon/transport/stamp.h"

enum { DEFAULT_PORT = 20055, DEFAULT_TIMEOUT_MS = 500 };

static int open_socket(const char *interface)
{
	int on = 1, rc;
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_UDP);

	if (fd < 0)
		return -errno;
	rc = setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &on, sizeof on);
	if (rc == 0 && interface)
		rc = setsockopt(fd, SOL_SOCKET, SO_BINDTODEVICE, interface,
				(socklen_t)strlen(interface) + 1);
	if (rc < 0) {
		rc = -errno;
		close(fd);
		return rc;
	}
	return fd;
}

/* True if the question left. */
static bool ask(int fd, uint32_t address, uint16_t port)
{
	struct sockaddr_in to = {
		.sin_family = AF_INET,
		.sin_port = htons(port),
		.sin_addr.s_addr = htonl(address),
	};

	return sendto(fd, NULL, 0, 0, (struct sockaddr *)&to, sizeof to) == 0;
}

/* Ask on one address of one interface; returns how many questions left. */
static int ask_interface(int fd, const struct ifaddrs *i, uint16_t port)
{
	const struct sockaddr_in *broadcast = (const struct sockaddr_in *)(void *)i->ifa_broadaddr;

	if (i->ifa_flags & IFF_LOOPBACK)
		return ask(fd, INADDR_LOOPBACK, port) + ask(fd, 0x7fffffff, port);
	if (!(i->ifa_flags & IFF_BROADCAST) || !broadcast)
		return 0;
	return ask(fd, ntohl(broadcast->sin_addr.s_addr), port);
}

static int ask_interfaces(int fd, const struct discovery_options *options, uint16_t port)
{
	struct ifaddrs *all;
	int asked = 0;

	if (getifaddrs(&all) < 0)
		return -errno;
	for (struct ifaddrs *i = all; i; i = i->ifa_next) {
		if (!i->ifa_addr || i->ifa_addr->sa_family != AF_INET || !(i->ifa_flags & IFF_UP))
			continue;
		if (options->interface && strcmp(options->interface, i->ifa_name))
			continue;
		asked += ask_interface(fd, i, port);
	}
	freeifaddrs(all);
	return asked;
}

static int ask_all(int fd, const struct discovery_options *options)
{
	uint16_t port = options->port ? options->port : DEFAULT_PORT;
	int asked = ask_interfaces(fd, options, port);

	for (size_t i = 0; asked >= 0 && i < options->also_count; i++) {
		const struct transport_address *a = &options->also[i];

		asked += ask(fd, a->address, a->port ? a->port : port);
	}
	return asked == 0 ? -ENETUNREACH : asked;
}

/* One datagram, if there is one: 1, 0 (none), 2 (the caller has enough). */
static int take(int fd, discovery_found_t found, void *context)
{
	struct transport_address from;
	struct sockaddr_in source;
	socklen_t length = sizeof source;
	uint8_t data[TRANSPORT_PACKET_MAX];
	ssize_t n = recvfrom(fd, data, sizeof data, 0, (struct sockaddr *)&source, &length);

	if (n < 0 || length < sizeof source || source.sin_family != AF_INET)
		return 0;
	from.address = ntohl(source.sin_addr.s_addr);
	from.port = ntohs(source.sin_port);
	return found(context, data, (size_t)n, &from) ? 2 : 1;
}

static int collect(int fd, uint64_t end_ns, discovery_found_t found, void *context)
{
	int answers = 0;

	for (;;) {
		uint64_t now = stamp_now();
		struct pollfd p = { .fd = fd, .events = POLLIN };
		int rc;

		if (now >= end_ns)
			return answers;
		rc = poll(&p, 1, (int)((end_ns - now + 999999u) / 1000000u));
		if (rc < 0 && errno != EINTR)
			return -errno;
		if (rc <= 0)
			continue;
		rc = take(fd, found, context);
		answers += rc > 0;
		if (rc == 2)
			return answers;
	}
}

int discovery_search(const struct discovery_options *options, discovery_found_t found,
		     void *context)
{
	uint32_t timeout_ms = options->timeout_ms ? options->timeout_ms : DEFAULT_TIMEOUT_MS;
	int fd = open_socket(options->interface);
	int rc;

	if (fd < 0)
		return fd;
	rc = ask_all(fd, options);
	if (rc > 0)
		rc = collect(fd, stamp_now() + timeout_ms * UINT64_C(1000000), found, context);
	close(fd);
	return rc;
}
