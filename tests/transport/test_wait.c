/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The one wait: until a packet or the deadline, not earlier, not for ever,
 * and with no more system calls than it takes. Run for each kind.
 */
#include "tests/transport/fixture.h"
#include <pthread.h>
#include <signal.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static void wait_ends_at_the_deadline_and_not_before(void **state)
{
	struct world *w = *state;

	for (int i = 0; i < 20; i++) {
		uint64_t deadline = fixture_now() + (uint64_t)(1 + i % 4) * MS / 2;

		assert_int_equal(w->t->ops->wait(w->t, deadline), TRANSPORT_WAIT_DEADLINE);
		assert_true(fixture_now() >= deadline);
		assert_true(fixture_now() < deadline + 60000 * (uint64_t)MS);
	}
}

static void wait_with_submission_does_not_end_early_either(void **state)
{
	struct world *w = *state;
	uint8_t in[8];

	for (int i = 0; i < 20; i++) {
		uint64_t deadline = fixture_now() + 2 * MS;

		assert_int_equal(w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1), 0);
		assert_int_equal(w->t->ops->wait(w->t, deadline), TRANSPORT_WAIT_DEADLINE);
		assert_true(fixture_now() >= deadline);
		assert_int_equal(peer_receive(&w->peer, in, sizeof in), 1);
	}
}

static void deadline_in_the_past_returns_at_once(void **state)
{
	struct world *w = *state;
	uint64_t end = fixture_now() + 60000 * (uint64_t)MS;
	struct transport_packet p;

	assert_int_equal(w->t->ops->wait(w->t, 0), TRANSPORT_WAIT_DEADLINE);
	assert_int_equal(w->t->ops->wait(w->t, fixture_now() - 1), TRANSPORT_WAIT_DEADLINE);
	/* but what is there already is found; a busy kernel delivers it late */
	peer_send(&w->peer, "x", 1);
	while (w->t->ops->wait(w->t, 0) != TRANSPORT_WAIT_PACKET)
		assert_true(fixture_now() < end);
	assert_int_equal(w->t->ops->receive(w->t, &p), 1);
}

struct later {
	struct peer *peer;
	uint32_t ms;
};

static void *send_later(void *argument)
{
	struct later *l = argument;
	const struct timespec nap = { .tv_nsec = (long)l->ms * MS };

	nanosleep(&nap, NULL);
	peer_send(l->peer, "late", 4);
	return NULL;
}

static void packet_ends_the_wait_before_the_deadline(void **state)
{
	struct world *w = *state;
	struct later later = { &w->peer, 20 };
	uint64_t deadline = fixture_now() + 60000 * (uint64_t)MS;
	struct transport_packet p;
	pthread_t thread;

	assert_int_equal(pthread_create(&thread, NULL, send_later, &later), 0);
	assert_int_equal(w->t->ops->wait(w->t, deadline), TRANSPORT_WAIT_PACKET);
	assert_true(fixture_now() < deadline - 1000 * (uint64_t)MS);
	assert_int_equal(w->t->ops->receive(w->t, &p), 1);
	pthread_join(thread, NULL);
}

static void wait_without_deadline_waits_for_the_packet(void **state)
{
	struct world *w = *state;
	struct later later = { &w->peer, 20 };
	pthread_t thread;

	assert_int_equal(pthread_create(&thread, NULL, send_later, &later), 0);
	assert_int_equal(w->t->ops->wait(w->t, UINT64_MAX), TRANSPORT_WAIT_PACKET);
	pthread_join(thread, NULL);
}

static volatile sig_atomic_t interruptions;

static void interrupt(int number)
{
	(void)number;
	interruptions++;
}

static void signals_do_not_end_the_wait(void **state)
{
	struct world *w = *state;
	const struct itimerval often = { { 0, 2000 }, { 0, 2000 } }, never = { 0 };
	struct sigaction old, action = { .sa_handler = interrupt };
	uint64_t deadline = fixture_now() + 50 * (uint64_t)MS;

	sigaction(SIGALRM, &action, &old);
	setitimer(ITIMER_REAL, &often, NULL);
	/* of a process that is not run a dozen are one */
	do {
		assert_int_equal(w->t->ops->wait(w->t, deadline), TRANSPORT_WAIT_DEADLINE);
		assert_true(fixture_now() >= deadline);
		deadline += 50 * (uint64_t)MS;
	} while (interruptions <= 3);
	setitimer(ITIMER_REAL, &never, NULL);
	sigaction(SIGALRM, &old, NULL);
}

static void quiet_wait_is_one_system_call(void **state)
{
	struct world *w = *state;
	uint64_t before = w->t->statistics.system_calls;

	w->t->ops->wait(w->t, fixture_now() + 50 * MS);
	assert_int_equal(w->t->statistics.system_calls, before + 1);
}

static void waiting_packet_saves_the_call(void **state)
{
	struct world *w = *state;
	const uint64_t give_up = fixture_now() + FIXTURE_PATIENCE_NS;
	struct transport_packet p;
	uint64_t calls, avoided;

	/* a busy kernel may deliver the second packet after the wait has returned */
	do {
		assert_true(fixture_now() < give_up);
		peer_send(&w->peer, "a", 1);
		peer_send(&w->peer, "b", 1);
		assert_int_equal(w->t->ops->wait(w->t, give_up), TRANSPORT_WAIT_PACKET);
		calls = w->t->statistics.system_calls;
		avoided = w->t->statistics.waits_avoided;
		assert_int_equal(w->t->ops->receive(w->t, &p), 1);
		assert_int_equal(w->t->ops->wait(w->t, give_up), TRANSPORT_WAIT_PACKET);
		assert_int_equal(w->t->ops->receive(w->t, &p), 1);
		assert_memory_equal(p.data, "b", 1);
	} while (w->t->statistics.system_calls != calls);
	assert_int_equal(w->t->statistics.waits_avoided, avoided + 1);
}

static void spinning_wait_finds_packet_and_deadline(void **state)
{
	struct world *w = *state;
	struct later later = { &w->peer, 5 };
	uint64_t deadline = fixture_now() + 3 * MS;
	struct transport_packet p;
	pthread_t thread;

	w->t->spin = true;
	assert_int_equal(w->t->ops->wait(w->t, deadline), TRANSPORT_WAIT_DEADLINE);
	assert_true(fixture_now() >= deadline);
	assert_int_equal(pthread_create(&thread, NULL, send_later, &later), 0);
	assert_int_equal(w->t->ops->wait(w->t, fixture_now() + 60000 * (uint64_t)MS),
			 TRANSPORT_WAIT_PACKET);
	assert_int_equal(w->t->ops->receive(w->t, &p), 1);
	assert_memory_equal(p.data, "late", 4);
	pthread_join(thread, NULL);
}

static void spinning_wait_flushes_first(void **state)
{
	struct world *w = *state;
	uint8_t in[8];

	w->t->spin = true;
	assert_int_equal(w->t->ops->send(w->t, 0, (const uint8_t *)"x", 1), 0);
	w->t->ops->wait(w->t, fixture_now() + MS);
	assert_int_equal(peer_receive(&w->peer, in, sizeof in), 1);
}

enum { MANY = TRANSPORT_CHANNELS };

static void all_channels_share_one_wait(void **state)
{
	struct transport *t = fixture_transport(MANY, false);
	struct peer peer[MANY];
	struct transport_packet p;
	uint64_t seen = 0, calls;

	(void)state;
	for (uint32_t i = 0; i < MANY; i++) {
		peer_open(&peer[i]);
		assert_int_equal(t->ops->aim(t, i, &peer[i].at), 0);
		introduce(t, i, &peer[i]);
	}
	for (uint32_t i = 0; i < MANY; i++)
		peer_send(&peer[i], &i, sizeof i);
	calls = t->statistics.system_calls;
	assert_int_equal(t->ops->wait(t, UINT64_MAX), TRANSPORT_WAIT_PACKET);
	/* a ring of received frames is memory: what is in it already costs none */
	assert_in_range(t->statistics.system_calls,
			calls + (t->ops->name[0] == 's') + (t->ops->name[0] != 'x'),
			calls + (t->ops->name[0] == 's' ? 2 : 1));
	for (uint32_t i = 0; i < MANY; i++) {
		assert_int_equal(next_packet(t, 60000, &p), 1);
		assert_int_equal(p.address, peer[p.channel].at.address);
		assert_memory_equal(p.data, &p.channel, sizeof p.channel);
		seen |= UINT64_C(1) << p.channel;
	}
	assert_int_equal(seen, UINT64_MAX >> (64 - MANY));
	for (uint32_t i = 0; i < MANY; i++)
		peer_close(&peer[i]);
	transport_close(t);
}

/* A channel with a full socket must not hold back the packet of another one. */
static void flooded_channel_does_not_starve_another(void **state)
{
	struct transport *t = fixture_transport(2, false);
	struct peer loud, quiet;
	struct transport_packet p;
	uint8_t data[64] = { 0 };
	int before = 0;

	(void)state;
	peer_open(&loud);
	peer_open(&quiet);
	assert_int_equal(t->ops->aim(t, 0, &loud.at), 0);
	assert_int_equal(t->ops->aim(t, 1, &quiet.at), 0);
	introduce(t, 0, &loud);
	introduce(t, 1, &quiet);
	for (int i = 0; i < 200; i++)
		peer_send(&loud, data, sizeof data);
	peer_send(&quiet, data, sizeof data);
	do {
		assert_int_equal(next_packet(t, 60000, &p), 1);
		if (p.channel == 0)
			peer_send(&loud, data, sizeof data); /* the flood goes on */
		assert_true(++before < 150);
	} while (p.channel != 1);
	peer_close(&loud);
	peer_close(&quiet);
	transport_close(t);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, world_begin, world_end)

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		TEST(wait_ends_at_the_deadline_and_not_before),
		TEST(wait_with_submission_does_not_end_early_either),
		TEST(deadline_in_the_past_returns_at_once),
		TEST(packet_ends_the_wait_before_the_deadline),
		TEST(wait_without_deadline_waits_for_the_packet),
		TEST(signals_do_not_end_the_wait),
		TEST(quiet_wait_is_one_system_call),
		TEST(waiting_packet_saves_the_call),
		TEST(spinning_wait_finds_packet_and_deadline),
		TEST(spinning_wait_flushes_first),
		cmocka_unit_test(all_channels_share_one_wait),
		cmocka_unit_test(flooded_channel_does_not_starve_another),
	};

	fixture_begin(argc, argv);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
