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

static void batch_init(struct sim_udp_batch *batch)
{
	for (unsigned int i = 0; i < SIM_UDP_BATCH; i++) {
		struct msghdr *message = &batch->message[i].msg_hdr;

		batch->part[i] = (struct iovec){ batch->bytes[i], sizeof(batch->bytes[i]) };
		message->msg_name = &batch->peer[i];
		message->msg_namelen = sizeof(batch->peer[i]);
		message->msg_iov = &batch->part[i];
		message->msg_iovlen = 1;
	}
}

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

	batch_init(&server->requests);
	batch_init(&server->replies);
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
		.sin_family = AF_INET,
		.sin_port = (in_port_t)peer,
		.sin_addr.s_addr = (in_addr_t)(peer >> 16),
	};
}

/*
 * The time of the packets is read after they came: read before, it could be older
 * than the question when we were held up in between, and a device that answers
 * with a clock from before the question looks restarted.
 */
void sim_udp_receive(struct sim_server *server)
{
	struct sim_udp_batch *batch = &server->requests;
	int count = recvmmsg(server->udp, batch->message, SIM_UDP_BATCH, 0, NULL);
	uint64_t now_ns = sim_now();

	for (int i = 0; i < count; i++) {
		const struct sockaddr_in *from = &batch->peer[i];
		size_t len = batch->message[i].msg_len;

		if (len == 0)
			sim_search_asked(server, now_ns, from);
		else
			sim_rig_send_from(server->rig, now_ns, peer_of(from), batch->bytes[i], len);
		batch->message[i].msg_hdr.msg_namelen = sizeof(*from);
	}
}

void sim_udp_send(struct sim_server *server, uint64_t peer, const uint8_t *bytes, size_t len)
{
	struct sim_udp_batch *batch = &server->replies;
	unsigned int i = server->to_reply++;

	batch->peer[i] = address_of(peer);
	batch->part[i].iov_len = len;
	memcpy(batch->bytes[i], bytes, len);
	if (server->to_reply == SIM_UDP_BATCH)
		sim_udp_flush(server);
}

/* A client which is gone, or a full buffer: that reply is lost, as on a wire. */
void sim_udp_flush(struct sim_server *server)
{
	unsigned int sent = 0;

	while (sent < server->to_reply) {
		int r = sendmmsg(server->udp, server->replies.message + sent,
				 server->to_reply - sent, 0);

		sent += r > 0 ? (unsigned int)r : 1;
	}
	server->to_reply = 0;
}
