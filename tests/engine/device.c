/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The mailbox against the device model, as the daemon polls a 57CNC: every
 * reply of the model is accepted, and the model executes a one-shot once,
 * whatever the network does.
 */

#include "sim/rig.h"
#include "tests/engine/world.h"

static struct sim_rig rig;
static pokeys_device_t dev;
static uint64_t now;

static int rig_send(void *context, const uint8_t *packet, size_t length)
{
	(void)context;
	sim_rig_send(&rig, now, packet, length);
	return 0;
}

static int rig_receive(void *context, uint8_t *packet, size_t size, struct pokeys_rx *rx)
{
	const size_t length = sim_rig_receive(&rig, now, packet, size);

	(void)context;
	rx->t_ns = now;
	return length ? (int)length : -EAGAIN;
}

static void start(const struct sim_rig_options *options)
{
	const struct pokeys_io io = { rig_send, rig_receive, NULL };

	now = S;
	sim_rig_init(&rig, options);
	assert_int_equal(pokeys_device_init(&dev, &io, NULL), 0);
}

static void run(uint64_t for_ns)
{
	const uint64_t end = now + for_ns;

	for (; now < end; now += 50 * US) {
		pokeys_device_receive(&dev, now);
		pokeys_device_check(&dev, now);
	}
}

static int request(uint8_t op, uint8_t p1, void *target, size_t size)
{
	const int id = CreateRequestAsync(&dev, op, &p1, 1, target, size);

	if (id >= 0)
		assert_int_equal(pokeys_request_send(&dev, (uint8_t)id, now), 0);
	return id;
}

static void device_is_identified(void **state)
{
	uint8_t data[POKEYS_PAYLOAD_SIZE];
	int id;

	(void)state;
	start(NULL);
	id = request(0x00, 0, data, sizeof(data));
	run(1 * MS);
	assert_int_equal(pokeys_request_state(&dev, (uint8_t)id), POKEYS_REQUEST_DONE);
	assert_memory_equal(data, "PKEx", 4);
	assert_int_equal(wire_get_u32(data + 4), 65432);
}

/* Each request of the table that only reads: answered, and the answer accepted. */
static void answer_to_every_read_is_accepted(void **state)
{
	unsigned int reads = 0;

	(void)state;
	start(NULL);
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const struct wire_op_row *row = wire_op((enum wire_op)op);
		const uint8_t packet[POKEYS_PACKET_SIZE] = { 0xBB, row->id, row->sub.first };
		int id;

		if (wire_request_class(row, packet) != WIRE_READ)
			continue;
		id = request(row->id, row->sub.first, NULL, 0);
		assert_true(id >= 0);
		run(1 * MS);
		if (pokeys_request_state(&dev, (uint8_t)id) != POKEYS_REQUEST_DONE)
			fail_msg("%s: the answer was not accepted", row->name);
		assert_int_equal(pokeys_request_free(&dev, (uint8_t)id), 0);
		reads++;
	}
	assert_true(reads > 50);
	assert_int_equal(dev.statistics.received, reads);
}

/* A 57CNC as it was measured: 0.38 ms a request, jitter, rare 5 ms (protocol section 5.4). */
static const struct sim_rig_options real = {
	.service_ns = 300 * US,
	.jitter_ns = 200 * US,
	.hiccup = 0.002,
	.hiccup_ns = 5 * MS,
	.link.faults = { { .delay = { SIM_DELAY_UNIFORM, 30 * US, 60 * US, 0 } },
			 { .delay = { SIM_DELAY_UNIFORM, 30 * US, 60 * US, 0 } } },
};

/* Polls inputs and status at 1 kHz; how many requests were created. */
static unsigned int poll_for(uint64_t for_ns)
{
	const uint64_t end = now + for_ns;
	unsigned int created = 0;
	int io = -1, status = -1;

	while (now < end) {
		if (io < 0 || pokeys_request_free(&dev, (uint8_t)io) == 0)
			io = request(OP_IO, 0, NULL, 0);
		if (status < 0 || pokeys_request_free(&dev, (uint8_t)status) == 0)
			status = request(OP_PULSE, SUB_STATUS, NULL, 0);
		created += (io >= 0 ? 1u : 0) + (status >= 0 ? 1u : 0);
		run(1 * MS);
	}
	return created;
}

static void device_as_slow_as_a_real_one_is_polled_without_loss(void **state)
{
	(void)state;
	start(&real);
	poll_for(20 * S);
	run(1 * S);
	print_message("round trip %u us, resent %u of %u\n",
		      (unsigned int)(dev.statistics.rtt_smoothed_ns / US),
		      (unsigned int)dev.statistics.resent, (unsigned int)dev.statistics.created);
	assert_int_equal(dev.statistics.done, dev.statistics.created);
	/* the hiccups that come without warning, and what waits behind them */
	assert_true(dev.statistics.resent <= dev.statistics.created / 50);
	assert_int_equal(dev.statistics.bad_operation + dev.statistics.bad_check +
				 dev.statistics.stale + dev.statistics.not_in_flight,
			 0);
}

static void reboot_in_mid_transaction_is_survived(void **state)
{
	struct sim_rig_options options = real;
	uint64_t done;

	(void)state;
	options.device.boot_ms = 300;
	start(&options);
	poll_for(1 * S);
	for (unsigned int i = 0; i < 20; i++) {
		run(i * 50 * US);
		request(OP_IO, 0, NULL, 0);
		sim_rig_reboot(&rig, now, true);
		poll_for(300 * MS);
		pokeys_device_reset(&dev, now);
		for (unsigned int id = 0; id < POKEYS_MAILBOX_SIZE; id++)
			pokeys_request_free(&dev, (uint8_t)id);
		done = dev.statistics.done;
		poll_for(100 * MS);
		assert_true(dev.statistics.done > done + 100);
	}
	assert_int_equal(dev.statistics.bad_operation + dev.statistics.bad_check, 0);
}

/* I4, counted by the device itself. */
static void device_never_executes_a_oneshot_twice(void **state)
{
	struct sim_rig_options options = real;
	unsigned int sent = 0, unknown = 0;

	(void)state;
	options.seed = world_seed(51);
	options.link.faults[SIM_LINK_REQUEST].loss = 0.2;
	options.link.faults[SIM_LINK_REPLY].loss = 0.2;
	options.link.faults[SIM_LINK_REPLY].reorder = 0.1;
	options.link.faults[SIM_LINK_REPLY].reorder_ns = 80 * MS;
	start(&options);
	for (unsigned int i = 0; i < 500; i++) {
		const uint64_t before = rig.device.stats.executed_pe[SUB_HOME];
		const int id = request(OP_PULSE, SUB_HOME, NULL, 0);

		assert_true(id >= 0);
		sent++;
		run(60 * MS);
		assert_true(rig.device.stats.executed_pe[SUB_HOME] <= before + 1);
		if (pokeys_request_state(&dev, (uint8_t)id) == POKEYS_REQUEST_DONE)
			assert_int_equal(rig.device.stats.executed_pe[SUB_HOME], before + 1);
		else
			unknown++;
		assert_int_equal(pokeys_request_free(&dev, (uint8_t)id), 0);
	}
	assert_int_equal(dev.statistics.sent, sent);
	assert_int_equal(dev.statistics.unknown, unknown);
	assert_in_range(unknown, 100, 300);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(device_is_identified),
		cmocka_unit_test(answer_to_every_read_is_accepted),
		cmocka_unit_test(device_as_slow_as_a_real_one_is_polled_without_loss),
		cmocka_unit_test(reboot_in_mid_transaction_is_survived),
		cmocka_unit_test(device_never_executes_a_oneshot_twice),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
