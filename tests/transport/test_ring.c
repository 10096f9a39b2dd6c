/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What can go wrong with a ring only: queues that run full, buffers that run
 * out, the wrong thread, a kernel without absolute deadlines, and operations
 * that it must not be able to do.
 */
#include "tests/transport/fixture.h"
#include <dirent.h>
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "daemon/transport/uring.h"

/* A ring of unusual size, channel 0 aimed at the peer. */
static struct uring *small_ring(struct peer *peer, unsigned int completions, unsigned int buffers)
{
	const struct transport_options options = { 0 };
	const struct uring_sizes sizes = {
		completions < URING_SUBMISSIONS ? completions : URING_SUBMISSIONS,
		completions,
		buffers,
	};
	struct uring *u = transport_memory_map(sizeof *u);

	assert_non_null(u);
	u->base.ops = &uring_ops;
	assert_int_equal(uring_open_sized(u, &options, &sizes), 0);
	assert_int_equal(uring_attach(&u->base, 0), 0);
	assert_int_equal(uring_start(&u->base), 0);
	peer_open(peer);
	assert_int_equal(u->base.ops->aim(&u->base, 0, &peer->at), 0);
	introduce(&u->base, 0, peer);
	return u;
}

static void expect_in_order(struct uring *u, struct peer *peer, uint32_t count)
{
	struct transport_packet p;

	for (uint32_t i = 0; i < count; i++)
		peer_send(peer, &i, sizeof i);
	for (uint32_t i = 0; i < count; i++) {
		assert_int_equal(next_packet(&u->base, 60000, &p), 1);
		assert_memory_equal(p.data, &i, sizeof i);
	}
	assert_int_equal(next_packet(&u->base, 1, &p), 0);
}

static void full_completion_queue_loses_nothing(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 4, 128);

	(void)state;
	for (int round = 0; round < 5; round++)
		expect_in_order(u, &peer, 100);
	assert_true(u->base.statistics.overflow > 0);
	peer_close(&peer);
	transport_close(&u->base);
}

static void exhausted_buffers_lose_nothing(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 512, 4);

	(void)state;
	for (int round = 0; round < 5; round++)
		expect_in_order(u, &peer, 100);
	assert_true(u->base.statistics.no_buffers > 0);
	assert_true(u->base.statistics.rearmed > 0);
	peer_close(&peer);
	transport_close(&u->base);
}

static void one_single_buffer_is_enough(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 4, 1);

	(void)state;
	expect_in_order(u, &peer, 50);
	peer_close(&peer);
	transport_close(&u->base);
}

static void default_queue_cannot_overflow(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, URING_COMPLETIONS, URING_BUFFERS);

	(void)state;
	for (int round = 0; round < 5; round++)
		expect_in_order(u, &peer, 200);
	assert_int_equal(u->base.statistics.overflow, 0);
	assert_int_equal(u->base.statistics.no_buffers, 0);
	peer_close(&peer);
	transport_close(&u->base);
}

/* The packet handed out stays what it was while others arrive. */
static void packet_is_valid_until_the_next_call(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 64, 2);
	struct transport_packet p;

	(void)state;
	peer_send(&peer, "first", 5);
	assert_int_equal(next_packet(&u->base, 60000, &p), 1);
	for (int i = 0; i < 10; i++)
		peer_send(&peer, "other", 5);
	u->base.ops->flush(&u->base);
	assert_memory_equal(p.data, "first", 5);
	peer_close(&peer);
	transport_close(&u->base);
}

static void *wait_elsewhere(void *argument)
{
	struct uring *u = argument;
	static enum transport_wait result;

	result = u->base.ops->wait(&u->base, fixture_now() + 1000 * (uint64_t)MS);
	return &result;
}

static void second_thread_is_refused_and_told(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 64, 64);
	pthread_t thread;
	void *result;

	(void)state;
	/* the registered descriptor is the first thread's too: use the plain one */
	u->enter_fd = u->ring.ring_fd;
	u->enter_flags &= ~IORING_ENTER_REGISTERED_RING;
	assert_int_equal(pthread_create(&thread, NULL, wait_elsewhere, u), 0);
	pthread_join(thread, &result);
	assert_int_equal(*(enum transport_wait *)result, TRANSPORT_WAIT_DEADLINE);
	assert_int_equal(u->base.failed, -EEXIST);
	peer_close(&peer);
	transport_close(&u->base);
}

/* Put one submission through and return its result. */
static int submit_raw(struct uring *u, uint8_t operation, int fd, uint8_t flags)
{
	struct io_uring_sqe *sqe =
		&u->ring.sq.sqes[u->ring.sq.sqe_tail++ & (u->sizes.submissions - 1)];
	struct io_uring_cqe *cqe;
	unsigned int head;
	int result = 1;

	memset(sqe, 0, sizeof *sqe);
	sqe->opcode = operation;
	sqe->fd = fd;
	sqe->flags = flags;
	sqe->user_data = 77;
	uring_enter(u, 1, NULL);
	io_uring_for_each_cqe(&u->ring, head, cqe)
	{
		if (cqe->user_data == 77)
			result = cqe->res;
	}
	return result;
}

static void ring_can_do_nothing_but_its_work(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 64, 64);
	int fd = u->ring.ring_fd, files[1] = { -1 };

	(void)state;
	assert_int_equal(submit_raw(u, IORING_OP_NOP, -1, 0), -EACCES);
	io_uring_cq_advance(&u->ring, 1);
	assert_int_equal(submit_raw(u, IORING_OP_OPENAT, 0, IOSQE_FIXED_FILE), -EACCES);
	io_uring_cq_advance(&u->ring, 1);
	/* a permitted operation on a descriptor that is not one of the fixed sockets */
	assert_int_equal(submit_raw(u, IORING_OP_SEND, peer.fd, 0), -EACCES);
	io_uring_cq_advance(&u->ring, 1);
	assert_int_equal(submit_raw(u, IORING_OP_SEND, 0, IOSQE_FIXED_FILE | IOSQE_ASYNC), -EACCES);
	io_uring_cq_advance(&u->ring, 1);
	assert_int_equal(syscall(__NR_io_uring_register, fd, IORING_REGISTER_FILES, files, 1), -1);
	assert_int_equal(errno, EACCES);
	peer_close(&peer);
	transport_close(&u->base);
}

static int threads_of_this_process(void)
{
	DIR *d = opendir("/proc/self/task");
	int n = 0;

	assert_non_null(d);
	for (struct dirent *e; (e = readdir(d));)
		n += e->d_name[0] != '.';
	closedir(d);
	return n;
}

static void ring_makes_no_kernel_threads(void **state)
{
	const int before = threads_of_this_process(); /* ThreadSanitizer has one of its own */
	struct peer peer;
	struct uring *u = small_ring(&peer, 512, 64);

	(void)state;
	expect_in_order(u, &peer, 200);
	/* one that a test before had may have been listed still */
	assert_true(threads_of_this_process() <= before);
	peer_close(&peer);
	transport_close(&u->base);
}

/* Before Linux 6.12 the deadline has to be made relative. */
static void wait_works_with_relative_deadlines_too(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 64, 64);
	struct transport_packet p;

	(void)state;
	u->enter_flags &= ~URING_ABS_TIMER;
	for (int i = 0; i < 20; i++) {
		uint64_t deadline = fixture_now() + MS;

		assert_int_equal(u->base.ops->wait(&u->base, deadline), TRANSPORT_WAIT_DEADLINE);
		assert_true(fixture_now() >= deadline);
		peer_send(&peer, &i, sizeof i);
		assert_int_equal(u->base.ops->wait(&u->base, fixture_now() + 5000 * (uint64_t)MS),
				 TRANSPORT_WAIT_PACKET);
		assert_int_equal(u->base.ops->receive(&u->base, &p), 1);
		assert_memory_equal(p.data, &i, sizeof i);
	}
	assert_int_equal(u->base.ops->wait(&u->base, 0), TRANSPORT_WAIT_DEADLINE);
	peer_close(&peer);
	transport_close(&u->base);
}

/* Spinning looks at memory only; it enters the kernel when there is something to fetch. */
static void idle_spin_makes_no_system_call(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 64, 64);
	uint64_t calls = u->base.statistics.system_calls;

	(void)state;
	u->base.spin = true;
	u->base.ops->wait(&u->base, fixture_now() + 5 * MS);
	assert_int_equal(u->base.statistics.system_calls, calls);
	peer_close(&peer);
	transport_close(&u->base);
}

static void send_and_first_answer_are_one_system_call(void **state)
{
	struct peer peer;
	struct uring *u = small_ring(&peer, 64, 64);
	struct transport_packet p;
	uint64_t calls;

	(void)state;
	peer_send(&peer, "x", 1);
	u->base.ops->send(&u->base, 0, (const uint8_t *)"a", 1);
	u->base.ops->send(&u->base, 0, (const uint8_t *)"b", 1);
	calls = u->base.statistics.system_calls;
	assert_int_equal(u->base.ops->wait(&u->base, UINT64_MAX), TRANSPORT_WAIT_PACKET);
	assert_int_equal(u->base.ops->receive(&u->base, &p), 1);
	assert_int_equal(u->base.statistics.system_calls, calls + 1);
	peer_close(&peer);
	transport_close(&u->base);
}

/* A receive that the kernel refuses each time it is armed. */
static void receive_that_keeps_failing_is_no_busy_loop(void **state)
{
	const struct transport_options options = { 0 };
	struct transport *t;
	struct uring *u;
	uint64_t calls;

	(void)state;
	assert_int_equal(transport_open_kind(&t, &transport_uring, &options), 0);
	u = (struct uring *)t;
	assert_int_equal(t->ops->attach(t, 0), 0);
	u->channel[0].shape.msg_controllen = SIZE_MAX;
	assert_int_equal(t->ops->start(t), 0);
	for (int i = 0; i < 10; i++) {
		calls = t->statistics.system_calls;
		assert_int_equal(t->ops->wait(t, fixture_now() + MS), TRANSPORT_WAIT_DEADLINE);
		assert_true(t->statistics.system_calls - calls <= 3);
	}
	assert_true(t->statistics.receive_failed >= 10);
	assert_int_equal(t->failed, 0);
	transport_close(t);
}

static void ring_can_be_made_and_closed_many_times(void **state)
{
	struct peer peer;

	(void)state;
	/* more than the 16 registered descriptors a thread may have */
	for (int i = 0; i < 40; i++) {
		struct uring *u = small_ring(&peer, 64, 16);

		assert_true(u->enter_flags & IORING_ENTER_REGISTERED_RING);
		peer_close(&peer);
		transport_close(&u->base);
	}
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(full_completion_queue_loses_nothing),
		cmocka_unit_test(exhausted_buffers_lose_nothing),
		cmocka_unit_test(one_single_buffer_is_enough),
		cmocka_unit_test(default_queue_cannot_overflow),
		cmocka_unit_test(packet_is_valid_until_the_next_call),
		cmocka_unit_test(second_thread_is_refused_and_told),
		cmocka_unit_test(ring_can_do_nothing_but_its_work),
		cmocka_unit_test(ring_makes_no_kernel_threads),
		cmocka_unit_test(wait_works_with_relative_deadlines_too),
		cmocka_unit_test(idle_spin_makes_no_system_call),
		cmocka_unit_test(send_and_first_answer_are_one_system_call),
		cmocka_unit_test(receive_that_keeps_failing_is_no_busy_loop),
		cmocka_unit_test(ring_can_be_made_and_closed_many_times),
	};

	fixture_begin(argc, argv);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
