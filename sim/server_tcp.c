// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The same packets as a stream (protocol section 1.1).
 *
 * A stream has no packet borders: 64 bytes are collected, or 512 when they
 * begin as a multi-part fill does, however they were cut on the way. A client
 * which says nothing for the time set with 0xE0 (3 s) is disconnected; as long as
 * the device has not done what it asked, it is waiting and not silent. Faults
 * of the link do not touch TCP, which would mend them; the time the device
 * takes does.
 *
 * Nothing of a stream is lost either. A client which sends more than the device
 * has places for, or does not read its replies, is not read from until that has
 * changed: what it sends waits in the buffers of the sockets. One which has ended
 * its sending still gets the replies to what it had sent, and is let go then. Each
 * has places of its own, so that none waits for another to be heard.
 *
 * A device which reboots drops its connections.
 */
#include "sim/server.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#define PLACES (SIM_RIG_STREAM / SIM_TCP_CLIENTS)
#define WHO (~UINT64_C(0))
#define WHERE (SIM_PEER_RELIABLE | 0xFF)	/* whoever it was that had the client's place */

static int bind_tcp(struct sim_server *server)
{
	struct sockaddr_in sa = { .sin_family = AF_INET, .sin_port = htons(server->port) };
	socklen_t size = sizeof(sa);
	int on = server->options->tcp;

	memcpy(&sa.sin_addr, server->options->rig.device.ip, 4);
	server->listen = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (server->listen < 0)
		return -errno;
	/* Two sockets which only hold an address, and do not listen, must collide. */
	setsockopt(server->listen, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
	if (bind(server->listen, (struct sockaddr *)&sa, sizeof(sa)) < 0)
		return -errno;
	if (server->options->tcp && listen(server->listen, SIM_TCP_CLIENTS) < 0)
		return -errno;
	if (getsockname(server->listen, (struct sockaddr *)&sa, &size) < 0)
		return -errno;
	server->port = ntohs(sa.sin_port);
	return 0;
}

int sim_tcp_open(struct sim_server *server)
{
	const uint8_t *ip = server->options->rig.device.ip;
	int r = bind_tcp(server);

	if (r < 0) {
		fprintf(stderr,
			"pokeys-sim: TCP %u.%u.%u.%u:%u: %s; give another --address or "
			"--port\n",
			ip[0], ip[1], ip[2], ip[3], server->port, strerror(-r));
		return r;
	}
	if (!server->options->tcp)
		return 0;
	return sim_server_watch(server, server->listen, SIM_EVENT_LISTEN, 0);
}

static void drop(struct sim_tcp_client *client)
{
	if (client->fd < 0)
		return;
	close(client->fd);
	client->fd = -1;
	client->generation = (uint16_t)((client->generation + 1) & 0x7FFF);
}

void sim_tcp_close_all(struct sim_server *server)
{
	for (unsigned int i = 0; i < SIM_TCP_CLIENTS; i++)
		drop(&server->tcp[i]);
}

static struct sim_tcp_client *free_place(struct sim_server *server)
{
	for (unsigned int i = 0; i < SIM_TCP_CLIENTS; i++) {
		if (server->tcp[i].fd < 0)
			return &server->tcp[i];
	}
	return NULL;
}

void sim_tcp_accept(struct sim_server *server, uint64_t now_ns)
{
	int fd = accept4(server->listen, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
	struct sim_tcp_client *client = free_place(server);
	int on = 1;

	if (fd < 0)
		return;
	if (!client ||
	    sim_server_watch(server, fd, SIM_EVENT_TCP, (unsigned int)(client - server->tcp)) < 0) {
		close(fd);
		return;
	}
	setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
	client->fd = fd;
	client->watched = EPOLLIN;
	client->ended = false;
	client->broken = false;
	client->active_ns = now_ns;
	client->received = 0;
	client->to_send = 0;
	sim_device_connected(&server->rig->device);
}

/* How many bytes make up the packet that begins here. */
static size_t packet_len(const struct sim_tcp_client *client)
{
	bool fill = client->received > 2 && client->in[0] == WIRE_REQUEST &&
		    client->in[1] == 0xB0 && (client->in[2] & 0x0F) == 0x08;

	return fill ? SIM_MULTI : WIRE_PK;
}

static uint64_t peer_of(const struct sim_server *server, const struct sim_tcp_client *client)
{
	return SIM_PEER_RELIABLE | (uint64_t)client->generation << 8 |
	       (uint64_t)(client - server->tcp);
}

static unsigned int waiting(const struct sim_server *server, const struct sim_tcp_client *client,
			    uint64_t mask)
{
	return sim_rig_waiting(server->rig, peer_of(server, client), mask);
}

static void take_packets(struct sim_server *server, uint64_t now_ns, unsigned int index)
{
	struct sim_tcp_client *client = &server->tcp[index];
	uint64_t peer = peer_of(server, client);

	while (client->received >= packet_len(client)) {
		size_t len = packet_len(client);

		sim_rig_send_from(server->rig, now_ns, peer, client->in, len);
		client->received -= len;
		memmove(client->in, client->in + len, client->received);
	}
}

/* As much as is read at once must find its place. */
static bool may_read(const struct sim_server *server, const struct sim_tcp_client *client)
{
	return !client->ended && !client->to_send &&
	       waiting(server, client, WHERE) + sizeof(client->in) / WIRE_PK <= PLACES;
}

/* False if there is nothing, or no room for it. */
static bool receive_some(struct sim_server *server, uint64_t now_ns, unsigned int index)
{
	struct sim_tcp_client *client = &server->tcp[index];
	ssize_t len;

	if (client->fd < 0 || !may_read(server, client))
		return false;
	len = recv(client->fd, client->in + client->received, sizeof(client->in) - client->received,
		   0);
	if (len < 0) {
		if (errno != EAGAIN)
			drop(client);
		return false;
	}
	client->ended = len == 0;
	client->active_ns = now_ns;
	client->received += (size_t)len;
	take_packets(server, now_ns, index);
	return true;
}

/* Once in a turn: what is answered at once must leave before there is more of it. */
void sim_tcp_receive(struct sim_server *server, uint64_t now_ns, unsigned int index)
{
	receive_some(server, now_ns, index);
}

/*
 * It is gone, as a client is which closes without having read all replies. What it
 * had asked is done, and nobody is there for the replies.
 */
void sim_tcp_broken(struct sim_server *server, unsigned int index)
{
	struct sim_tcp_client *client = &server->tcp[index];

	if (client->fd < 0)
		return;
	epoll_ctl(server->epoll, EPOLL_CTL_DEL, client->fd, NULL);
	client->broken = true;
	client->to_send = 0;
}

/* After each turn: what there are places for. */
static void keep_broken(struct sim_server *server, uint64_t now_ns, struct sim_tcp_client *client)
{
	while (receive_some(server, now_ns, (unsigned int)(client - server->tcp)))
		;
	if (client->ended)
		drop(client);
}

static void flush(struct sim_tcp_client *client, uint64_t now_ns)
{
	ssize_t len = send(client->fd, client->out, client->to_send, MSG_NOSIGNAL);

	if (len < 0 && errno == EAGAIN)
		return;
	if (len < 0) {
		drop(client);
		return;
	}
	client->active_ns = now_ns;
	client->to_send -= (size_t)len;
	memmove(client->out, client->out + len, client->to_send);
}

/* Only strays can be more than there is room for. */
void sim_tcp_send(struct sim_server *server, uint64_t now_ns, uint64_t peer, const uint8_t *bytes,
		  size_t len)
{
	struct sim_tcp_client *client = &server->tcp[(peer & 0xFF) % SIM_TCP_CLIENTS];

	if (client->fd < 0 || client->broken || client->generation != (peer >> 8 & 0x7FFF))
		return;
	if (client->to_send + len > sizeof(client->out)) {
		drop(client);
		return;
	}
	memcpy(client->out + client->to_send, bytes, len);
	client->to_send += len;
	flush(client, now_ns);
}

/* What the client is watched for is what can be done with it. */
static void watch(struct sim_server *server, struct sim_tcp_client *client)
{
	unsigned int index = (unsigned int)(client - server->tcp);
	struct epoll_event ev = { .data.u64 = (uint64_t)SIM_EVENT_TCP << 32 | index };

	if (may_read(server, client))
		ev.events |= EPOLLIN;
	if (client->to_send)
		ev.events |= EPOLLOUT;
	if (ev.events != client->watched)
		epoll_ctl(server->epoll, EPOLL_CTL_MOD, client->fd, &ev);
	client->watched = ev.events;
}

static uint64_t idle_ns(const struct sim_server *server)
{
	return UINT64_C(100000000) * server->rig->device.config.network.tcp_timeout;
}

/* Whether it has ended its sending and has all its replies, or nothing has passed for long. */
static bool is_done(const struct sim_server *server, const struct sim_tcp_client *client,
		    uint64_t now_ns)
{
	uint64_t most = idle_ns(server);

	return (client->ended && !client->to_send) || (most && now_ns - client->active_ns >= most);
}

static void keep(struct sim_server *server, uint64_t now_ns, struct sim_tcp_client *client)
{
	bool waits = waiting(server, client, WHO);

	if (waits)
		client->active_ns = now_ns;
	if (client->to_send)
		flush(client, now_ns);
	if (client->fd < 0)
		return;
	if (!waits && is_done(server, client, now_ns))
		drop(client);
	else
		watch(server, client);
}

/* After each turn: sends on, takes leave of who is done or silent, and watches the rest. */
void sim_tcp_keep(struct sim_server *server, uint64_t now_ns)
{
	for (unsigned int i = 0; i < SIM_TCP_CLIENTS; i++) {
		struct sim_tcp_client *client = &server->tcp[i];

		if (client->fd >= 0)
			(client->broken ? keep_broken : keep)(server, now_ns, client);
	}
}

/* Who is gone waits for the device alone. */
uint64_t sim_tcp_next(const struct sim_server *server)
{
	uint64_t next = UINT64_MAX;
	uint64_t most = idle_ns(server);

	for (unsigned int i = 0; most && i < SIM_TCP_CLIENTS; i++) {
		const struct sim_tcp_client *client = &server->tcp[i];

		if (client->fd >= 0 && !client->broken && client->active_ns + most < next)
			next = client->active_ns + most;
	}
	return next;
}
