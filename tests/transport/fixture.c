/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Each process uses loopback addresses of its own (127.a.b.c from a random
 * start), so that any number of these tests run beside one another, and every
 * wait has a limit, so that a broken transport fails instead of hanging.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>
#include "tests/transport/fixture.h"
#include "tests/transport/xdp_world.h"

const char *fixture_kind;

static bool is_xdp(void)
{
	return !strcmp(fixture_kind, "xdp");
}

struct transport_options fixture_options(void)
{
	return is_xdp() ? xdp_world_options() : (struct transport_options){ 0 };
}

int peer_socket(void)
{
	return is_xdp() ? xdp_world_far_socket() : socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
}

void fixture_begin(int argc, char **argv)
{
	struct transport_options options;
	struct transport *t;
	const char *why;
	int rc;

	if (argc < 2) {
		fprintf(stderr, "usage: %s io_uring|socket|xdp\n", argv[0]);
		exit(2);
	}
	fixture_kind = argv[1];
	why = is_xdp() ? xdp_world_make() : NULL;
	if (why) {
		fprintf(stderr, "skipped: xdp: %s\n", why);
		exit(77);
	}
	options = fixture_options();
	rc = transport_open(&t, fixture_kind, &options, &why);
	if (rc < 0 || strcmp(t->ops->name, fixture_kind)) {
		fprintf(stderr, "skipped: %s: %s\n", fixture_kind, why);
		exit(77);
	}
	transport_close(t);
}

uint64_t fixture_now(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static uint32_t own_address(void)
{
	static uint32_t address;

	if (!address)
		assert_int_equal(getrandom(&address, sizeof address, 0), sizeof address);
	address++;
	if (is_xdp())
		return XDP_WORLD_FAR | (1 + (address >> 8) % 126) << 8 |
		       (1 + (address & 0xff) % 254);
	/* 127.1.0.1 .. 127.254.255.254 */
	return 0x7f000000u | (1 + (address >> 16) % 254) << 16 | (address >> 8 & 0xff) << 8 |
	       (1 + (address & 0xff) % 254);
}

void peer_open(struct peer *peer)
{
	struct sockaddr_in at = { .sin_family = AF_INET };
	struct timeval patience = { .tv_sec = 60 };
	socklen_t length = sizeof at;

	memset(peer, 0, sizeof *peer);
	peer->at.address = own_address();
	at.sin_addr.s_addr = htonl(peer->at.address);
	peer->fd = peer_socket();
	assert_true(peer->fd >= 0);
	assert_int_equal(bind(peer->fd, (struct sockaddr *)&at, sizeof at), 0);
	assert_int_equal(getsockname(peer->fd, (struct sockaddr *)&at, &length), 0);
	peer->at.port = ntohs(at.sin_port);
	assert_int_equal(setsockopt(peer->fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience),
			 0);
}

void peer_close(struct peer *peer)
{
	close(peer->fd);
}

void peer_send(struct peer *peer, const void *data, size_t length)
{
	struct sockaddr_in to = {
		.sin_family = AF_INET,
		.sin_port = htons(peer->from.port),
		.sin_addr.s_addr = htonl(peer->from.address),
	};

	assert_int_equal(sendto(peer->fd, data, length, 0, (struct sockaddr *)&to, sizeof to),
			 length);
}

static int take(struct peer *peer, void *data, size_t size, int flags)
{
	struct sockaddr_in from;
	socklen_t length = sizeof from;
	ssize_t n = recvfrom(peer->fd, data, size, MSG_TRUNC | flags, (struct sockaddr *)&from,
			     &length);

	if (n < 0)
		return -1;
	peer->from.address = ntohl(from.sin_addr.s_addr);
	peer->from.port = ntohs(from.sin_port);
	return (int)n;
}

int peer_receive(struct peer *peer, void *data, size_t size)
{
	return take(peer, data, size, 0);
}

int peer_look(struct peer *peer, void *data, size_t size)
{
	return take(peer, data, size, MSG_DONTWAIT);
}

struct transport *fixture_transport(uint32_t channels, bool spin)
{
	struct transport_options options = fixture_options();
	struct transport *t;
	const char *why;

	options.spin = spin;
	assert_int_equal(transport_open(&t, fixture_kind, &options, &why), 0);
	assert_string_equal(t->ops->name, fixture_kind);
	for (uint32_t i = 0; i < channels; i++)
		assert_int_equal(t->ops->attach(t, i), 0);
	assert_int_equal(t->ops->start(t), 0);
	return t;
}

void introduce(struct transport *t, uint32_t channel, struct peer *peer)
{
	const char *news;
	uint8_t data[8];

	assert_int_equal(t->ops->send(t, channel, (const uint8_t *)"hello", 5), 0);
	assert_int_equal(t->ops->flush(t), 0);
	assert_int_equal(peer_receive(peer, data, sizeof data), 5);
	if (t->ops->tend)
		t->ops->tend(t, &news);
}

int next_packet(struct transport *t, uint32_t ms, struct transport_packet *out)
{
	uint64_t end = fixture_now() + (uint64_t)ms * MS;

	while (!t->ops->receive(t, out))
		if (t->ops->wait(t, end) == TRANSPORT_WAIT_DEADLINE)
			return 0;
	return 1;
}

int world_begin(void **state)
{
	struct world *w = calloc(1, sizeof *w);

	assert_non_null(w);
	peer_open(&w->peer);
	w->t = fixture_transport(1, false);
	assert_int_equal(w->t->ops->aim(w->t, 0, &w->peer.at), 0);
	introduce(w->t, 0, &w->peer);
	*state = w;
	return 0;
}

int world_end(void **state)
{
	struct world *w = *state;

	transport_close(w->t);
	peer_close(&w->peer);
	free(w);
	return 0;
}
