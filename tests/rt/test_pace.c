/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Missed ticks, and how much of its time the thread runs, in virtual time.
 */
#include "tests/rt/doubles.h"
#include <string.h>
#include "daemon/rt/realtime.h"

static int begin_one(void **state)
{
	(void)state;
	world_begin(1);
	return 0;
}

static int end(void **state)
{
	(void)state;
	world_end();
	return 0;
}

/* At the 10th sleep of the run the thread is away for so much longer. */
static uint64_t stall_ns;

static void stall_once(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 20)
		w->oversleep_ns = stall_ns;
}

static void stall(uint64_t ns, uint64_t run_ns)
{
	stall_ns = ns;
	world.on_sent = stall_once;
	assert_int_equal(world_run(run_ns), 0);
}

static void stall_of_five_seconds_is_one_skip_and_no_burst(void **state)
{
	const struct device *d = &world.device[0];
	const struct event *e;

	(void)state;
	stall(5 * SECOND, 6 * SECOND);
	assert_int_equal(world.loop.shared.skipped, 5000);
	assert_int_equal(d->tick_log[10] - d->tick_log[9], 5001 * MS);
	for (uint64_t i = 11; i < d->cycles; i++)
		assert_int_equal(d->tick_log[i] - d->tick_log[i - 1], MS);
	e = world_event(EVENT_CYCLE_SKIPPED);
	assert_non_null(e);
	assert_int_equal(e->a, 5000);
	assert_null(world_event(EVENT_CYCLE_SKIPPED));
	/* the histogram shows how late it was, all the same */
	assert_int_equal(world.loop.own->wakeup.max_ns, 5 * SECOND);
	assert_int_equal(world.shm[0].diag.cycles_skipped, 5000);
}

static void ticks_stay_on_their_grid_after_a_stall(void **state)
{
	const struct device *d = &world.device[0];

	(void)state;
	stall(1234567890, 3 * SECOND);
	for (uint64_t i = 1; i < d->cycles; i++)
		assert_int_equal((d->tick_log[i] - d->tick_log[0]) % MS, 0);
}

static void less_than_half_a_period_late_still_runs(void **state)
{
	const struct device *d = &world.device[0];

	(void)state;
	stall(490 * US, 50 * MS);
	assert_int_equal(world.loop.shared.skipped, 0);
	assert_null(world_event(EVENT_CYCLE_SKIPPED));
	for (uint64_t i = 1; i < d->cycles; i++)
		assert_int_equal(d->tick_log[i] - d->tick_log[i - 1], MS);
}

static void more_than_half_a_period_late_waits_for_the_next_tick(void **state)
{
	const struct device *d = &world.device[0];

	(void)state;
	stall(510 * US, 50 * MS);
	assert_int_equal(world.loop.shared.skipped, 1);
	assert_int_equal(d->tick_log[10] - d->tick_log[9], 2 * MS);
	/* it began at its tick, not late in between */
	assert_int_equal(world.shm[0].published_log[10], d->tick_log[10] + 100 * US);
}

static void stall_often(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] % 20 == 0)
		w->oversleep_ns = 3 * MS;
}

static void skips_are_told_every_ten_seconds_at_most(void **state)
{
	const struct event *e;
	uint64_t told = 0, last = 0, count = 0;

	(void)state;
	world.on_sent = stall_often;
	assert_int_equal(world_run(35 * SECOND), 0);
	while ((e = world_event(EVENT_CYCLE_SKIPPED))) {
		assert_true(!last || e->t_ns - last >= 10 * SECOND);
		last = e->t_ns;
		told += (uint64_t)e->a;
		count++;
	}
	assert_int_equal(count, 4);
	assert_true(told <= world.loop.shared.skipped);
	assert_true(told >= 3 * 3 * 10 * SECOND / (13 * MS) / 2);
}

static void sleeping_thread_never_polls(void **state)
{
	(void)state;
	assert_int_equal(world_run(SECOND), 0);
	assert_int_equal(world.spun_ns, 0);
	assert_true(world.slept_ns > SECOND * 8 / 10);
}

static void spin(double duty)
{
	world.loop.options.mode = LOOP_SPIN;
	world.loop.options.duty = duty;
}

static void spinning_thread_is_awake_for_its_tick(void **state)
{
	(void)state;
	spin(0.5);
	assert_int_equal(world_run(SECOND), 0);
	/* asleep until 60 us before the tick, then polling */
	assert_int_equal(world.sleeps, world.device[0].cycles);
	assert_int_equal(world.loop.own->wakeup.max_ns, 0);
	assert_in_range(world.spun_ns / world.device[0].cycles, 159 * US, 161 * US);
}

static void oversleep(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	w->oversleep_ns = 40 * US;
}

static void late_wake_up_is_hidden_by_the_lead(void **state)
{
	(void)state;
	spin(0.5);
	world.on_sent = oversleep;
	assert_int_equal(world_run(SECOND), 0);
	assert_int_equal(world.loop.own->wakeup.max_ns, 0);
}

static void spinning_never_exceeds_its_duty(void **state)
{
	const double duties[] = { 0.1, 0.3, 0.5, 0.9 };
	const uint64_t periods[] = { 250 * US, MS, 4 * MS };

	(void)state;
	for (size_t i = 0; i < 12; i++) {
		double duty = duties[i / 3];

		world_end();
		world_begin(1);
		spin(duty);
		world.loop.options.period_ns = periods[i % 3];
		world.round_trip_ns[0] = 0; /* always something in flight */
		world.device[0].deadline_ns = 70 * US;
		assert_int_equal(world_run(SECOND), 0);
		assert_true((double)world.spun_ns <= duty * (double)SECOND * 1.01);
		assert_true((double)world.spun_ns >= duty * (double)SECOND * 0.9);
	}
}

static void without_throttling_it_may_poll_all_the_time(void **state)
{
	(void)state;
	if (realtime_duty_limit() < 1.0) {
		/* and with it, loop_prepare lowers the duty */
		spin(1.0);
		assert_int_equal(world_run(10 * MS), 0);
		assert_true(world.loop.options.duty <= 0.9);
		assert_true(world.slept_ns > 0);
		world_end();
		world_begin(1);
	}
	spin(0.9);
	assert_int_equal(loop_prepare(&world.loop), 0);
	world.loop.options.duty = 1.0;
	pace_init(&world.loop);
	world.loop.own->clock.now = NULL;
	assert_int_equal(world.loop.own->lead_ns, MS);
	assert_int_equal(world.loop.own->spin_ns, MS);
}

static void duty_leaves_room_below_the_throttling(void **state)
{
	(void)state;
	assert_float_equal(realtime_duty_of(950000, 1000000), 0.9, 1e-9);
	/* the default of pokeysd.conf is not more than the default of the kernel leaves */
	assert_false(realtime_duty_of(950000, 1000000) < 0.9);
	assert_float_equal(realtime_duty_of(500000, 1000000), 0.45, 1e-9);
	assert_float_equal(realtime_duty_of(1000000, 1000000), 0.9, 1e-9);
	assert_float_equal(realtime_duty_of(10000, 1000000), 0.1, 1e-9);
	assert_float_equal(realtime_duty_of(-1, 1000000), 1.0, 1e-9);
	assert_float_equal(realtime_duty_of(950000, 0), 0.9, 1e-9);
}

#define ONE(f) cmocka_unit_test_setup_teardown(f, begin_one, end)

static void fall_asleep(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 20)
		w->asleep_ns = 60 * SECOND;
}

/* Told before the next cycle of the device begins, once. */
static void a_suspend_is_told_before_anything_is_sent(void **state)
{
	const struct event *e;

	(void)state;
	world.on_sent = fall_asleep;
	assert_int_equal(world_run(100 * MS), 0);
	assert_int_equal(world.device[0].suspended, 1);
	assert_int_equal(world.device[0].suspended_cycles, 10);
	assert_in_range(world.device[0].slept_ns, 60 * SECOND - MS, 60 * SECOND);
	e = world_event(EVENT_SUSPENDED);
	assert_non_null(e);
	assert_int_equal(e->a, 60000);
	assert_null(world_event(EVENT_SUSPENDED));
}

static void lose_and_fall_asleep(struct world *w, uint32_t channel, const uint8_t *data,
				 size_t length)
{
	fall_asleep(w, channel, data, length);
	if (w->device[0].resent)
		assert_int_equal(w->device[0].suspended, 1);
}

/* A request that was under way, and is due again before the next cycle. */
static void a_suspend_is_told_before_a_request_is_sent_again(void **state)
{
	(void)state;
	world.lose = 20;
	world.device[0].deadline_ns = 300 * US;
	world.on_sent = lose_and_fall_asleep;
	assert_int_equal(world_run(100 * MS), 0);
	assert_int_equal(world.device[0].suspended, 1);
	assert_true(world.device[0].resent > 0);
}

/* The clock that goes on is read long after the other one. */
static void a_thread_that_is_late_was_not_suspended(void **state)
{
	(void)state;
	world.clock_takes_ns = 3 * SECOND;
	assert_int_equal(world_run(60 * SECOND), 0);
	assert_int_equal(world.device[0].suspended, 0);
	assert_null(world_event(EVENT_SUSPENDED));
}

static void fall_asleep_for_a_moment(struct world *w, uint32_t channel, const uint8_t *data,
				     size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] % 20 == 0 && w->sent[0] <= 60)
		w->asleep_ns += 2 * MS;
}

static void each_suspend_is_told(void **state)
{
	(void)state;
	world.on_sent = fall_asleep_for_a_moment;
	assert_int_equal(world_run(100 * MS), 0);
	assert_int_equal(world.device[0].suspended, 3);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		ONE(stall_of_five_seconds_is_one_skip_and_no_burst),
		ONE(ticks_stay_on_their_grid_after_a_stall),
		ONE(less_than_half_a_period_late_still_runs),
		ONE(more_than_half_a_period_late_waits_for_the_next_tick),
		ONE(skips_are_told_every_ten_seconds_at_most),
		ONE(sleeping_thread_never_polls),
		ONE(spinning_thread_is_awake_for_its_tick),
		ONE(late_wake_up_is_hidden_by_the_lead),
		ONE(spinning_never_exceeds_its_duty),
		ONE(without_throttling_it_may_poll_all_the_time),
		ONE(a_suspend_is_told_before_anything_is_sent),
		ONE(a_suspend_is_told_before_a_request_is_sent_again),
		ONE(a_thread_that_is_late_was_not_suspended),
		ONE(each_suspend_is_told),
		cmocka_unit_test(duty_leaves_room_below_the_throttling),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
