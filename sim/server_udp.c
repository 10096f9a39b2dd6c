// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The command socket.
 *
 * It is bound to the device's own address, never to 0.0.0.0: from there
 * replies would leave with another address, which a client with a connected
 * socket never sees (protocol section 7.1).
 *
 * SO_REUSEADDR is set for the sake of the search socket (server_search.c),
 * whose wildcard would otherwise collide with every device. It also lets two
 * simulators bind the same address, of which the later one would silently
 * take the packets; so the TCP socket of the same address and port, bound
 * first, is the lock against that.
 */
#include "sim/server.h"

#include <arpa/inet.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>

#define PACKETS_PER_TURN 64

static struct sockaddr_in own_address(const struct sim_server *server)
{
	struct sockaddr_in sa = { .sin_family = AF_INET, .sin_port = htons(server->port) };

	memcpy(&sa.sin_addr, server->options->rig.device.ip, 4);
	return sa;
}

int sim_udp_open(struct sim_server *server)
{
	struct sockaddr_in sa = own_address(server);
	int on = 1;
	int r;

	server->udp = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (server->udp < 0)
		return -errno;
	setsockopt(server->udp, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
	setsockopt(server->udp, SOL_SOCKET, SO_BROADCAST, &on, sizeof(on));
	if (bind(server->udp, (struct sockaddr *)&sa, sizeof(sa)) < 0) {
		r = -errno;
		fprintf(stderr, "pokeys-sim: UDP %s:%u: %s; give another --address or --port\n",
			inet_ntoa(sa.sin_addr), server->port, strerror(-r));
		return r;
	}
	return sim_server_watch(server, server->udp, SIM_EVENT_UDP, 0);
}

/*
 * A client is its address and port, which travel with the request and come back
 * with the reply. A table of clients would be full one day, and the reply to one
 * that had to leave it would go to whom its place was given.
 */
static uint64_t peer_of(const struct sockaddr_in *from)
{
	return (uint64_t)from->sin_addr.s_addr << 16 | from->sin_port;
}

static struct sockaddr_in address_of(uint64_t peer)
{
	return (struct sockaddr_in){
		.sin_family = AF_INET, .sin_port = (in_port_t)peer,
		.sin_addr.s_addr = (in_addr_t)(peer >> 16),
	};
}

/*
 * The time of a packet is read after it came: read before, it could be older
 * than the question when we were held up in between, and a device that answers
 * with a clock from before the question looks restarted.
 */
void sim_udp_receive(struct sim_server *server)
{
	uint8_t bytes[SIM_LINK_BYTES + 1];
	struct sockaddr_in from;

	for (unsigned int i = 0; i < PACKETS_PER_TURN; i++) {
		socklen_t size = sizeof(from);
		ssize_t len = recvfrom(server->udp, bytes, sizeof(bytes), 0,
				       (struct sockaddr *)&from, &size);
		uint64_t now_ns = sim_now();

		if (len < 0)
			return;
		if (len == 0)
			sim_search_asked(server, now_ns, &from);
		else
			sim_rig_send_from(server->rig, now_ns, peer_of(&from), bytes, (size_t)len);
	}
}

/* A client which is gone, or a full buffer: the reply is lost, as on a wire. */
void sim_udp_send(struct sim_server *server, uint64_t peer, const uint8_t *bytes, size_t len)
{
	const struct sockaddr_in to = address_of(peer);

	sendto(server->udp, bytes, len, 0, (const struct sockaddr *)&to, sizeof(to));
}
