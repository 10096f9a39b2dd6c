/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One cycle after another, in virtual time: when packets leave, when replies
 * are taken, when images come out, and what a bad network costs.
 */
#include "tests/rt/doubles.h"
#include <string.h>

static int begin_one(void **state)
{
	(void)state;
	world_begin(1);
	return 0;
}

static int begin_two(void **state)
{
	(void)state;
	world_begin(2);
	return 0;
}

static int begin_all(void **state)
{
	(void)state;
	world_begin(TRANSPORT_CHANNELS);
	return 0;
}

static int end(void **state)
{
	(void)state;
	world_end();
	return 0;
}

static void ticks_lie_on_the_period(void **state)
{
	const struct device *d = &world.device[0];

	(void)state;
	assert_int_equal(world_run(SECOND), 0);
	assert_in_range(d->cycles, 998, 1002);
	for (uint64_t i = 1; i < d->cycles; i++)
		assert_int_equal(d->tick_log[i] - d->tick_log[i - 1], MS);
	assert_int_equal(world.loop.own->skipped, 0);
	assert_int_equal(world.loop.shared.cycles, d->cycles);
}

static void requests_leave_at_the_tick(void **state)
{
	(void)state;
	assert_int_equal(world_run(20 * MS), 0);
	for (uint64_t i = 0; i < world.sent[0]; i++)
		assert_int_equal(world.sent_log[0][i], world.device[0].tick_log[i / 2]);
}

static void image_is_published_when_the_fast_replies_are_in(void **state)
{
	(void)state;
	assert_int_equal(world_run(20 * MS), 0);
	/* and the last one */
	assert_int_equal(world.shm[0].published, world.device[0].cycles + 1);
	for (uint64_t i = 0; i < world.device[0].cycles; i++)
		assert_int_equal(world.shm[0].published_log[i],
				 world.device[0].tick_log[i] + 100 * US);
}

static void window_end_publishes_without_the_reply(void **state)
{
	(void)state;
	world.round_trip_ns[0] = 0;
	world.device[0].deadline_ns = 50 * MS;
	assert_int_equal(world_run(3 * MS), 0);
	assert_true(world.device[0].cycles >= 3);
	for (uint64_t i = 0; i < 3; i++)
		assert_int_equal(world.shm[0].published_log[i],
				 world.device[0].tick_log[i] + 500 * US);
}

static void slow_reply_does_not_hold_back_the_image(void **state)
{
	(void)state;
	world.device[0].slow = 1;
	world.device[0].fast = 0;
	world.round_trip_ns[0] = 700 * US;
	world.device[0].deadline_ns = 5 * MS;
	assert_int_equal(world_run(20 * MS), 0);
	for (uint64_t i = 0; i < world.device[0].cycles; i++)
		assert_int_equal(world.shm[0].published_log[i], world.device[0].tick_log[i]);
}

static void lost_packet_is_resent_exactly_at_its_deadline(void **state)
{
	(void)state;
	world.lose = 11; /* the first request of the sixth cycle */
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(world.device[0].resent, 1);
	assert_int_equal(world.sent_log[0][12], world.device[0].tick_log[5] + 300 * US);
	/* so it costs its deadline and one round trip, and nothing afterwards */
	assert_int_equal(world.shm[0].published_log[5],
			 world.device[0].tick_log[5] + 300 * US + 100 * US);
	assert_int_equal(world.shm[0].published_log[6], world.device[0].tick_log[6] + 100 * US);
}

static void wake_late(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] % 10 == 0)
		w->wait_late_ns = (w->sent[0] / 10 % 4) * 700 * US;
}

/* The thread woke up after the deadlines, after the window, after the tick. */
static void reply_that_waits_is_not_taken_for_a_lost_one(void **state)
{
	(void)state;
	world.on_sent = wake_late;
	assert_int_equal(world_run(200 * MS), 0);
	assert_true(world.device[0].delivered > 300);
	assert_int_equal(world.device[0].resent, 0);
}

static void deadline_after_the_window_is_kept_too(void **state)
{
	(void)state;
	world.device[0].deadline_ns = 800 * US;
	world.lose = 11;
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(world.sent_log[0][12], world.device[0].tick_log[5] + 800 * US);
	assert_int_equal(world.shm[0].published_log[5], world.device[0].tick_log[5] + 500 * US);
}

static void late_reply_is_taken_when_it_comes(void **state)
{
	(void)state;
	world.round_trip_ns[0] = 700 * US;
	world.device[0].deadline_ns = 900 * US;
	assert_int_equal(world_run(20 * MS), 0);
	/* not delivered when the next cycle looks, but at once: no resend, no backlog */
	assert_int_equal(world.device[0].resent, 0);
	assert_int_equal(world.device[0].delivered_late_ns, 0);
	assert_true(world.device[0].delivered > 30);
}

static void dead_device_does_not_delay_another(void **state)
{
	(void)state;
	world.round_trip_ns[1] = 0;
	world.device[1].deadline_ns = 200 * US;
	assert_int_equal(world_run(20 * MS), 0);
	for (uint64_t i = 0; i < world.device[0].cycles; i++)
		assert_int_equal(world.shm[0].published_log[i],
				 world.device[0].tick_log[i] + 100 * US);
	assert_true(world.device[1].resent > 20);
}

static void searching_device_is_published_without_waiting(void **state)
{
	(void)state;
	world.device[1].fast = 0;
	world.publish_takes_ns = 3 * US;
	assert_int_equal(world_run(20 * MS), 0);
	for (uint64_t i = 0; i < world.device[0].cycles; i++) {
		/* the other one's requests had left before, and its replies were not waited for */
		assert_int_equal(world.sent_log[0][2 * i], world.device[0].tick_log[i]);
		assert_int_equal(world.shm[1].published_log[i], world.device[0].tick_log[i]);
		assert_int_equal(world.shm[0].published_log[i],
				 world.device[0].tick_log[i] + 100 * US);
	}
}

static void stray(struct world *w, uint64_t at_ns)
{
	const uint8_t data[64] = { 0xaa, 0xff };

	transport_memory_arrive(w->t, at_ns, 0, &w->aimed_at[0], data, sizeof data);
}

/* 200 of them between request and reply. */
static void strays_with_the_requests(struct world *w, uint32_t channel, const uint8_t *data,
				     size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 11)
		for (uint64_t i = 0; i < 200; i++)
			stray(w, w->now + 10 * US);
}

static void burst_of_200_strays_costs_nothing(void **state)
{
	(void)state;
	world.on_sent = strays_with_the_requests;
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(world.device[0].delivered, 2 * world.device[0].cycles + 200);
	assert_int_equal(world.device[0].resent, 0);
	for (uint64_t i = 0; i < world.device[0].cycles; i++)
		assert_int_equal(world.shm[0].published_log[i],
				 world.device[0].tick_log[i] + 100 * US);
}

/* 200 of them when nothing is in flight any more. */
static void strays_in_the_gap(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 12)
		for (uint64_t i = 0; i < 200; i++)
			stray(w, w->now + (200 + i) * US);
}

static void strays_in_the_gap_wake_nobody(void **state)
{
	uint64_t waits;

	(void)state;
	assert_int_equal(world_run(20 * MS), 0);
	waits = world.waits;
	world_end();
	world_begin(1);
	world.on_sent = strays_in_the_gap;
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(world.device[0].delivered, 2 * world.device[0].cycles + 200);
	/* they are found at the first wait of the next cycle, one more is needed then */
	assert_true(world.waits <= waits + 1);
	assert_int_equal(world.shm[0].published_log[6], world.device[0].tick_log[6] + 100 * US);
}

static void reply_answered_by_a_stray(struct world *w, uint32_t channel, const uint8_t *data,
				      size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	/* a flood: more packets than can be delivered in a whole period, for ever */
	for (uint64_t i = 0; i < 200; i++)
		stray(w, w->now + i);
}

static void flood_does_not_hold_up_the_ticks(void **state)
{
	const struct device *d = &world.device[0];

	(void)state;
	world.on_sent = reply_answered_by_a_stray;
	world.device[0].deliver_takes_ns = 10 * US;
	world.device[0].deadline_ns = 50 * MS;
	assert_int_equal(world_run(50 * MS), 0);
	assert_true(d->cycles >= 48);
	for (uint64_t i = 1; i < d->cycles; i++)
		assert_int_equal(d->tick_log[i] - d->tick_log[i - 1], MS);
	assert_true(world.loop.own->wakeup.max_ns <= 20 * US);
}

static void flood_other_device(struct world *w, uint32_t channel, const uint8_t *data,
			       size_t length)
{
	const uint8_t stray_data[64] = { 0xaa, 0xff };

	(void)data;
	(void)length;
	if (channel == 1 && w->sent[1] % 2)
		for (uint64_t i = 0; i < 200; i++)
			transport_memory_arrive(w->t, w->now + i * 2 * US, 1, &w->aimed_at[1],
						stray_data, sizeof stray_data);
}

static void flooded_device_does_not_delay_another(void **state)
{
	(void)state;
	/*
	 * Those that came in the gap are taken while the device answers, so
	 * they cost nothing as long as that takes no longer than the answer.
	 */
	world.on_sent = flood_other_device;
	world.device[1].deliver_takes_ns = 500;
	assert_int_equal(world_run(50 * MS), 0);
	assert_true(world.device[1].delivered > 40 * 200);
	for (uint64_t i = 0; i < world.device[0].cycles; i++)
		assert_in_range(world.shm[0].published_log[i],
				world.device[0].tick_log[i] + 100 * US,
				world.device[0].tick_log[i] + 105 * US);
}

static void device_that_stays_overdue_is_no_busy_loop(void **state)
{
	(void)state;
	world.device[0].overdue = true;
	assert_int_equal(world_run(20 * MS), 0);
	assert_true(world.device[0].checked <= world.device[0].cycles * 60);
	assert_true(world.device[0].cycles >= 19);
}

static void cycle_is_two_system_calls_and_one_for_each_reply(void **state)
{
	uint64_t calls, cycles;

	(void)state;
	world.device[0].slow = 1;
	assert_int_equal(world_run(SECOND), 0);
	cycles = world.device[0].cycles;
	calls = world.t->statistics.system_calls - world.aims + world.loop.own->sleeps;
	assert_true(calls <= 2 * cycles + world.device[0].delivered);
	/* and in fact fewer: the replies arrive at one moment here */
	assert_true(calls <= 3 * cycles);
	assert_int_equal(world.sleeps, world.loop.own->sleeps);
}

static void nothing_in_flight_means_one_sleep_to_the_tick(void **state)
{
	(void)state;
	world.device[0].fast = 0;
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(world.sleeps, world.device[0].cycles);
	assert_int_equal(world.waits, 0);
}

static void channel_without_device_is_ignored(void **state)
{
	(void)state;
	transport_memory_arrive(world.t, world.now, 3, &world.aimed_at[0], (const uint8_t *)"x", 1);
	assert_int_equal(world_run(5 * MS), 0);
	assert_int_equal(world.device[0].delivered, 2 * world.device[0].cycles);
}

static void as_many_devices_as_there_may_be_have_no_part_in_each_other(void **state)
{
	enum { LAST = TRANSPORT_CHANNELS - 1 };

	(void)state;
	world.round_trip_ns[LAST] = 0;
	world.device[LAST].wants_address = true;
	atomic_store(&world.loop.shared.in_use, UINT64_C(1) << (LAST - 1));
	assert_int_equal(world_run(20 * MS), 0);
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++) {
		const struct device *d = &world.device[i];

		assert_in_range(d->cycles, 19, 21);
		assert_int_equal(d->in_use, i == LAST - 1);
		assert_int_equal(world.shm[i].published_log[2],
				 d->tick_log[2] + (i == LAST ? 500 * US : 100 * US));
	}
	assert_int_equal(world.loop.shared.wanted, UINT64_C(1) << LAST);
	assert_int_equal(world.loop.shared.notify, UINT64_MAX);
}

#define ONE(f) cmocka_unit_test_setup_teardown(f, begin_one, end)
#define TWO(f) cmocka_unit_test_setup_teardown(f, begin_two, end)
#define ALL(f) cmocka_unit_test_setup_teardown(f, begin_all, end)

int main(void)
{
	const struct CMUnitTest tests[] = {
		ONE(ticks_lie_on_the_period),
		ALL(as_many_devices_as_there_may_be_have_no_part_in_each_other),
		ONE(requests_leave_at_the_tick),
		ONE(image_is_published_when_the_fast_replies_are_in),
		ONE(window_end_publishes_without_the_reply),
		ONE(slow_reply_does_not_hold_back_the_image),
		ONE(lost_packet_is_resent_exactly_at_its_deadline),
		ONE(reply_that_waits_is_not_taken_for_a_lost_one),
		ONE(deadline_after_the_window_is_kept_too),
		ONE(late_reply_is_taken_when_it_comes),
		TWO(dead_device_does_not_delay_another),
		TWO(searching_device_is_published_without_waiting),
		ONE(burst_of_200_strays_costs_nothing),
		ONE(strays_in_the_gap_wake_nobody),
		ONE(flood_does_not_hold_up_the_ticks),
		TWO(flooded_device_does_not_delay_another),
		ONE(device_that_stays_overdue_is_no_busy_loop),
		ONE(cycle_is_two_system_calls_and_one_for_each_reply),
		ONE(nothing_in_flight_means_one_sleep_to_the_tick),
		ONE(channel_without_device_is_ignored),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
