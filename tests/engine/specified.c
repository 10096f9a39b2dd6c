/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A program as the specification of the mailbox has it: these four functions,
 * these types, these fields, nothing that takes the time.
 *
 * The clock is the machine's. So that a machine which is busy or held changes
 * nothing, no test says that something has happened by some time: it waits for
 * the clock to pass a moment, says that something has not happened *before* a
 * time, or uses a timeout that no test outlasts.
 */

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>
#include <errno.h>
#include <pokeys/async.h>

#define US 1000ull
#define MS 1000000ull
#define S 1000000000ull
#define HOUR_US 3600000000ull

enum { OP_READ = 0x31, OP_PULSE = 0x85, SUB_HOME = 0x21, TRIES_MAX = 64 };

static int (*const create_request)(pokeys_device_t *dev, pokeys_command_t cmd,
				   const uint8_t *params, size_t params_len, void *target_ptr,
				   size_t target_size) = CreateRequestAsync;
static int (*const send_request)(pokeys_device_t *dev, uint8_t request_id) = SendRequestAsync;
static int (*const receive_and_dispatch)(pokeys_device_t *dev) = PK_ReceiveAndDispatch;
static void (*const timeout_and_retry_check)(pokeys_device_t *dev,
					     uint64_t timeout_us) = PK_TimeoutAndRetryCheck;

static pokeys_device_t dev;

/* A device on the other end: what was sent to it and when, and whether it answers. */
static struct {
	bool answers;
	int send_error;
	unsigned int sent;
	uint64_t times[TRIES_MAX]; /* of the last transmissions, ns */
	uint8_t packet[POKEYS_PACKET_SIZE];
	bool waiting; /* the last packet was not answered yet */
} peer;

static uint64_t clock_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return (uint64_t)now.tv_sec * S + (uint64_t)now.tv_nsec;
}

static void wait_until(uint64_t ns)
{
	const struct timespec a_little = { 0, 100000 };

	while (clock_ns() < ns)
		nanosleep(&a_little, NULL);
}

static int peer_send(void *context, const uint8_t *packet, size_t length)
{
	(void)context;
	assert_int_equal(length, POKEYS_PACKET_SIZE);
	if (peer.send_error)
		return peer.send_error;
	peer.times[peer.sent++ % TRIES_MAX] = dev.mailbox[packet[6]].timestamp_sent;
	memcpy(peer.packet, packet, sizeof(peer.packet));
	peer.waiting = peer.answers;
	return 0;
}

static int peer_receive(void *context, uint8_t *packet, size_t size, struct pokeys_rx *rx)
{
	unsigned int sum = 0;

	(void)context;
	(void)rx;
	if (!peer.waiting)
		return -EAGAIN;
	peer.waiting = false;
	assert_true(size >= POKEYS_PACKET_SIZE);
	memcpy(packet, peer.packet, POKEYS_PACKET_SIZE);
	packet[0] = 0xAA;
	for (unsigned int i = 8; i < POKEYS_PACKET_SIZE; i++)
		packet[i] = (uint8_t)i;
	for (unsigned int i = 0; i < 7; i++)
		sum += packet[i];
	packet[7] = (uint8_t)sum;
	return POKEYS_PACKET_SIZE;
}

static void start(bool answers)
{
	const struct pokeys_io io = { peer_send, peer_receive, NULL };

	memset(&peer, 0, sizeof(peer));
	peer.answers = answers;
	assert_int_equal(pokeys_device_init(&dev, &io, NULL), 0);
}

static mailbox_entry_t *request(pokeys_command_t cmd, uint8_t param)
{
	const int id = create_request(&dev, cmd, &param, 1, NULL, 0);

	assert_in_range(id, 0, 255);
	assert_int_equal(send_request(&dev, (uint8_t)id), 0);
	return &dev.mailbox[id];
}

static void entry_has_the_fields_of_the_specification(void **state)
{
	mailbox_entry_t entry = { 0 };
	uint8_t *request_id = &entry.request_id;
	pokeys_command_t *command_sent = &entry.command_sent;
	uint64_t *timestamp_sent = &entry.timestamp_sent;
	int *retries_left = &entry.retries_left;
	bool *response_ready = &entry.response_ready;
	void **target_ptr = &entry.target_ptr;
	size_t *target_size = &entry.target_size;
	uint8_t(*request_buffer)[64] = &entry.request_buffer;
	uint8_t(*response_buffer)[64] = &entry.response_buffer;

	(void)state;
	assert_int_equal(*request_id + *command_sent + *retries_left + *response_ready, 0);
	assert_true(*timestamp_sent == 0 && *target_size == 0 && *target_ptr == NULL);
	assert_memory_equal(*request_buffer, *response_buffer, 64);
}

static void answer_is_copied_and_marked_ready(void **state)
{
	uint8_t target[10] = { 0 };
	const uint64_t before = clock_ns();
	const mailbox_entry_t *entry;
	int id;

	(void)state;
	start(true);
	timeout_and_retry_check(&dev, HOUR_US); /* no answer is too old */
	id = create_request(&dev, OP_READ, NULL, 0, target, 8);
	assert_in_range(id, 0, 255);
	entry = &dev.mailbox[id];
	assert_true(entry->request_id == id && entry->command_sent == OP_READ);
	assert_true(entry->target_ptr == target && entry->target_size == 8);
	assert_int_equal(peer.sent, 0);
	assert_int_equal(send_request(&dev, (uint8_t)id), 0);
	assert_int_equal(send_request(&dev, (uint8_t)id), -EALREADY);
	assert_true(entry->timestamp_sent >= before && entry->timestamp_sent <= clock_ns());
	assert_memory_equal(entry->request_buffer, peer.packet, 64);
	assert_false(entry->response_ready);
	assert_int_equal(receive_and_dispatch(&dev), 1);
	assert_true(entry->response_ready);
	assert_int_equal(entry->response_buffer[0], 0xAA);
	assert_memory_equal(target, entry->response_buffer + 8, 8);
	assert_int_equal(target[8] + target[9], 0);
	assert_int_equal(receive_and_dispatch(&dev), 0);
}

static void request_is_sent_again_once_the_timeout_has_passed(void **state)
{
	const mailbox_entry_t *entry;

	(void)state;
	start(false);
	entry = request(OP_READ, 0);
	wait_until(entry->timestamp_sent + 2 * MS);
	timeout_and_retry_check(&dev, 2000);
	assert_int_equal(peer.sent, 2);
	assert_int_equal(entry->retries_left, 2);
	assert_int_equal(pokeys_request_state(&dev, entry->request_id), POKEYS_REQUEST_IN_FLIGHT);
}

/* The adaptive deadline, which has passed as well, is not this caller's. */
static void request_waits_for_a_timeout_that_is_long(void **state)
{
	const mailbox_entry_t *entry;

	(void)state;
	start(false);
	entry = request(OP_READ, 0);
	wait_until(entry->deadline);
	timeout_and_retry_check(&dev, HOUR_US);
	timeout_and_retry_check(&dev, UINT64_MAX);
	timeout_and_retry_check(&dev, UINT64_MAX / 1000 + 1);
	assert_int_equal(peer.sent, 1);
	assert_int_equal(entry->retries_left, 3);
	/* and the next call may say something else */
	timeout_and_retry_check(&dev, 1);
	assert_int_equal(peer.sent, 2);
}

static void timeout_of_zero_is_the_adaptive_deadline(void **state)
{
	const mailbox_entry_t *entry;
	uint64_t deadline;

	(void)state;
	start(false);
	entry = request(OP_READ, 0);
	deadline = entry->deadline;
	while (peer.sent == 1)
		timeout_and_retry_check(&dev, 0);
	assert_true(peer.times[1] >= deadline);
	assert_true(deadline - peer.times[0] == dev.options.deadline_initial_ns);
}

static void timeout_counts_from_the_last_transmission_until_the_end(void **state)
{
	const mailbox_entry_t *entry;

	(void)state;
	start(false);
	entry = request(OP_READ, 0);
	while (pokeys_request_state(&dev, entry->request_id) == POKEYS_REQUEST_IN_FLIGHT) {
		assert_int_equal(receive_and_dispatch(&dev), 0);
		timeout_and_retry_check(&dev, 3000);
	}
	assert_int_equal(pokeys_request_state(&dev, entry->request_id), POKEYS_REQUEST_TIMED_OUT);
	assert_int_equal(peer.sent, 4);
	for (unsigned int i = 1; i < peer.sent; i++)
		assert_true(peer.times[i] - peer.times[i - 1] >= 3 * MS);
	assert_true(clock_ns() - peer.times[3] >= 3 * MS);
	assert_int_equal(entry->retries_left, 0);
	assert_false(entry->response_ready);
}

static void oneshot_is_never_sent_twice(void **state)
{
	const mailbox_entry_t *entry;

	(void)state;
	start(false);
	entry = request(OP_PULSE, SUB_HOME);
	while (pokeys_request_state(&dev, entry->request_id) == POKEYS_REQUEST_IN_FLIGHT)
		timeout_and_retry_check(&dev, 1);
	assert_int_equal(pokeys_request_state(&dev, entry->request_id), POKEYS_REQUEST_UNKNOWN);
	assert_int_equal(peer.sent, 1);
	assert_true(clock_ns() - peer.times[0] >= dev.options.deadline_ceiling_ns);
}

static void deadline_of_a_requests_own_goes_before_the_timeout(void **state)
{
	const uint64_t minute_ns = 60 * S;
	int id;

	(void)state;
	start(false);
	id = create_request(&dev, OP_READ, NULL, 0, NULL, 0);
	assert_in_range(id, 0, 255);
	assert_int_equal(pokeys_request_set_deadline(&dev, (uint8_t)id, minute_ns), 0);
	assert_int_equal(send_request(&dev, (uint8_t)id), 0);
	wait_until(peer.times[0] + 1 * MS);
	timeout_and_retry_check(&dev, 1);
	if (clock_ns() < peer.times[0] + minute_ns)
		assert_int_equal(peer.sent, 1);
}

static void request_that_the_transport_refuses_waits_before_it_is_tried_again(void **state)
{
	const mailbox_entry_t *entry;

	(void)state;
	start(false);
	peer.send_error = -ENOBUFS;
	entry = request(OP_READ, 0);
	timeout_and_retry_check(&dev, HOUR_US);
	assert_int_equal(entry->retries_left, 3);
	peer.send_error = 0;
	wait_until(clock_ns() + 1 * US);
	timeout_and_retry_check(&dev, 1);
	assert_int_equal(entry->retries_left, 2);
	assert_int_equal(peer.sent, 1);
}

/* Four turns of the ids: they rest by the clock that these functions read. */
static void thousand_requests_need_no_other_function(void **state)
{
	unsigned int done = 0;
	uint64_t last[POKEYS_MAILBOX_SIZE] = { 0 };
	int id = -1;

	(void)state;
	start(true);
	timeout_and_retry_check(&dev, HOUR_US); /* no answer is too old */
	while (done < 1024) {
		if (id < 0)
			id = create_request(&dev, OP_READ, NULL, 0, NULL, 0);
		if (id >= 0 && send_request(&dev, (uint8_t)id) == 0) {
			const uint64_t sent = dev.mailbox[id].timestamp_sent;

			assert_true(!last[id] || sent - last[id] >= dev.options.id_rest_ns);
			last[id] = sent;
		}
		receive_and_dispatch(&dev);
		timeout_and_retry_check(&dev, HOUR_US);
		if (id < 0 || !dev.mailbox[id].response_ready)
			continue;
		done++;
		id = -1;
	}
	assert_int_equal(dev.statistics.done, 1024);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(entry_has_the_fields_of_the_specification),
		cmocka_unit_test(answer_is_copied_and_marked_ready),
		cmocka_unit_test(request_is_sent_again_once_the_timeout_has_passed),
		cmocka_unit_test(request_waits_for_a_timeout_that_is_long),
		cmocka_unit_test(timeout_of_zero_is_the_adaptive_deadline),
		cmocka_unit_test(timeout_counts_from_the_last_transmission_until_the_end),
		cmocka_unit_test(oneshot_is_never_sent_twice),
		cmocka_unit_test(deadline_of_a_requests_own_goes_before_the_timeout),
		cmocka_unit_test(request_that_the_transport_refuses_waits_before_it_is_tried_again),
		cmocka_unit_test(thousand_requests_need_no_other_function),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
