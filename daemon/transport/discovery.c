/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Discovery: an empty datagram to whoever hears a broadcast, at each address of each
 * interface (protocol section 1.9).
 *
 * The kernel's route would choose one interface for 255.255.255.255, and one of two that
 * are in the same network. So each question names its interface and the address it comes
 * from (IP_PKTINFO). It goes to the broadcast address of that network, and to
 * 255.255.255.255, because a device with another mask has another broadcast address.
 *
 * The loopback interface has no broadcast flag; 127.0.0.1 reaches a simulator bound to it
 * or to all addresses, 127.255.255.255 one that listens for broadcasts, so both are asked.
 * A device which hears the question twice answers twice, and the caller has to live with
 * that anyway, for a machine may have two interfaces in one network.
 *
 * Answers are handed out raw: they are judged by those who know the format.
 */
#include <errno.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include <arpa/inet.h>
#include "daemon/transport/addresses.h"
#include "daemon/transport/discovery.h"
#include "daemon/transport/overhear.h"
#include "daemon/transport/stamp.h"

enum { DEFAULT_PORT = 20055, DEFAULT_TIMEOUT_MS = 500, SEEN_MAX = 256 };

/* Addresses, each once. */
struct seen {
	int count;
	uint32_t address[SEEN_MAX];
};

struct search {
	int fd;
	int wire; /* what comes in before the firewall; -errno */
	int count;
	struct own_address own[ADDRESSES_OWN_MAX];
	struct seen heard, on_the_wire;
	struct discovery_report *report;
};

static bool has_seen(const struct seen *seen, uint32_t address)
{
	for (int i = 0; i < seen->count; i++)
		if (seen->address[i] == address)
			return true;
	return false;
}

static void see(struct seen *seen, uint32_t address)
{
	if (seen->count < SEEN_MAX && !has_seen(seen, address))
		seen->address[seen->count++] = address;
}

static int open_socket(const char *interface)
{
	const struct sockaddr_in any = { .sin_family = AF_INET }; /* at a port from now on */
	int on = 1, rc;
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_UDP);

	if (fd < 0)
		return -errno;
	rc = setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &on, sizeof on);
	if (rc == 0)
		rc = setsockopt(fd, IPPROTO_IP, IP_PKTINFO, &on, sizeof on);
	if (rc == 0 && interface)
		rc = setsockopt(fd, SOL_SOCKET, SO_BINDTODEVICE, interface,
				(socklen_t)strlen(interface) + 1);
	if (rc == 0)
		rc = bind(fd, (const struct sockaddr *)&any, sizeof(any));
	if (rc < 0) {
		rc = -errno;
		close(fd);
		return rc;
	}
	return fd;
}

/* 0 if the question left, or -errno. `from` is NULL where the route decides. */
static int ask(int fd, uint32_t address, uint16_t port, const struct own_address *from)
{
	struct sockaddr_in to = {
		.sin_family = AF_INET,
		.sin_port = htons(port),
		.sin_addr.s_addr = htonl(address),
	};
	struct in_pktinfo info = { 0 };
	_Alignas(struct cmsghdr) char control[CMSG_SPACE(sizeof(info))] = { 0 };
	struct msghdr message = { .msg_name = &to, .msg_namelen = sizeof(to) };
	struct cmsghdr *head = (void *)control;

	if (from) {
		info.ipi_ifindex = (int)from->interface;
		info.ipi_spec_dst.s_addr = htonl(from->address);
		head->cmsg_level = IPPROTO_IP;
		head->cmsg_type = IP_PKTINFO;
		head->cmsg_len = CMSG_LEN(sizeof(info));
		memcpy(CMSG_DATA(head), &info, sizeof(info));
		message.msg_control = control;
		message.msg_controllen = sizeof(control);
	}
	return sendmsg(fd, &message, 0) < 0 ? -errno : 0;
}

/* Ask at one address; 0 if a question left, or -errno. */
static int ask_at(int fd, const struct own_address *own, uint16_t port)
{
	int directed, limited;

	if (own->loopback) {
		directed = ask(fd, INADDR_LOOPBACK, port, NULL);
		limited = ask(fd, 0x7fffffff, port, NULL);
	} else if (!own->broadcasts) {
		return -EOPNOTSUPP;
	} else {
		limited = ask(fd, INADDR_BROADCAST, port, own);
		directed = own->broadcast ? ask(fd, own->broadcast, port, own) : limited;
	}
	return directed && limited ? limited : 0;
}

static void note(struct discovery_report *report, const struct own_address *own, int error)
{
	if (report && !own->loopback)
		report->network[report->networks++] = (struct discovery_network){
			.own = *own,
			.error = error,
		};
}

/* Returns at how many addresses it was asked. */
static int ask_all(const struct search *search, const struct discovery_options *options)
{
	uint16_t port = options->port ? options->port : DEFAULT_PORT;
	int asked = 0;

	for (int i = 0; i < search->count; i++) {
		const int error = ask_at(search->fd, &search->own[i], port);

		note(search->report, &search->own[i], error);
		asked += !error;
	}
	for (size_t i = 0; i < options->also_count; i++) {
		const struct transport_address *a = &options->also[i];

		asked += !ask(search->fd, a->address, a->port ? a->port : port, NULL);
	}
	return asked == 0 ? -ENETUNREACH : asked;
}

/* Where this answer was sent to, and came in. */
static struct in_pktinfo arrival(struct msghdr *message)
{
	struct in_pktinfo info = { 0 };

	for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c; c = CMSG_NXTHDR(message, c))
		if (c->cmsg_level == IPPROTO_IP && c->cmsg_type == IP_PKTINFO)
			memcpy(&info, CMSG_DATA(c), sizeof(info));
	return info;
}

/* Our address on the way to a device, as its route has it; 0 = there is none. */
static uint32_t routed_from(const struct sockaddr_in *device)
{
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, IPPROTO_UDP);
	struct sockaddr_in own = { 0 };
	socklen_t length = sizeof(own);

	if (fd < 0)
		return 0;
	if (connect(fd, (const struct sockaddr *)device, sizeof(*device)) < 0 ||
	    getsockname(fd, (struct sockaddr *)&own, &length) < 0)
		own.sin_addr.s_addr = 0;
	close(fd);
	return ntohl(own.sin_addr.s_addr);
}

static bool is_near(const struct own_address *own, uint32_t device)
{
	const uint32_t mask = own->prefix ? UINT32_MAX << (32 - own->prefix) : 0;

	return !own->loopback && ((own->address ^ device) & mask) == 0;
}

/*
 * The interface that has to be named to reach this device. None, if it has answered the address
 * that its route has for ours: that way works, at whichever of two interfaces in one network
 * the answer came in. Nor for a device beyond a router, to which only the route leads.
 */
static uint16_t interface_to(const struct search *search, const struct sockaddr_in *device,
			     const struct in_pktinfo *arrival)
{
	const uint32_t to = ntohl(arrival->ipi_addr.s_addr);

	if (to == routed_from(device))
		return 0;
	for (int i = 0; i < search->count; i++) {
		const struct own_address *own = &search->own[i];

		if (own->address == to && own->interface <= UINT16_MAX &&
		    is_near(own, ntohl(device->sin_addr.s_addr)))
			return (uint16_t)own->interface;
	}
	return 0;
}

/* One datagram, if there is one: 1, 0 (none), 2 (the caller has enough). */
static int take(struct search *search, discovery_found_t found, void *context)
{
	_Alignas(struct cmsghdr) char control[CMSG_SPACE(sizeof(struct in_pktinfo))];
	uint8_t data[TRANSPORT_PACKET_MAX];
	struct sockaddr_in source = { 0 };
	struct iovec part = { .iov_base = data, .iov_len = sizeof(data) };
	struct msghdr message = {
		.msg_name = &source,
		.msg_namelen = sizeof(source),
		.msg_iov = &part,
		.msg_iovlen = 1,
		.msg_control = control,
		.msg_controllen = sizeof(control),
	};
	const ssize_t n = recvmsg(search->fd, &message, 0);
	struct transport_address from;
	struct in_pktinfo info;

	if (n < 0 || message.msg_namelen < sizeof(source) || source.sin_family != AF_INET)
		return 0;
	info = arrival(&message);
	from = (struct transport_address){
		.address = ntohl(source.sin_addr.s_addr),
		.port = ntohs(source.sin_port),
		.interface = interface_to(search, &source, &info),
	};
	see(&search->heard, from.address);
	return found(context, data, (size_t)n, &from) ? 2 : 1;
}

static int collect(struct search *search, uint64_t end_ns, discovery_found_t found, void *context)
{
	int answers = 0;

	for (;;) {
		uint64_t now = stamp_now();
		struct pollfd p[] = {
			{ .fd = search->fd, .events = POLLIN },
			{ .fd = search->wire, .events = POLLIN }, /* negative: passed over */
		};
		uint32_t from;
		int rc;

		if (now >= end_ns)
			break;
		rc = poll(p, 2, (int)((end_ns - now + 999999u) / 1000000u));
		if (rc < 0 && errno != EINTR)
			return -errno;
		if (p[1].revents && overhear_take(search->wire, &from))
			see(&search->on_the_wire, from);
		if (rc <= 0 || !p[0].revents)
			continue;
		rc = take(search, found, context);
		answers += rc > 0;
		if (rc == 2)
			return answers;
	}
	/* what came just before the end was seen on the wire already */
	for (int i = 0; i < SEEN_MAX && take(search, found, context) == 1; i++)
		answers++;
	return answers;
}

static void begin_report(struct search *search, const struct discovery_options *options)
{
	struct discovery_report *report = options->report;
	struct sockaddr_in own = { 0 };
	socklen_t length = sizeof(own);

	memset(report, 0, sizeof(*report));
	search->report = report;
	if (!getsockname(search->fd, (struct sockaddr *)&own, &length))
		report->port = ntohs(own.sin_port);
	if (options->overhear)
		search->wire = overhear_open(options->port ? options->port : DEFAULT_PORT,
					     report->port);
	report->overheard = search->wire >= 0;
}

static void end_report(struct search *search)
{
	struct discovery_report *report = search->report;

	for (int i = 0; i < search->on_the_wire.count; i++) {
		const uint32_t from = search->on_the_wire.address[i];

		if (!has_seen(&search->heard, from) && report->unheard < DISCOVERY_UNHEARD)
			report->unheard_from[report->unheard++] = from;
	}
	if (search->wire >= 0)
		close(search->wire);
}

int discovery_search(const struct discovery_options *options, discovery_found_t found,
		     void *context)
{
	uint32_t timeout_ms = options->timeout_ms ? options->timeout_ms : DEFAULT_TIMEOUT_MS;
	struct search search = { .fd = open_socket(options->interface), .wire = -1 };
	int rc;

	if (search.fd < 0)
		return search.fd;
	if (options->report)
		begin_report(&search, options);
	search.count = addresses_own(search.own, ADDRESSES_OWN_MAX,
				     options->interface ? if_nametoindex(options->interface) : 0);
	rc = search.count < 0 ? search.count : ask_all(&search, options);
	if (rc > 0)
		rc = collect(&search, stamp_now() + timeout_ms * UINT64_C(1000000), found, context);
	if (options->report)
		end_report(&search);
	close(search.fd);
	return rc;
}
