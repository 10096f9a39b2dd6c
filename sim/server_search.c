// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Being found (protocol sections 1.9 and 7.1): an empty datagram to the port,
 * broadcast or not, is a search, and is answered from the device's own
 * address. So is a broadcast of anything that is shorter than a frame: there are
 * clients which put some words into theirs.
 *
 * A socket bound to one address does not receive broadcasts, so there is a
 * second one on 0.0.0.0. SO_REUSEADDR lets every simulator on the machine have
 * one, and the kernel gives each of them a copy of a broadcast. It takes no
 * unicast packet from anybody who has bound the address it is for, and only
 * searches are taken from it at all.
 *
 * The vendor's library searches on the loopback interface by a unicast packet
 * to 127.0.0.1, since that is what the system tells as broadcast address of
 * `lo`. It reaches one socket only: that of the device at 127.0.0.1, or else
 * one of the wildcards. Whoever gets it passes it on to 127.255.255.255 for
 * all others, with the address of who asked. So all simulators are found,
 * wherever in 127/8 they live.
 *
 * A device in 127/8 answers hosts in 127/8 only, and one elsewhere only hosts
 * elsewhere: a search on a real network must not find simulators.
 */
#include "sim/server.h"

#include <arpa/inet.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static const char passed_on[8] = { 'P', 'K', 'S', 'I', 'M', 'A', 'S', 'K' };

#define PASS_ON_LEN (sizeof(passed_on) + 4 + 2)

static bool is_loopback(struct in_addr address)
{
	return ntohl(address.s_addr) >> 24 == 127;
}

static bool concerns_us(const struct sim_server *server, const struct sockaddr_in *from)
{
	return (server->options->rig.device.ip[0] == 127) == is_loopback(from->sin_addr);
}

static void answer(struct sim_server *server, uint64_t now_ns, const struct sockaddr_in *from)
{
	uint8_t reply[SIM_DISCOVERY_MAX];
	uint8_t asker[4];
	size_t len;

	if (!concerns_us(server, from) ||
	    sim_link_is_silent(&server->rig->link, SIM_LINK_REQUEST, now_ns) ||
	    sim_link_is_silent(&server->rig->link, SIM_LINK_REPLY, now_ns))
		return;
	memcpy(asker, &from->sin_addr, sizeof(asker));
	len = sim_device_discovery(&server->rig->device, now_ns, asker, reply);
	if (len)
		sendto(server->udp, reply, len, 0, (const struct sockaddr *)from, sizeof(*from));
}

static void pass_on(struct sim_server *server, const struct sockaddr_in *from)
{
	struct sockaddr_in to = { .sin_family = AF_INET, .sin_port = htons(server->port) };
	uint8_t bytes[PASS_ON_LEN];

	to.sin_addr.s_addr = htonl(0x7FFFFFFF);
	memcpy(bytes, passed_on, sizeof(passed_on));
	memcpy(bytes + 8, &from->sin_addr, 4);
	memcpy(bytes + 12, &from->sin_port, 2);
	sendto(server->udp, bytes, sizeof(bytes), 0, (struct sockaddr *)&to, sizeof(to));
}

/* A search sent to this device alone; at 127.0.0.1 it is meant for all on `lo`. */
void sim_search_asked(struct sim_server *server, uint64_t now_ns, const struct sockaddr_in *from)
{
	static const uint8_t first[4] = { 127, 0, 0, 1 };

	if (!server->options->discovery)
		return;
	if (server->search >= 0 && is_loopback(from->sin_addr) &&
	    !memcmp(server->options->rig.device.ip, first, sizeof(first)))
		pass_on(server, from);
	else
		answer(server, now_ns, from);
}

int sim_search_open(struct sim_server *server)
{
	struct sockaddr_in sa = { .sin_family = AF_INET, .sin_port = htons(server->port) };
	int on = 1;

	if (!server->options->discovery)
		return 0;
	server->search = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (server->search < 0)
		return -errno;
	setsockopt(server->search, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
	setsockopt(server->search, IPPROTO_IP, IP_PKTINFO, &on, sizeof(on));
	if (bind(server->search, (struct sockaddr *)&sa, sizeof(sa)) == 0)
		return sim_server_watch(server, server->search, SIM_EVENT_SEARCH, 0);
	fprintf(stderr, "pokeys-sim: UDP 0.0.0.0:%u: %s; broadcast searches are not answered\n",
		server->port, strerror(errno));
	close(server->search);
	server->search = -1;
	return 0;
}

/* Where the packet was sent to: a broadcast has another address than the one it came in on. */
static bool sent_to(struct msghdr *msg, struct in_addr *to, bool *broadcast)
{
	for (struct cmsghdr *c = CMSG_FIRSTHDR(msg); c; c = CMSG_NXTHDR(msg, c)) {
		struct in_pktinfo info;

		if (c->cmsg_level != IPPROTO_IP || c->cmsg_type != IP_PKTINFO)
			continue;
		memcpy(&info, CMSG_DATA(c), sizeof(info));
		*to = info.ipi_addr;
		*broadcast = info.ipi_addr.s_addr != info.ipi_spec_dst.s_addr;
		return true;
	}
	return false;
}

/* The host which asked, from a search another simulator has passed on. */
static bool take_passed_on(const uint8_t *bytes, size_t len, struct sockaddr_in *from)
{
	if (len != PASS_ON_LEN || memcmp(bytes, passed_on, sizeof(passed_on)) != 0 ||
	    !is_loopback(from->sin_addr))
		return false;
	memcpy(&from->sin_addr, bytes + 8, 4);
	memcpy(&from->sin_port, bytes + 12, 2);
	return true;
}

static bool receive(struct sim_server *server, uint64_t now_ns)
{
	struct sockaddr_in from;
	uint8_t bytes[WIRE_PK];
	_Alignas(struct cmsghdr) char control[128];
	struct iovec iov = { bytes, sizeof(bytes) };
	struct msghdr msg = {
		.msg_name = &from,
		.msg_namelen = sizeof(from),
		.msg_iov = &iov,
		.msg_iovlen = 1,
		.msg_control = control,
		.msg_controllen = sizeof(control),
	};
	ssize_t len = recvmsg(server->search, &msg, 0);
	struct in_addr to;
	bool broadcast;

	if (len < 0)
		return false;
	if (!sent_to(&msg, &to, &broadcast))
		return true;
	if (take_passed_on(bytes, (size_t)len, &from) || (broadcast && len < WIRE_PK))
		answer(server, now_ns, &from);
	else if (!len && ntohl(to.s_addr) == INADDR_LOOPBACK)
		pass_on(server, &from);
	return true;
}

void sim_search_receive(struct sim_server *server, uint64_t now_ns)
{
	for (unsigned int i = 0; i < 16; i++) {
		if (!receive(server, now_ns))
			return;
	}
}
