/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is AF_XDP's own: that datagrams really pass the kernel by, and that
 * whatever it depends on may go and come back - the guard, the neighbour, the
 * interface - while the exchange goes on through the kernel.
 *
 * That something passed the kernel by is seen in the kernel's own counters of
 * UDP datagrams, which then do not move.
 */
#include "tests/transport/fixture.h"
#include <arpa/inet.h>
#include <errno.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include "daemon/transport/neighbour.h"
#include "daemon/transport/xdp.h"
#include "guard/server.h"
#include "tests/transport/xdp_world.h"

enum { PATIENCE_S = 20 };

/* UDP datagrams that the kernel of our namespace has carried, both directions. */
static unsigned long carried(void)
{
	FILE *f = fopen("/proc/thread-self/net/snmp", "re");
	unsigned long in, none, errors, out;
	char line[512];

	assert_non_null(f);
	while (fgets(line, sizeof line, f))
		if (sscanf(line, "Udp: %lu %lu %lu %lu", &in, &none, &errors, &out) == 4) {
			fclose(f);
			return in + out;
		}
	fclose(f);
	fail_msg("no counters of UDP");
	return 0;
}

static const char *tend(struct transport *t)
{
	const char *news;

	t->ops->tend(t, &news);
	return news;
}

/* The first news that there are; they wait for the guard's answer, and a machine may hold it. */
static const char *first_news(struct transport *t)
{
	const struct timespec moment = { .tv_nsec = 2 * MS };
	uint64_t end = fixture_now() + PATIENCE_S * UINT64_C(1000) * MS;
	const char *news;

	while (!(news = tend(t)) && fixture_now() < end)
		nanosleep(&moment, NULL);
	assert_non_null(news);
	return news;
}

/* One question and answer; true if both arrived. */
static bool exchange(struct world *w)
{
	struct transport_packet p;
	uint8_t in[8];

	if (w->t->error[0])
		w->t->ops->aim(w->t, 0, &w->peer.at);
	if (w->t->ops->send(w->t, 0, (const uint8_t *)"ask", 3) < 0)
		return false;
	w->t->ops->wait(w->t, fixture_now() + MS);
	for (int i = 0; peer_look(&w->peer, in, sizeof in) != 3; i++) {
		if (i == 1000)
			return false;
		w->t->ops->wait(w->t, fixture_now() + MS);
	}
	peer_send(&w->peer, "told", 4);
	return next_packet(w->t, 1000, &p) && p.length == 4;
}

/*
 * True if an exchange goes past the kernel, now or in a while: a link that comes
 * up, or a neighbour that has to be asked for, takes the kernel some time.
 */
static bool passes(struct world *w)
{
	const struct timespec moment = { .tv_nsec = 2 * MS };
	uint64_t end = fixture_now() + PATIENCE_S * UINT64_C(1000) * MS;

	for (; fixture_now() < end; nanosleep(&moment, NULL)) {
		unsigned long before;

		tend(w->t);
		before = carried();
		if (exchange(w) && carried() == before)
			return true;
	}
	return false;
}

static void datagrams_pass_the_kernel_by_in_both_directions(void **state)
{
	struct world *w = *state;
	unsigned long before = carried();

	for (int i = 0; i < 10; i++)
		assert_true(exchange(w));
	assert_int_equal(carried(), before);
	assert_int_equal(tend(w->t), NULL);
}

static void first_datagram_after_an_aim_goes_the_kernels_way(void **state)
{
	struct world *w = *state;
	unsigned long before = carried();
	struct peer other;
	uint8_t in[8];

	peer_open(&other);
	assert_int_equal(w->t->ops->aim(w->t, 0, &other.at), 0);
	assert_int_equal(w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1), 0);
	assert_int_equal(w->t->ops->flush(w->t), 0);
	assert_int_equal(peer_receive(&other, in, sizeof in), 1);
	assert_int_equal(carried(), before + 1);
	assert_int_equal(other.from.port, w->peer.from.port);
	peer_close(&other);
	assert_int_equal(w->t->ops->aim(w->t, 0, &w->peer.at), 0);
	assert_true(passes(w));
}

static void guard_that_ends_and_comes_back_costs_nothing_but_time(void **state)
{
	struct world *w = *state;
	const char *news;

	for (int round = 0; round < 2; round++) {
		unsigned long before = carried();

		xdp_world_guard_end();
		for (int i = 0; i < 5; i++)
			assert_true(exchange(w));
		assert_true(carried() > before);
		news = tend(w->t);
		assert_non_null(news);
		assert_non_null(strstr(news, "pokeys-guard has ended"));
		assert_null(tend(w->t)); /* told once */
		assert_true(exchange(w));
		assert_null(xdp_world_guard_start());
		news = first_news(w->t);
		assert_non_null(strstr(news, "AF_XDP, copied")); /* a veth has no more */
		assert_string_equal(atomic_load(&w->t->title), "xdp copy");
		assert_true(passes(w));
	}
}

static void stale_neighbour_makes_the_kernel_ask(void **state)
{
	struct world *w = *state;
	struct in_addr at = { htonl(w->peer.at.address) };
	unsigned long before;
	char command[128];

	snprintf(command, sizeof command, "ip neighbour change %s dev pk0 nud stale",
		 inet_ntoa(at));
	xdp_world_run(command);
	tend(w->t);
	before = carried();
	assert_true(exchange(w));
	assert_int_equal(carried(), before + 1); /* the question, not the answer */
	assert_true(passes(w));
}

static void neighbour_that_moves_is_followed(void **state)
{
	struct world *w = *state;

	xdp_world_run_far("ip link set pk1 address 02:00:00:00:05:01");
	xdp_world_run("ip neighbour flush dev pk0");
	assert_true(passes(w));
}

static void device_behind_a_router_is_reached(void **state)
{
	struct world *w = *state;
	struct sockaddr_in at = { .sin_family = AF_INET, .sin_addr.s_addr = htonl(0x0a630001) };
	socklen_t length = sizeof at;
	struct world beyond = { .t = w->t };

	xdp_world_run_far("ip address add 10.99.0.1/32 dev lo");
	xdp_world_run("ip route add 10.99.0.0/16 via 10.78.127.1");
	peer_open(&beyond.peer);
	peer_close(&beyond.peer);
	beyond.peer.fd = peer_socket();
	assert_int_equal(bind(beyond.peer.fd, (struct sockaddr *)&at, sizeof at), 0);
	assert_int_equal(getsockname(beyond.peer.fd, (struct sockaddr *)&at, &length), 0);
	beyond.peer.at = (struct transport_address){
		.address = 0x0a630001,
		.port = ntohs(at.sin_port),
	};
	assert_int_equal(w->t->ops->aim(w->t, 0, &beyond.peer.at), 0);
	assert_true(passes(&beyond));
	peer_close(&beyond.peer);
	xdp_world_run("ip route del 10.99.0.0/16");
	xdp_world_run_far("ip address del 10.99.0.1/32 dev lo");
}

static void address_that_is_taken_off_ends_sending_with_it(void **state)
{
	struct world *w = *state;

	xdp_world_run("ip address flush dev pk0");
	tend(w->t);
	w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1);
	w->t->ops->wait(w->t, fixture_now() + MS / 2);
	assert_true(w->t->error[0] < 0);
	assert_int_equal(w->t->failed, 0);
	xdp_world_run("ip address add 10.78.200.1/16 dev pk0");
	assert_true(passes(w));
}

static void interface_that_goes_down_and_up_is_used_again(void **state)
{
	struct world *w = *state;

	for (int round = 0; round < 2; round++) {
		xdp_world_run("ip link set pk0 down");
		for (int i = 0; i < 5; i++) {
			w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1);
			assert_int_equal(w->t->ops->wait(w->t, fixture_now() + MS / 2),
					 TRANSPORT_WAIT_DEADLINE);
			tend(w->t);
		}
		assert_int_equal(w->t->failed, 0);
		xdp_world_run("ip link set pk0 up");
		assert_true(passes(w));
	}
}

static void interface_that_is_made_anew_is_used_again(void **state)
{
	struct world *w = *state;

	xdp_world_run("ip link del pk0");
	for (int i = 0; i < 5; i++) {
		w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1);
		assert_int_equal(w->t->ops->wait(w->t, fixture_now() + MS / 2),
				 TRANSPORT_WAIT_DEADLINE);
		tend(w->t);
	}
	xdp_world_guard_end();
	xdp_world_connect();
	assert_null(xdp_world_guard_start());
	assert_int_equal(w->t->ops->aim(w->t, 0, &w->peer.at), 0);
	assert_true(passes(w));
}

/* A frame put on the wire at the far end as it is. */
static void send_frame(const uint8_t *frame, size_t length)
{
	struct sockaddr_ll to = { .sll_family = AF_PACKET, .sll_halen = 6 };
	int fd = xdp_world_far_packet_socket(&to.sll_ifindex);

	assert_int_equal(sendto(fd, frame, length, 0, (struct sockaddr *)&to, sizeof to), length);
	close(fd);
}

static void frames_that_are_not_whole_are_refused_and_counted(void **state)
{
	struct world *w = *state;
	struct frame_path path = {
		.from = w->peer.at.address,
		.from_port = w->peer.at.port,
		.to = w->peer.from.address,
		.to_port = w->peer.from.port,
	};
	const size_t broken[] = { 24, 40, 45 }; /* header checksum, UDP checksum, data */
	struct transport_packet p;
	uint8_t frame[128];
	size_t length;

	assert_int_equal(neighbour_own("pk0", path.to_mac), 0);
	memcpy(path.from_mac, "\2\0\0\0\0\7", 6);
	length = frame_make(frame, &path, (const uint8_t *)"whole", 5);
	for (size_t i = 0; i < sizeof broken / sizeof broken[0]; i++) {
		frame[broken[i]] ^= 0x10;
		send_frame(frame, length);
		frame[broken[i]] ^= 0x10;
	}
	path.from++; /* somebody else */
	length = frame_make(frame, &path, (const uint8_t *)"alien", 5);
	send_frame(frame, length);
	path.from--;
	length = frame_make(frame, &path, (const uint8_t *)"whole", 5);
	send_frame(frame, length);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_int_equal(p.length, 5);
	assert_memory_equal(p.data, "whole", 5);
	assert_int_equal(w->t->statistics.receive_failed, 4);
	assert_null(tend(w->t));
	assert_int_equal(next_packet(w->t, 5, &p), 0);
}

/* As a veth sends whose checksums nobody has switched off; damage is no such thing. */
static void checksums_that_are_left_to_a_card_are_told_once(void **state)
{
	const uint64_t end = fixture_now() + PATIENCE_S * UINT64_C(1000) * MS;
	struct world *w = *state;
	const char *news;

	assert_null(tend(w->t));
	xdp_world_checksums(false);
	do { /* no answer: refused, or later than we wait */
		assert_false(exchange(w));
		news = tend(w->t);
	} while (!news && fixture_now() < end);
	assert_non_null(news);
	assert_non_null(strstr(news, "ethtool -K INTERFACE tx off"));
	assert_false(exchange(w));
	assert_null(tend(w->t));
	xdp_world_checksums(true);
	assert_true(passes(w));
}

static _Atomic bool enough;

static void *tend_all_the_time(void *argument)
{
	while (!atomic_load(&enough))
		tend(argument);
	return NULL;
}

static void tending_from_another_thread_disturbs_nothing(void **state)
{
	struct world *w = *state;
	struct peer other;
	struct world there = { .t = w->t };
	pthread_t thread;

	peer_open(&other);
	there.peer = other;
	atomic_store(&enough, false);
	assert_int_equal(pthread_create(&thread, NULL, tend_all_the_time, w->t), 0);
	for (int i = 0; i < 100; i++) {
		struct world *now = i / 10 % 2 ? w : &there;

		if (i % 10 == 0)
			assert_int_equal(w->t->ops->aim(w->t, 0, &now->peer.at), 0);
		assert_true(exchange(now));
	}
	atomic_store(&enough, true);
	pthread_join(thread, NULL);
	peer_close(&other);
}

/* Opened with these it is another kind, for a reason in which `part` stands. */
static void assert_falls_back(struct transport_options options, const char *part)
{
	struct transport *t;
	const char *why;

	assert_int_equal(transport_open(&t, "xdp", &options, &why), 0);
	assert_string_not_equal(t->ops->name, "xdp");
	assert_non_null(why);
	if (!strstr(why, part))
		fail_msg("\"%s\" does not say \"%s\"", why, part);
	transport_close(t);
}

static void what_is_missing_is_said_and_another_kind_is_taken(void **state)
{
	struct transport_options options = fixture_options();

	(void)state;
	options.helper = "/run/nobody";
	assert_falls_back(options, "pokeys-guard");
	options = fixture_options();
	options.interface = NULL;
	assert_falls_back(options, "name it");
	options.interface = "nosuchif0";
	assert_falls_back(options, "no such interface");
	options.interface = "lo";
	assert_falls_back(options, "Ethernet");
}

static void vlan_is_refused(void **state)
{
	struct transport_options options = fixture_options();

	(void)state;
	if (system("ip link add link pk0 name pk0.5 type vlan id 5 2>/dev/null") != 0)
		skip();
	options.interface = "pk0.5";
	assert_falls_back(options, "VLAN");
	xdp_world_run("ip link del pk0.5");
}

/* A server that refuses, or says nothing at all. */
static pid_t other_guard(bool silent)
{
	struct guard_server server = GUARD_SERVER_CLOSED;
	struct pollfd fds[GUARD_SERVER_FDS] = { 0 };
	pid_t child;

	assert_int_equal(guard_server_open(&server, "/run/other", -1, -1), 0);
	child = fork();
	if (child == 0) {
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		server.index = if_nametoindex("pk0");
		for (;;) {
			if (!silent)
				guard_server_run(&server, fds, fixture_now());
			poll(fds, GUARD_SERVER_FDS, 100);
		}
	}
	close(server.listener);
	return child;
}

static void guard_that_refuses_or_hangs_is_done_without(void **state)
{
	struct transport_options options = fixture_options();

	(void)state;
	options.helper = "/run/other";
	for (int silent = 0; silent < 2; silent++) {
		pid_t child = other_guard(silent);

		assert_falls_back(options, silent ? "does not answer" : "generic");
		kill(child, SIGKILL);
		waitpid(child, NULL, 0);
		unlink("/run/other");
	}
}

/* Whether this guard's own words come back. A machine may hold it longer than one wait. */
static bool is_answered(const struct transport_options *options)
{
	for (int i = 0; i < 30; i++) {
		struct transport *t;
		const char *why;
		bool answered;

		assert_int_equal(transport_open(&t, "xdp", options, &why), 0);
		answered = why && strstr(why, "generic");
		transport_close(t);
		if (answered)
			return true;
	}
	return false;
}

static void client_that_says_nothing_keeps_nobody_out(void **state)
{
	struct transport_options options = fixture_options();
	pid_t child = other_guard(false);
	int silent;

	(void)state;
	options.helper = "/run/other";
	silent = handover_connect(options.helper, 1000);
	assert_true(silent >= 0);
	assert_true(is_answered(&options));
	close(silent);
	kill(child, SIGKILL);
	waitpid(child, NULL, 0);
	unlink("/run/other");
}

static unsigned int connections(int listener)
{
	unsigned int count = 0;

	for (int fd; (fd = accept(listener, NULL, NULL)) >= 0; count++)
		close(fd);
	return count;
}

/* Whoever tends has other duties: one that let him wait is left alone for some calls. */
static void guard_that_hangs_is_not_asked_at_each_call(void **state)
{
	struct guard_server server = GUARD_SERVER_CLOSED;
	const struct transport_options options = fixture_options();
	struct world *w = *state;
	unsigned int asked = 0;
	const char *news;

	xdp_world_guard_end();
	assert_int_equal(guard_server_open(&server, options.helper, -1, -1), 0);
	for (int i = 0; i < 9; i++) {
		assert_true(w->t->ops->tend(w->t, &news) < 0);
		asked += connections(server.listener);
	}
	assert_int_equal(asked, 1);
	w->t->ops->tend(w->t, &news);
	assert_int_equal(connections(server.listener), 1);
	close(server.listener);
	unlink(options.helper);
	assert_null(xdp_world_guard_start());
}

static void one_daemon_at_a_time_is_served(void **state)
{
	struct world *w = *state;

	assert_falls_back(fixture_options(), "another daemon");
	assert_true(passes(w));
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, world_begin, world_end)

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		TEST(datagrams_pass_the_kernel_by_in_both_directions),
		TEST(first_datagram_after_an_aim_goes_the_kernels_way),
		TEST(guard_that_ends_and_comes_back_costs_nothing_but_time),
		TEST(stale_neighbour_makes_the_kernel_ask),
		TEST(neighbour_that_moves_is_followed),
		TEST(device_behind_a_router_is_reached),
		TEST(address_that_is_taken_off_ends_sending_with_it),
		TEST(interface_that_goes_down_and_up_is_used_again),
		TEST(interface_that_is_made_anew_is_used_again),
		TEST(frames_that_are_not_whole_are_refused_and_counted),
		TEST(checksums_that_are_left_to_a_card_are_told_once),
		TEST(tending_from_another_thread_disturbs_nothing),
		cmocka_unit_test(what_is_missing_is_said_and_another_kind_is_taken),
		cmocka_unit_test(vlan_is_refused),
		cmocka_unit_test(guard_that_refuses_or_hangs_is_done_without),
		TEST(client_that_says_nothing_keeps_nobody_out),
		TEST(guard_that_hangs_is_not_asked_at_each_call),
		TEST(one_daemon_at_a_time_is_served),
	};

	fixture_begin(argc, argv);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
