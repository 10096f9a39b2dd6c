/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The search, on the loopback interface only, at a port of our own. */
#include "tests/transport/fixture.h"
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "daemon/transport/discovery.h"

/* Devices answer from a thread: everyone who hears an empty datagram. */
struct devices {
	struct peer peer[4];
	nfds_t count;
	uint16_t port;
	_Atomic bool stop;
	_Atomic int not_empty;
	pthread_t thread;
};

static void *answer(void *argument)
{
	struct devices *d = argument;
	struct pollfd p[4];

	for (nfds_t i = 0; i < d->count; i++)
		p[i] = (struct pollfd){ .fd = d->peer[i].fd, .events = POLLIN };
	while (!d->stop) {
		if (poll(p, d->count, 10) <= 0)
			continue;
		for (nfds_t i = 0; i < d->count; i++) {
			uint8_t in[8], out[19] = { 0 };

			if (!(p[i].revents & POLLIN))
				continue;
			d->not_empty += peer_receive(&d->peer[i], in, sizeof in) != 0;
			out[14] = (uint8_t)i;
			peer_send(&d->peer[i], out, i == 3 ? 14 : sizeof out);
		}
	}
	return NULL;
}

static void add(struct devices *d, uint32_t address)
{
	struct sockaddr_in at = { .sin_family = AF_INET,
				  .sin_addr.s_addr = htonl(address),
				  .sin_port = htons(d->port) };
	struct peer *peer = &d->peer[d->count++];
	socklen_t length = sizeof at;

	memset(peer, 0, sizeof *peer);
	peer->fd = socket(AF_INET, SOCK_DGRAM, 0);
	assert_int_equal(bind(peer->fd, (struct sockaddr *)&at, sizeof at), 0);
	assert_int_equal(getsockname(peer->fd, (struct sockaddr *)&at, &length), 0);
	d->port = ntohs(at.sin_port);
	peer->at = (struct transport_address){ .address = address, .port = d->port };
}

static void begin(struct devices *d)
{
	assert_int_equal(pthread_create(&d->thread, NULL, answer, d), 0);
}

static void end(struct devices *d)
{
	d->stop = true;
	pthread_join(d->thread, NULL);
	for (nfds_t i = 0; i < d->count; i++)
		close(d->peer[i].fd);
}

struct heard {
	int count;
	uint32_t address[16];
	size_t length[16];
	int enough;
};

static bool hear(void *context, const uint8_t *data, size_t length,
		 const struct transport_address *from)
{
	struct heard *h = context;

	(void)data;
	if (h->count < 16) {
		h->address[h->count] = from->address;
		h->length[h->count] = length;
	}
	return ++h->count == h->enough;
}

static bool heard_from(const struct heard *h, uint32_t address, size_t length)
{
	for (int i = 0; i < h->count && i < 16; i++)
		if (h->address[i] == address && h->length[i] == length)
			return true;
	return false;
}

static void device_on_loopback_is_found(void **state)
{
	struct devices d = { 0 };
	struct heard h = { 0 };
	struct discovery_options options = { .timeout_ms = 1500, .interface = "lo" };

	(void)state;
	add(&d, INADDR_LOOPBACK);
	begin(&d);
	options.port = d.port;
	assert_int_equal(discovery_search(&options, hear, &h), 1);
	assert_true(heard_from(&h, INADDR_LOOPBACK, 19));
	end(&d);
	assert_int_equal(d.not_empty, 0);
}

static void device_that_listens_for_broadcasts_is_found(void **state)
{
	struct devices d = { 0 };
	struct heard h = { 0 };
	struct discovery_options options = { .timeout_ms = 1500, .interface = "lo" };

	(void)state;
	add(&d, 0x7fffffff);
	begin(&d);
	options.port = d.port;
	assert_int_equal(discovery_search(&options, hear, &h), 1);
	end(&d);
}

static void device_elsewhere_is_asked_by_address(void **state)
{
	struct transport_address also[2] = { { 0 } };
	struct devices d = { 0 };
	struct heard h = { 0 };
	struct discovery_options options = {
		.timeout_ms = 1500,
		.interface = "lo",
		.also = also,
		.also_count = 2,
	};

	(void)state;
	add(&d, 0x7f000000 | (uint32_t)getpid() << 8 | 0x17);
	options.port = d.port;
	add(&d, INADDR_LOOPBACK);
	also[0].address = d.peer[0].at.address;
	also[1] = d.peer[1].at;
	begin(&d);
	assert_int_equal(discovery_search(&options, hear, &h), 3);
	assert_true(heard_from(&h, d.peer[0].at.address, 19));
	assert_true(heard_from(&h, INADDR_LOOPBACK, 19));
	end(&d);
}

static void enough_ends_the_search(void **state)
{
	struct devices d = { 0 };
	struct heard h = { .enough = 1 };
	struct discovery_options options = { .timeout_ms = 60000, .interface = "lo" };
	uint64_t before = fixture_now();

	(void)state;
	add(&d, INADDR_ANY);
	begin(&d);
	options.port = d.port;
	assert_int_equal(discovery_search(&options, hear, &h), 1);
	assert_true(fixture_now() - before < 30000 * (uint64_t)MS);
	end(&d);
}

static void silence_lasts_as_long_as_asked_for(void **state)
{
	struct heard h = { 0 };
	struct discovery_options options = { .timeout_ms = 30, .interface = "lo" };
	struct devices d = { 0 };
	uint64_t before = fixture_now();

	(void)state;
	add(&d, INADDR_LOOPBACK); /* has the port, but nobody answers */
	options.port = d.port;
	assert_int_equal(discovery_search(&options, hear, &h), 0);
	assert_true(fixture_now() - before >= 30 * MS);
	close(d.peer[0].fd);
}

static void interface_that_is_not_there_is_told(void **state)
{
	struct heard h = { 0 };
	struct discovery_options options = { .timeout_ms = 30, .interface = "nosuchif0" };

	(void)state;
	assert_int_equal(discovery_search(&options, hear, &h), -ENODEV);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(device_on_loopback_is_found),
		cmocka_unit_test(device_that_listens_for_broadcasts_is_found),
		cmocka_unit_test(device_elsewhere_is_asked_by_address),
		cmocka_unit_test(enough_ends_the_search),
		cmocka_unit_test(silence_lasts_as_long_as_asked_for),
		cmocka_unit_test(interface_that_is_not_there_is_told),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
