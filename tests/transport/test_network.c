/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The network itself goes away and comes back: in a network namespace of our
 * own, where doing that to the loopback interface hurts nobody. (Taking it
 * down is not enough, its addresses remain reachable; so they are taken off.)
 * Run for each kind.
 */
#include "tests/transport/fixture.h"
#include <arpa/inet.h>
#include <errno.h>
#include <linux/capability.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "daemon/transport/discovery.h"
#include "daemon/transport/udp.h"

static void loopback(bool up)
{
	struct ifreq r = { .ifr_name = "lo" };
	int fd = socket(AF_INET, SOCK_DGRAM, 0);

	assert_int_equal(ioctl(fd, SIOCGIFFLAGS, &r), 0);
	r.ifr_flags = (short)(up ? r.ifr_flags | IFF_UP : r.ifr_flags & ~IFF_UP);
	assert_int_equal(ioctl(fd, SIOCSIFFLAGS, &r), 0);
	close(fd);
}

/* Give the loopback interface (or its alias) an address, 0 = none. */
static void give_address(const char *interface, uint32_t address)
{
	struct ifreq r = { 0 };
	struct sockaddr_in at = { .sin_family = AF_INET, .sin_addr.s_addr = htonl(address) };
	int fd = socket(AF_INET, SOCK_DGRAM, 0);

	strcpy(r.ifr_name, interface);
	memcpy(&r.ifr_addr, &at, sizeof at);
	assert_int_equal(ioctl(fd, SIOCSIFADDR, &r), 0);
	close(fd);
}

static void lost_network_is_told_and_aiming_anew_mends_it(void **state)
{
	struct world *w = *state;
	struct transport_packet p;

	for (int round = 0; round < 20; round++) {
		give_address("lo", 0);
		assert_int_equal(w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1), 0);
		w->t->ops->wait(w->t, fixture_now() + MS / 2);
		assert_true(w->t->error[0] < 0);
		assert_true(w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1) < 0);
		assert_true(w->t->ops->aim(w->t, 0, &w->peer.at) < 0);
		assert_int_equal(w->t->failed, 0);
		give_address("lo", INADDR_LOOPBACK);
		assert_int_equal(w->t->ops->aim(w->t, 0, &w->peer.at), 0);
		introduce(w->t, 0, &w->peer);
		peer_send(&w->peer, "back", 4);
		assert_int_equal(next_packet(w->t, 60000, &p), 1);
	}
}

/* connect() takes 0.0.0.0 for ours then, and nothing would ever be answered or fail. */
static void aim_from_an_interface_without_address_is_refused(void **state)
{
	const struct transport_options options = { .interface = "lo" };
	const struct transport_address device = { .address = 0x0a090801, .port = 20055 };
	struct transport_address local;
	uint64_t calls = 0;
	struct udp udp;

	(void)state;
	assert_int_equal(udp_open(&udp, &options), 0);
	for (int round = 0; round < 2; round++) {
		give_address("lo", 0);
		assert_int_equal(udp_aim(&udp, &device, &local, &calls), -EADDRNOTAVAIL);
		assert_int_equal(udp_aim(&udp, &device, &local, &calls), -EADDRNOTAVAIL);
		give_address("lo", 0x0a090807);
		assert_int_equal(udp_aim(&udp, &device, &local, &calls), 0);
		assert_int_equal(local.address, 0x0a090807);
	}
	give_address("lo", INADDR_LOOPBACK);
	udp_close(&udp);
}

/* Connecting again must not keep the local address of the first network. */
static void aim_at_another_network_uses_an_address_of_that_one(void **state)
{
	struct world *w = *state;
	struct sockaddr_in at = { .sin_family = AF_INET, .sin_addr.s_addr = htonl(0x0a090807) };
	socklen_t length = sizeof at;
	struct peer other = { 0 };
	uint8_t in[8];

	give_address("lo:1", 0x0a090807);
	other.fd = socket(AF_INET, SOCK_DGRAM, 0);
	assert_int_equal(bind(other.fd, (struct sockaddr *)&at, sizeof at), 0);
	assert_int_equal(getsockname(other.fd, (struct sockaddr *)&at, &length), 0);
	other.at = (struct transport_address){ .address = 0x0a090807, .port = ntohs(at.sin_port) };
	assert_int_equal(w->peer.from.address >> 24, 127);
	assert_int_equal(w->t->ops->aim(w->t, 0, &other.at), 0);
	w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1);
	w->t->ops->flush(w->t);
	assert_int_equal(peer_receive(&other, in, sizeof in), 1);
	assert_int_equal(other.from.address, 0x0a090807);
	peer_close(&other);
}

static void socket_stays_bound_to_its_interface(void **state)
{
	struct world *w = *state;
	const struct transport_options options = { .interface = "lo" };
	struct transport_address local;
	uint64_t calls = 0;
	struct udp udp;

	assert_int_equal(udp_open(&udp, &options), 0);
	for (int i = 0; i < 3; i++) {
		char name[IFNAMSIZ] = "";
		socklen_t length = sizeof name;

		assert_int_equal(udp_aim(&udp, &w->peer.at, &local, &calls), 0);
		assert_int_equal(getsockopt(udp.fd, SOL_SOCKET, SO_BINDTODEVICE, name, &length), 0);
		assert_string_equal(name, "lo");
	}
	assert_int_equal(calls, 3 * 4);
	udp_close(&udp);
}

static void drop_rights(void)
{
	struct __user_cap_header_struct head = { .version = _LINUX_CAPABILITY_VERSION_3 };
	struct __user_cap_data_struct none[2] = { 0 };

	assert_int_equal(syscall(SYS_capset, &head, none), 0);
}

static unsigned int bound_to(const struct udp *udp)
{
	unsigned int index = 0;
	socklen_t length = sizeof index;

	assert_int_equal(getsockopt(udp->fd, SOL_SOCKET, SO_BINDTOIFINDEX, &index, &length), 0);
	return index;
}

/* Who has no CAP_NET_RAW may bind a socket only while it is bound to nothing. The last test. */
static void a_channel_is_bound_aside_without_rights(void **state)
{
	struct world *w = *state;
	const struct transport_options options = { 0 };
	struct transport_address aside = w->peer.at, nowhere = w->peer.at, local;
	const unsigned int lo = if_nametoindex("lo");
	uint64_t calls = 0;
	struct udp udp;

	aside.interface = (uint16_t)lo;
	nowhere.interface = 999;
	drop_rights();
	assert_int_equal(udp_open(&udp, &options), 0);
	for (int round = 0; round < 3; round++) {
		assert_int_equal(udp_aim(&udp, &aside, &local, &calls), 0);
		assert_int_equal(bound_to(&udp), lo);
		assert_int_equal(udp_aim(&udp, &aside, &local, &calls), 0);
		assert_int_equal(udp_aim(&udp, &nowhere, &local, &calls), -ENODEV);
		assert_int_equal(udp_aim(&udp, &aside, &local, &calls), 0);
		assert_int_equal(udp_aim(&udp, &w->peer.at, &local, &calls), 0);
		assert_int_equal(bound_to(&udp), 0);
	}
	udp_close(&udp);
}

static bool never(void *context, const uint8_t *data, size_t length,
		  const struct transport_address *from)
{
	(void)context;
	(void)data;
	(void)length;
	(void)from;
	return false;
}

static void search_without_a_network_says_so(void **state)
{
	const struct discovery_options options = { .timeout_ms = 10 };

	(void)state;
	loopback(false);
	assert_int_equal(discovery_search(&options, never, NULL), -ENETUNREACH);
	loopback(true);
	assert_int_equal(discovery_search(&options, never, NULL), 0);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, world_begin, world_end)

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		TEST(lost_network_is_told_and_aiming_anew_mends_it),
		TEST(aim_from_an_interface_without_address_is_refused),
		TEST(aim_at_another_network_uses_an_address_of_that_one),
		TEST(socket_stays_bound_to_its_interface),
		cmocka_unit_test(search_without_a_network_says_so),
		TEST(a_channel_is_bound_aside_without_rights),
	};

	if (unshare(CLONE_NEWNET) < 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) < 0) {
		fprintf(stderr, "skipped: no network namespace may be made here: %s\n",
			strerror(errno));
		return 77;
	}
	loopback(true);
	fixture_begin(argc, argv);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
