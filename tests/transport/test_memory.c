/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The memory transport keeps the contract that the tests of the loop rely on. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <errno.h>
#include <string.h>
#include "daemon/transport/memory.h"

struct world {
	struct transport *t;
	uint64_t now;
	int left;
	uint64_t left_at;
	uint8_t last[TRANSPORT_SEND_MAX];
};

static const struct transport_address device = { .address = 0x0a000001, .port = 20055 };

static void leaves(void *context, uint32_t channel, const uint8_t *data, size_t length,
		   uint64_t now_ns)
{
	struct world *w = context;

	assert_int_equal(channel, 0);
	memcpy(w->last, data, length);
	w->left++;
	w->left_at = now_ns;
}

static int begin(void **state)
{
	static struct world w;
	struct transport_memory_hooks hooks = { &w.now, leaves, NULL, &w };

	memset(&w, 0, sizeof w);
	w.now = 1000;
	if (transport_memory_open(&w.t, &hooks) || w.t->ops->attach(w.t, 0) ||
	    w.t->ops->start(w.t) || w.t->ops->aim(w.t, 0, &device))
		return -1;
	w.t->statistics.system_calls = 0;
	*state = &w;
	return 0;
}

static int end(void **state)
{
	transport_close(((struct world *)*state)->t);
	return 0;
}

static void datagram_leaves_at_the_flush(void **state)
{
	struct world *w = *state;

	assert_int_equal(w->t->ops->send(w->t, 0, (const uint8_t *)"abc", 3), 0);
	assert_int_equal(w->left, 0);
	w->t->ops->flush(w->t);
	assert_int_equal(w->left, 1);
	assert_memory_equal(w->last, "abc", 3);
	assert_int_equal(w->t->ops->send(w->t, 1, (const uint8_t *)"abc", 3), -EINVAL);
}

static void wait_moves_the_clock_to_the_first_arrival(void **state)
{
	struct world *w = *state;
	struct transport_packet p;

	transport_memory_arrive(w->t, 5000, 0, &device, (const uint8_t *)"second", 6);
	transport_memory_arrive(w->t, 3000, 0, &device, (const uint8_t *)"first", 5);
	assert_int_equal(w->t->ops->receive(w->t, &p), 0);
	assert_int_equal(w->t->ops->wait(w->t, 2000), TRANSPORT_WAIT_DEADLINE);
	assert_int_equal(w->now, 2000);
	assert_int_equal(w->t->ops->wait(w->t, 9000), TRANSPORT_WAIT_PACKET);
	assert_int_equal(w->now, 3000);
	assert_int_equal(w->t->ops->receive(w->t, &p), 1);
	assert_memory_equal(p.data, "first", 5);
	assert_int_equal(p.t_ns, 3000);
	assert_int_equal(p.address, device.address);
	assert_int_equal(w->t->ops->receive(w->t, &p), 0);
	assert_int_equal(w->t->ops->wait(w->t, 9000), TRANSPORT_WAIT_PACKET);
	assert_int_equal(w->t->ops->receive(w->t, &p), 1);
	assert_memory_equal(p.data, "second", 6);
	assert_int_equal(w->t->ops->wait(w->t, 9000), TRANSPORT_WAIT_DEADLINE);
	assert_int_equal(w->now, 9000);
}

static void queue_keeps_order_and_is_bounded(void **state)
{
	struct world *w = *state;
	struct transport_packet p;

	for (int round = 0; round < 3; round++) {
		for (uint32_t i = 0; i < TRANSPORT_MEMORY_QUEUE; i++)
			assert_int_equal(transport_memory_arrive(w->t, w->now + i / 2, 0, &device,
								 (const uint8_t *)&i, sizeof i),
					 0);
		assert_int_equal(transport_memory_arrive(w->t, 1, 0, &device, (const uint8_t *)"x",
							 1),
				 -ENOBUFS);
		for (uint32_t i = 0; i < TRANSPORT_MEMORY_QUEUE; i++) {
			while (!w->t->ops->receive(w->t, &p))
				w->t->ops->wait(w->t, UINT64_MAX);
			assert_memory_equal(p.data, &i, sizeof i);
		}
	}
}

static void calls_are_counted_as_the_ring_would(void **state)
{
	struct world *w = *state;
	struct transport_packet p;

	w->t->ops->send(w->t, 0, (const uint8_t *)"a", 1);
	w->t->ops->wait(w->t, 2000);
	assert_int_equal(w->t->statistics.system_calls, 1);
	transport_memory_arrive(w->t, 2000, 0, &device, (const uint8_t *)"x", 1);
	w->t->ops->wait(w->t, 3000);
	assert_int_equal(w->t->statistics.system_calls, 1);
	assert_int_equal(w->t->statistics.waits_avoided, 1);
	assert_int_equal(w->t->ops->receive(w->t, &p), 1);
	w->t->ops->wait(w->t, 3000);
	assert_int_equal(w->t->statistics.system_calls, 2);
}

static void send_is_refused_while_the_channel_has_an_error(void **state)
{
	struct world *w = *state;

	w->t->error[0] = -ENETUNREACH;
	assert_int_equal(w->t->ops->send(w->t, 0, (const uint8_t *)"a", 1), -ENETUNREACH);
	assert_int_equal(w->t->ops->aim(w->t, 0, &device), 0);
	assert_int_equal(w->t->ops->send(w->t, 0, (const uint8_t *)"a", 1), 0);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, begin, end)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(datagram_leaves_at_the_flush),
		TEST(wait_moves_the_clock_to_the_first_arrival),
		TEST(queue_keeps_order_and_is_bounded),
		TEST(calls_are_counted_as_the_ring_would),
		TEST(send_is_refused_while_the_channel_has_an_error),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
