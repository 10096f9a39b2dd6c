/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What is sent arrives, and what arrives is told truly. Run for each kind. */
#include "tests/transport/fixture.h"
#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

static void sent_datagram_arrives_whole(void **state)
{
	struct world *w = *state;
	uint8_t out[TRANSPORT_SEND_MAX], in[TRANSPORT_SEND_MAX + 1];

	for (size_t i = 0; i < sizeof out; i++)
		out[i] = (uint8_t)(i * 7);
	assert_int_equal(w->t->ops->send(w->t, 0, out, 64), 0);
	assert_int_equal(w->t->ops->send(w->t, 0, out, sizeof out), 0);
	assert_int_equal(w->t->ops->flush(w->t), 0);
	assert_int_equal(peer_receive(&w->peer, in, sizeof in), 64);
	assert_memory_equal(in, out, 64);
	assert_int_equal(peer_receive(&w->peer, in, sizeof in), sizeof out);
	assert_memory_equal(in, out, sizeof out);
}

static void bytes_may_change_after_send(void **state)
{
	struct world *w = *state;
	uint8_t out[64], in[64];

	for (uint8_t i = 0; i < 8; i++) {
		memset(out, i, sizeof out);
		assert_int_equal(w->t->ops->send(w->t, 0, out, sizeof out), 0);
	}
	memset(out, 0xee, sizeof out);
	w->t->ops->flush(w->t);
	for (uint8_t i = 0; i < 8; i++) {
		assert_int_equal(peer_receive(&w->peer, in, sizeof in), 64);
		assert_int_equal(in[0], i);
		assert_int_equal(in[63], i);
	}
}

static void nothing_leaves_before_flush_or_wait(void **state)
{
	struct world *w = *state;
	struct transport_packet p;
	uint8_t in[8];

	assert_int_equal(w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1), 0);
	assert_int_equal(w->t->ops->receive(w->t, &p), 0);
	assert_int_equal(recv(w->peer.fd, in, sizeof in, MSG_DONTWAIT), -1);
	w->t->ops->wait(w->t, fixture_now() + MS);
	assert_int_equal(peer_receive(&w->peer, in, sizeof in), 1);
}

static void more_than_the_queue_is_sent_too(void **state)
{
	const int room = 212992; /* for all of them; the kernel doubles it */
	struct world *w = *state;
	uint8_t in[8];

	assert_int_equal(setsockopt(w->peer.fd, SOL_SOCKET, SO_RCVBUF, &room, sizeof(room)), 0);
	for (int i = 0; i < TRANSPORT_QUEUE + 10; i++) {
		uint8_t b = (uint8_t)i;

		assert_int_equal(w->t->ops->send(w->t, 0, &b, 1), 0);
	}
	w->t->ops->flush(w->t);
	for (int i = 0; i < TRANSPORT_QUEUE + 10; i++) {
		assert_int_equal(peer_receive(&w->peer, in, sizeof in), 1);
		assert_int_equal(in[0], (uint8_t)i);
	}
}

static void too_long_to_send_is_refused(void **state)
{
	struct world *w = *state;
	static const uint8_t data[TRANSPORT_SEND_MAX + 1];

	assert_int_equal(w->t->ops->send(w->t, 0, data, sizeof data), -EMSGSIZE);
	assert_int_equal(w->t->statistics.send_failed, 1);
}

static void channel_that_is_not_attached_is_refused(void **state)
{
	struct world *w = *state;

	assert_int_equal(w->t->ops->send(w->t, 1, (const uint8_t *)"x", 1), -EINVAL);
	assert_int_equal(w->t->ops->send(w->t, TRANSPORT_CHANNELS, (const uint8_t *)"x", 1),
			 -EINVAL);
	assert_int_equal(w->t->ops->aim(w->t, 1, &w->peer.at), -EINVAL);
	assert_int_equal(w->t->ops->attach(w->t, TRANSPORT_CHANNELS), -EINVAL);
	assert_int_equal(w->t->ops->attach(w->t, 1), -EBUSY); /* started already */
	assert_int_equal(w->t->ops->start(w->t), -EBUSY);
}

static void packet_carries_source_channel_and_time(void **state)
{
	struct world *w = *state;
	struct transport_packet p;
	uint64_t before = fixture_now();

	peer_send(&w->peer, "answer", 6);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_int_equal(p.length, 6);
	assert_memory_equal(p.data, "answer", 6);
	assert_int_equal(p.channel, 0);
	assert_int_equal(p.address, w->peer.at.address);
	assert_int_equal(p.port, w->peer.at.port);
	/* the kernel took it in between sending and now, on our clock */
	assert_true(p.t_ns >= before - 50000 && p.t_ns <= fixture_now());
	assert_int_equal(w->t->statistics.stamps_refused, 0);
}

static void stamp_is_arrival_not_reading(void **state)
{
	struct world *w = *state;
	const struct timespec nap = { .tv_nsec = 30 * MS };
	const uint64_t give_up = fixture_now() + FIXTURE_PATIENCE_NS;
	struct transport_packet p;
	uint64_t age;

	/* the kernel starts to stamp packets a little after the first socket asks for it */
	do {
		assert_true(fixture_now() < give_up);
		peer_send(&w->peer, "x", 1);
		nanosleep(&nap, NULL);
		assert_int_equal(next_packet(w->t, 60000, &p), 1);
		assert_true(p.t_ns != 0);
		age = fixture_now() - p.t_ns;
	} while (age < 29 * MS);
}

static void oversize_datagram_reports_its_true_length(void **state)
{
	/* what the kernel puts together and what passes it by come in no order */
	bool two_ways = !strcmp(fixture_kind, "xdp");
	struct world *w = *state;
	static uint8_t data[60000];
	struct transport_packet p;

	memset(data, 0x5a, sizeof data);
	peer_send(&w->peer, data, sizeof data);
	if (!two_ways)
		peer_send(&w->peer, "after", 5);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_int_equal(p.length, sizeof data);
	assert_int_equal(p.data[TRANSPORT_PACKET_MAX - 1], 0x5a);
	assert_int_equal(w->t->statistics.truncated, 1);
	if (two_ways)
		peer_send(&w->peer, "after", 5);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_int_equal(p.length, 5);
	assert_memory_equal(p.data, "after", 5);
}

static void longest_that_fits_is_not_truncated(void **state)
{
	struct world *w = *state;
	static uint8_t data[TRANSPORT_PACKET_MAX];
	struct transport_packet p;

	for (size_t i = 0; i < sizeof data; i++)
		data[i] = (uint8_t)(i ^ i >> 8);
	peer_send(&w->peer, data, sizeof data);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_int_equal(p.length, sizeof data);
	assert_memory_equal(p.data, data, sizeof data);
	assert_int_equal(w->t->statistics.truncated, 0);
}

static void empty_datagrams_arrive_and_end_nothing(void **state)
{
	struct world *w = *state;
	struct transport_packet p;

	for (int i = 0; i < 5; i++) {
		peer_send(&w->peer, "", 0);
		peer_send(&w->peer, "full", 4);
	}
	for (int i = 0; i < 5; i++) {
		assert_int_equal(next_packet(w->t, 60000, &p), 1);
		assert_int_equal(p.length, 0);
		assert_int_equal(p.address, w->peer.at.address);
		assert_int_equal(next_packet(w->t, 60000, &p), 1);
		assert_int_equal(p.length, 4);
	}
}

static void every_length_arrives(void **state)
{
	struct world *w = *state;
	uint8_t data[130];
	struct transport_packet p;

	for (size_t n = 0; n <= sizeof data; n++) {
		memset(data, (int)n, sizeof data);
		peer_send(&w->peer, data, n);
		assert_int_equal(next_packet(w->t, 60000, &p), 1);
		assert_int_equal(p.length, n);
		assert_memory_equal(p.data, data, n);
	}
}

static void stranger_is_kept_out_by_the_kernel(void **state)
{
	struct world *w = *state;
	struct transport_packet p;
	struct peer stranger;

	peer_open(&stranger);
	stranger.from = w->peer.from;
	peer_send(&stranger, "stray", 5);
	peer_send(&w->peer, "true", 4);
	assert_int_equal(next_packet(w->t, 60000, &p), 1);
	assert_memory_equal(p.data, "true", 4);
	assert_int_equal(next_packet(w->t, 20, &p), 0);
	peer_close(&stranger);
}

static void burst_of_200_arrives_whole_and_in_order(void **state)
{
	struct world *w = *state;
	struct transport_packet p;

	for (uint32_t i = 0; i < 200; i++)
		peer_send(&w->peer, &i, sizeof i);
	for (uint32_t i = 0; i < 200; i++) {
		assert_int_equal(next_packet(w->t, 60000, &p), 1);
		assert_int_equal(p.length, sizeof i);
		assert_memory_equal(p.data, &i, sizeof i);
	}
	assert_int_equal(next_packet(w->t, 5, &p), 0);
}

static void thousand_unread_are_survived(void **state)
{
	struct world *w = *state;
	struct transport_packet p;
	uint8_t data[64] = { 0 };
	int got = 0;

	for (int round = 0; round < 3; round++) {
		for (int i = 0; i < 1000; i++)
			peer_send(&w->peer, data, sizeof data);
		while (next_packet(w->t, 20, &p)) {
			assert_int_equal(p.length, 64);
			got++;
		}
		/* the socket keeps some of them; how many is the kernel's affair */
		peer_send(&w->peer, "fresh", 5);
		/* what a busy kernel delivers late comes before it */
		do {
			assert_int_equal(next_packet(w->t, 60000, &p), 1);
			got += p.length == 64;
		} while (p.length == 64);
		assert_memory_equal(p.data, "fresh", 5);
		assert_true(got >= 100 * (round + 1));
	}
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, world_begin, world_end)

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		TEST(sent_datagram_arrives_whole),
		TEST(bytes_may_change_after_send),
		TEST(nothing_leaves_before_flush_or_wait),
		TEST(more_than_the_queue_is_sent_too),
		TEST(too_long_to_send_is_refused),
		TEST(channel_that_is_not_attached_is_refused),
		TEST(packet_carries_source_channel_and_time),
		TEST(stamp_is_arrival_not_reading),
		TEST(oversize_datagram_reports_its_true_length),
		TEST(longest_that_fits_is_not_truncated),
		TEST(empty_datagrams_arrive_and_end_nothing),
		TEST(every_length_arrives),
		TEST(stranger_is_kept_out_by_the_kernel),
		TEST(burst_of_200_arrives_whole_and_in_order),
		TEST(thousand_unread_are_survived),
	};

	fixture_begin(argc, argv);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
