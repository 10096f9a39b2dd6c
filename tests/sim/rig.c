// SPDX-License-Identifier: GPL-2.0-or-later
/* The rig: requests are served one by one, in order, each answered once. */
#include "tests/sim/talk.h"

#include "sim/rig.h"

static struct sim_rig rig;

static void make(uint8_t *rq, uint8_t op, uint8_t id)
{
	memset(rq, 0, WIRE_PK);
	rq[0] = WIRE_REQUEST;
	rq[1] = op;
	wire_finish(rq, id);
}

static void reply_comes_after_travel_and_service(void **state)
{
	struct sim_rig_options options = { .service_ns = 300000 };
	uint8_t rq[WIRE_PK], rp[WIRE_PK];

	(void)state;
	options.link.faults[SIM_LINK_REQUEST].delay.low_ns = 50000;
	options.link.faults[SIM_LINK_REPLY].delay.low_ns = 70000;
	sim_rig_init(&rig, &options);
	assert_true(sim_rig_next(&rig) == SIM_RIG_NEVER);
	make(rq, 0x05, 9);
	sim_rig_send(&rig, 1000, rq, sizeof(rq));
	assert_int_equal(sim_rig_next(&rig), 51000);
	assert_int_equal(sim_rig_receive(&rig, 51000, rp, sizeof(rp)), 0);
	assert_int_equal(sim_rig_next(&rig), 351000);
	assert_int_equal(sim_rig_receive(&rig, 351000, rp, sizeof(rp)), 0);
	assert_int_equal(sim_rig_next(&rig), 421000);
	assert_int_equal(sim_rig_receive(&rig, 420999, rp, sizeof(rp)), 0);
	assert_int_equal(sim_rig_receive(&rig, 421000, rp, sizeof(rp)), 64);
	assert_int_equal(rp[6], 9);
	assert_int_equal(sim_rig_receive(&rig, 421000, rp, sizeof(rp)), 0);
	assert_true(sim_rig_next(&rig) == SIM_RIG_NEVER);
}

static void parallel_requests_are_served_in_order(void **state)
{
	struct sim_rig_options options = { .service_ns = 100000 };
	uint8_t rq[WIRE_PK], rp[WIRE_PK];

	(void)state;
	sim_rig_init(&rig, &options);
	for (uint8_t i = 0; i < 10; i++) {
		make(rq, 0x05, i);
		sim_rig_send(&rig, 0, rq, sizeof(rq));
	}
	for (uint8_t i = 0; i < 10; i++) {
		uint64_t due = UINT64_C(100000) * (i + 1u);

		assert_int_equal(sim_rig_receive(&rig, due - 1, rp, sizeof(rp)), 0);
		assert_int_equal(sim_rig_receive(&rig, due, rp, sizeof(rp)), 64);
		assert_int_equal(rp[6], i);
	}
}

static void a_large_step_gives_what_many_small_ones_give(void **state)
{
	struct sim_rig_options options = { .service_ns = 20000, .jitter_ns = 50000, .seed = 7 };
	uint8_t rq[WIRE_PK], rp[WIRE_PK];
	uint64_t sum[2] = { 0, 0 };

	(void)state;
	options.link.faults[SIM_LINK_REQUEST].loss = 0.2;
	options.link.faults[SIM_LINK_REPLY].reorder = 0.2;
	options.link.faults[SIM_LINK_REPLY].reorder_ns = 200000;
	for (int fine = 0; fine < 2; fine++) {
		unsigned int place = 0;

		sim_rig_init(&rig, &options);
		for (unsigned int i = 0; i < 200; i++) {
			make(rq, 0x05, (uint8_t)i);
			sim_rig_send(&rig, i * 1000, rq, sizeof(rq));
			if (fine)
				sim_rig_run(&rig, i * 1000);
		}
		while (sim_rig_receive(&rig, 100 * MS, rp, sizeof(rp)))
			sum[fine] = sum[fine] * 31 + rp[6] + ++place;
	}
	assert_true(sum[0] != 0);
	assert_int_equal(sum[0], sum[1]);
}

static void a_full_queue_loses_requests(void **state)
{
	struct sim_rig_options options = { .service_ns = MS };
	uint8_t rq[WIRE_PK], rp[WIRE_PK];
	unsigned int replies = 0;

	(void)state;
	sim_rig_init(&rig, &options);
	for (unsigned int i = 0; i < SIM_RIG_QUEUE + 20; i++) {
		make(rq, 0x05, (uint8_t)i);
		sim_rig_send(&rig, 0, rq, sizeof(rq));
	}
	sim_rig_run(&rig, 0);
	assert_int_equal(rig.stats.overflow, 20);
	while (sim_rig_receive(&rig, 1000 * MS, rp, sizeof(rp)))
		replies++;
	assert_int_equal(replies, SIM_RIG_QUEUE);
}

static unsigned int streamed_waiting(void)
{
	return sim_rig_waiting(&rig, SIM_PEER_RELIABLE, SIM_PEER_RELIABLE);
}

static void a_stream_has_places_of_its_own(void **state)
{
	struct sim_rig_options options = { .service_ns = MS };
	uint8_t rq[WIRE_PK], rp[WIRE_PK];
	unsigned int replies[2] = { 0, 0 };
	unsigned int streamed = 0;
	uint64_t peer;
	size_t len;

	(void)state;
	sim_rig_init(&rig, &options);
	for (unsigned int i = 0; i < SIM_RIG_QUEUE + 20; i++) {
		make(rq, 0x05, (uint8_t)i);
		sim_rig_send(&rig, 0, rq, sizeof(rq));
	}
	for (; streamed_waiting() < SIM_RIG_STREAM; streamed++) {
		make(rq, 0x05, (uint8_t)streamed);
		sim_rig_send_from(&rig, 0, SIM_PEER_RELIABLE, rq, sizeof(rq));
	}
	assert_int_equal(streamed, SIM_RIG_STREAM);
	assert_int_equal(rig.stats.overflow, 20);
	while (sim_rig_receive_for(&rig, 1000 * MS, &peer, rp, sizeof(rp), &len)) {
		unsigned int kind = peer == SIM_PEER_RELIABLE;

		assert_int_equal(rp[6], replies[kind]++ & 0xFF);
	}
	assert_int_equal(replies[0], SIM_RIG_QUEUE);
	assert_int_equal(replies[1], SIM_RIG_STREAM);
	assert_int_equal(streamed_waiting(), 0);
	assert_int_equal(rig.stats.overflow, 20);
}

static void a_reboot_empties_the_places_of_streams(void **state)
{
	struct sim_rig_options options = { .service_ns = MS };
	uint8_t rq[WIRE_PK];

	(void)state;
	sim_rig_init(&rig, &options);
	make(rq, 0x05, 1);
	while (streamed_waiting() < SIM_RIG_STREAM)
		sim_rig_send_from(&rig, 0, SIM_PEER_RELIABLE, rq, sizeof(rq));
	sim_rig_reboot(&rig, 100, false);
	assert_int_equal(streamed_waiting(), 0);
}

static void a_reboot_loses_what_waits_and_answers_after_its_dead_time(void **state)
{
	struct sim_rig_options options = { .service_ns = MS };
	uint8_t rq[WIRE_PK], rp[WIRE_PK];

	(void)state;
	options.device.boot_ms = 100;
	sim_rig_init(&rig, &options);
	make(rq, 0x05, 1);
	sim_rig_send(&rig, 0, rq, sizeof(rq));
	sim_rig_reboot(&rig, 100, false);
	assert_int_equal(sim_rig_receive(&rig, 50 * MS, rp, sizeof(rp)), 0);
	make(rq, 0x05, 2);
	sim_rig_send(&rig, 50 * MS, rq, sizeof(rq));
	assert_int_equal(sim_rig_receive(&rig, 60 * MS, rp, sizeof(rp)), 0);
	assert_int_equal(rig.device.stats.dropped[SIM_DROP_BOOTING], 1);
	sim_rig_send(&rig, 101 * MS, rq, sizeof(rq));
	assert_int_equal(sim_rig_receive(&rig, 110 * MS, rp, sizeof(rp)), 64);
}

static void saving_to_flash_keeps_the_next_request_waiting(void **state)
{
	struct sim_rig_options options = { .service_ns = 100000, .save_ns = 200 * MS };
	uint8_t rq[WIRE_PK], rp[WIRE_PK];

	(void)state;
	sim_rig_init(&rig, &options);
	make(rq, 0x50, 1);
	rq[2] = 0xAA;
	rq[3] = 0x55;
	wire_finish(rq, 1);
	sim_rig_send(&rig, 0, rq, sizeof(rq));
	assert_int_equal(sim_rig_receive(&rig, MS, rp, sizeof(rp)), 64);
	make(rq, 0x05, 2);
	sim_rig_send(&rig, MS, rq, sizeof(rq));
	assert_int_equal(sim_rig_next(&rig), MS);
	assert_int_equal(sim_rig_receive(&rig, 200 * MS, rp, sizeof(rp)), 0);
	assert_int_equal(sim_rig_receive(&rig, 200 * MS + 200000, rp, sizeof(rp)), 64);
}

static void silence_lets_nothing_through(void **state)
{
	uint8_t rq[WIRE_PK], rp[WIRE_PK];

	(void)state;
	sim_rig_init(&rig, NULL);
	sim_rig_silence(&rig, 0, 10 * MS);
	make(rq, 0x05, 1);
	sim_rig_send(&rig, 9 * MS, rq, sizeof(rq));
	assert_int_equal(sim_rig_receive(&rig, 9 * MS, rp, sizeof(rp)), 0);
	sim_rig_send(&rig, 10 * MS, rq, sizeof(rq));
	assert_int_equal(sim_rig_receive(&rig, 10 * MS, rp, sizeof(rp)), 64);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(reply_comes_after_travel_and_service),
		cmocka_unit_test(parallel_requests_are_served_in_order),
		cmocka_unit_test(a_large_step_gives_what_many_small_ones_give),
		cmocka_unit_test(a_full_queue_loses_requests),
		cmocka_unit_test(a_stream_has_places_of_its_own),
		cmocka_unit_test(a_reboot_empties_the_places_of_streams),
		cmocka_unit_test(a_reboot_loses_what_waits_and_answers_after_its_dead_time),
		cmocka_unit_test(saving_to_flash_keeps_the_next_request_waiting),
		cmocka_unit_test(silence_lets_nothing_through),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
