/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Who is at the other end: nobody, somebody else, nobody for a while. Run for
 * each kind.
 */
#include "tests/transport/fixture.h"
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>

static int send_one(struct transport *t, uint32_t channel)
{
	int rc = t->ops->send(t, channel, (const uint8_t *)"ask", 3);

	return rc < 0 ? rc : t->ops->flush(t);
}

static void aim_at_another_peer_reaches_that_one(void **state)
{
	struct world *w = *state;
	struct transport_packet p;
	struct peer other;
	uint8_t in[8];

	peer_open(&other);
	assert_int_equal(w->t->ops->aim(w->t, 0, &other.at), 0);
	assert_int_equal(send_one(w->t, 0), 0);
	assert_int_equal(peer_receive(&other, in, sizeof in), 3);
	peer_send(&other, "here", 4);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_memory_equal(p.data, "here", 4);
	assert_int_equal(p.address, other.at.address);
	peer_close(&other);
}

static void packets_of_the_old_peer_keep_their_source(void **state)
{
	struct world *w = *state;
	struct transport_packet p;
	struct peer other;

	peer_open(&other);
	peer_send(&w->peer, "old", 3);
	assert_int_equal(w->t->ops->aim(w->t, 0, &other.at), 0);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_memory_equal(p.data, "old", 3);
	assert_int_equal(p.address, w->peer.at.address);
	assert_int_equal(p.port, w->peer.at.port);
	introduce(w->t, 0, &other);
	peer_send(&other, "new", 3);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_memory_equal(p.data, "new", 3);
	peer_close(&other);
}

static void aim_back_and_forth_keeps_working(void **state)
{
	struct world *w = *state;
	struct transport_packet p;
	struct peer other;

	peer_open(&other);
	for (int i = 0; i < 50; i++) {
		struct peer *now = i % 2 ? &w->peer : &other;

		assert_int_equal(w->t->ops->aim(w->t, 0, &now->at), 0);
		introduce(w->t, 0, now);
		peer_send(now, &i, sizeof i);
		assert_int_equal(next_packet(w->t, 60000, &p), 1);
		assert_memory_equal(p.data, &i, sizeof i);
		assert_int_equal(p.address, now->at.address);
	}
	peer_close(&other);
}

static void our_own_end_is_known_while_aimed(void **state)
{
	const struct transport_address nobody = { 0 };
	struct world *w = *state;
	uint8_t in[8];

	assert_int_equal(send_one(w->t, 0), 0);
	assert_int_equal(peer_receive(&w->peer, in, sizeof in), 3);
	assert_int_equal(w->t->local[0].address, w->peer.from.address);
	assert_int_equal(w->t->local[0].port, w->peer.from.port);
	assert_int_equal(w->t->ops->aim(w->t, 0, &nobody), 0);
	assert_int_equal(w->t->local[0].address, 0);
}

static void aim_at_nobody_refuses_sends_until_aimed_again(void **state)
{
	struct world *w = *state;
	const struct transport_address nobody = { 0 };

	assert_int_equal(w->t->ops->aim(w->t, 0, &nobody), 0);
	assert_int_equal(send_one(w->t, 0), -EDESTADDRREQ);
	assert_int_equal(w->t->statistics.send_failed, 1);
	assert_int_equal(w->t->ops->aim(w->t, 0, &w->peer.at), 0);
	introduce(w->t, 0, &w->peer);
}

static void never_aimed_channel_refuses_sends(void **state)
{
	struct transport *t = fixture_transport(1, false);

	(void)state;
	assert_int_equal(send_one(t, 0), -EDESTADDRREQ);
	transport_close(t);
}

static void impossible_address_is_an_error_of_aim(void **state)
{
	struct world *w = *state;
	/* a broadcast, which these sockets may not send to */
	const struct transport_address impossible = { .address = 0xffffffffu, .port = 20055 };

	assert_true(w->t->ops->aim(w->t, 0, &impossible) < 0);
	assert_true(send_one(w->t, 0) < 0);
	assert_int_equal(w->t->ops->aim(w->t, 0, &w->peer.at), 0);
	introduce(w->t, 0, &w->peer);
}

/* Take the peer's socket away and put it back at the same address and port. */
static void peer_leave(struct peer *peer)
{
	peer_close(peer);
}

static void peer_return(struct peer *peer)
{
	struct sockaddr_in at = {
		.sin_family = AF_INET,
		.sin_port = htons(peer->at.port),
		.sin_addr.s_addr = htonl(peer->at.address),
	};
	struct timeval second = { .tv_sec = 1 };

	peer->fd = peer_socket();
	assert_int_equal(bind(peer->fd, (struct sockaddr *)&at, sizeof at), 0);
	setsockopt(peer->fd, SOL_SOCKET, SO_RCVTIMEO, &second, sizeof second);
}

static void absent_peer_is_not_an_error_for_good(void **state)
{
	struct world *w = *state;
	struct transport_packet p;
	uint64_t give_up;
	uint8_t in[8];

	for (int round = 0; round < 3; round++) {
		peer_leave(&w->peer);
		for (int i = 0; i < 20; i++) {
			assert_int_equal(send_one(w->t, 0), 0);
			assert_int_equal(w->t->ops->wait(w->t, fixture_now() + MS / 2),
					 TRANSPORT_WAIT_DEADLINE);
		}
		assert_int_equal(w->t->error[0], 0);
		assert_int_equal(w->t->failed, 0);
		peer_return(&w->peer);
		/* a send may report a late ICMP error instead of sending */
		give_up = fixture_now() + FIXTURE_PATIENCE_NS;
		do {
			assert_true(fixture_now() < give_up);
			assert_int_equal(send_one(w->t, 0), 0);
			w->t->ops->wait(w->t, fixture_now() + MS / 2);
		} while (recv(w->peer.fd, in, sizeof in, MSG_DONTWAIT) != 3);
		peer_send(&w->peer, "back", 4);
		assert_int_equal(next_packet(w->t, 60000, &p), 1);
		assert_memory_equal(p.data, "back", 4);
	}
	assert_true(w->t->statistics.receive_failed + w->t->statistics.send_failed > 0);
}

/* Errors without packets must not turn the wait into a busy loop. */
static void absent_peer_costs_few_system_calls(void **state)
{
	struct world *w = *state;
	uint64_t before;

	peer_leave(&w->peer);
	before = w->t->statistics.system_calls;
	for (int i = 0; i < 20; i++) {
		send_one(w->t, 0);
		w->t->ops->wait(w->t, fixture_now() + MS);
	}
	assert_true(w->t->statistics.system_calls - before <= 20 * 6);
	peer_return(&w->peer);
}

static void absent_peer_does_not_disturb_another_channel(void **state)
{
	struct transport *t = fixture_transport(2, false);
	struct peer gone, here;
	struct transport_packet p;

	(void)state;
	peer_open(&gone);
	peer_open(&here);
	assert_int_equal(t->ops->aim(t, 0, &gone.at), 0);
	assert_int_equal(t->ops->aim(t, 1, &here.at), 0);
	peer_close(&gone);
	for (int i = 0; i < 50; i++) {
		assert_int_equal(t->ops->send(t, 0, (const uint8_t *)"x", 1), 0);
		introduce(t, 1, &here);
		peer_send(&here, &i, sizeof i);
		assert_int_equal(next_packet(t, 60000, &p), 1);
		assert_int_equal(p.channel, 1);
		assert_memory_equal(p.data, &i, sizeof i);
	}
	peer_close(&here);
	transport_close(t);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, world_begin, world_end)

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		TEST(aim_at_another_peer_reaches_that_one),
		TEST(packets_of_the_old_peer_keep_their_source),
		TEST(aim_back_and_forth_keeps_working),
		TEST(our_own_end_is_known_while_aimed),
		TEST(aim_at_nobody_refuses_sends_until_aimed_again),
		cmocka_unit_test(never_aimed_channel_refuses_sends),
		TEST(impossible_address_is_an_error_of_aim),
		TEST(absent_peer_is_not_an_error_for_good),
		TEST(absent_peer_costs_few_system_calls),
		cmocka_unit_test(absent_peer_does_not_disturb_another_channel),
	};

	fixture_begin(argc, argv);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
