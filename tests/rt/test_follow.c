/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The loop and its commanders in virtual time: whom the cycle follows, what it takes
 * for a stamp, and how old the data are when they are read.
 */
#include "tests/rt/doubles.h"
#include <string.h>

/* LinuxCNC, as far as a device's shared memory sees it. */
static struct thread {
	uint64_t next_ns, period_ns;
	uint64_t until_ns; /* it is silent from then on, 0 = never */
	uint64_t from_ns;
	int64_t lie_ns;        /* added to the stamps it tells */
	uint64_t reads, young; /* of the last second; no older than 40 us */
} thread[4];

static uint64_t end_ns;

static void reads(struct world *w, uint32_t i)
{
	struct shm_device *s = &w->shm[i];
	struct thread *t = &thread[i];

	for (; t->period_ns && t->next_ns <= w->now; t->next_ns += t->period_ns) {
		if (t->next_ns < t->from_ns || (t->until_ns && t->next_ns >= t->until_ns))
			continue;
		s->command_result = 1;
		s->command.heartbeat++;
		s->command.session = 7;
		s->command.t_thread_ns = t->next_ns + (uint64_t)t->lie_ns;
		s->command.t_ns = s->command.t_thread_ns;
		s->command.period_ns = t->period_ns;
		if (t->next_ns + SECOND < end_ns || !s->published)
			continue;
		t->reads++;
		t->young += t->next_ns - s->published_log[s->published - 1] <= 40 * US;
	}
}

static int begin(void **state)
{
	(void)state;
	world_begin(2);
	memset(thread, 0, sizeof thread);
	world.on_look = reads;
	for (int i = 0; i < 2; i++)
		thread[i] = (struct thread){ .next_ns = world.now + 333333, .period_ns = MS };
	return 0;
}

static int end(void **state)
{
	(void)state;
	world_end();
	return 0;
}

static void run(uint64_t for_ns)
{
	end_ns = world.now + for_ns;
	assert_int_equal(world_run(for_ns), 0);
	for (uint64_t i = 1; i < world.device[0].cycles; i++)
		assert_in_range(world.device[0].tick_log[i] - world.device[0].tick_log[i - 1],
				980 * US, 1020 * US);
}

static const struct pokeys_phase *shown(void)
{
	return &world.shm[0].cell[world.shm[0].newest].phase;
}

static bool on_its_own_grid(void)
{
	const struct device *d = &world.device[0];

	for (uint64_t i = 1; i < d->cycles; i++)
		if (d->tick_log[i] - d->tick_log[i - 1] != MS)
			return false;
	return d->cycles > 100;
}

static void data_are_published_just_before_each_read(void **state)
{
	const struct event *e;

	(void)state;
	world.publish_takes_ns = 3 * US;
	thread[1].next_ns += 5 * US; /* the same thread, the next funct in it */
	run(3 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_LOCKED);
	assert_int_equal(shown()->master, 0);
	assert_int_equal(shown()->losses, 0);
	/* 100 us for the answers, 6 for both images, 10 margin, a bucket of 4 */
	assert_in_range(shown()->lead_ns, 116 * US, 124 * US);
	assert_true(shown()->error_ns >= -2000 && shown()->error_ns <= 2000);
	assert_in_range(shown()->period_ns, MS - 100, MS + 100);
	assert_int_equal(memcmp(shown(), &world.shm[1].cell[world.shm[1].newest].phase,
				sizeof *shown()),
			 0);
	for (int i = 0; i < 2; i++) {
		assert_in_range(thread[i].reads, 998, 1002);
		assert_int_equal(thread[i].young, thread[i].reads);
	}
	e = world_event(EVENT_PHASE);
	assert_non_null(e);
	assert_int_equal(e->a, POKEYS_PHASE_LOCKED);
	assert_int_equal(e->b, MS);
	assert_null(world_event(EVENT_PHASE));
}

static void without_a_lock_reads_find_what_there_happens_to_be(void **state)
{
	(void)state;
	world.loop.options.phase_lock = LOOP_PHASE_NO;
	run(3 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_OFF);
	assert_int_equal(shown()->master, 255);
	assert_true(on_its_own_grid());
	assert_int_equal(thread[0].young, 0);
	assert_null(world_event(EVENT_PHASE));
}

static void nobody_to_follow_is_no_reason_to_move(void **state)
{
	(void)state;
	thread[0].period_ns = thread[1].period_ns = 0;
	run(2 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_FREE);
	assert_true(on_its_own_grid());
	assert_null(world_event(EVENT_PHASE));
}

/* A commander that is no HAL component, one whose clock is another, one that died long ago. */
static void stamps_that_make_no_sense_are_not_believed(void **state)
{
	static const int64_t lies[] = { -(int64_t)(2000 * SECOND), (int64_t)SECOND,
					-(int64_t)(200 * MS) };

	(void)state;
	for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++) {
		thread[0].lie_ns = thread[1].lie_ns = lies[i];
		run(SECOND);
		assert_int_equal(shown()->state, POKEYS_PHASE_FREE);
		assert_true(on_its_own_grid());
		end(NULL);
		begin(NULL);
	}
	thread[0].period_ns = 0;
	world.shm[1].command = (struct pokeys_command){ .t_thread_ns = world.now - MS,
							.period_ns = MS };
	thread[1].period_ns = 0;
	world.shm[1].command_result = 1; /* its image stays as it is */
	run(SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_FREE);
	assert_true(on_its_own_grid());
}

static void commander_that_ends_leaves_the_cycle_to_itself(void **state)
{
	const struct device *d = &world.device[0];

	(void)state;
	thread[0].period_ns = thread[1].period_ns = 1002 * US;
	thread[0].until_ns = thread[1].until_ns = world.now + 2 * SECOND;
	run(3 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_FREE);
	assert_int_equal(shown()->losses, 1);
	assert_in_range(d->tick_log[1900] - d->tick_log[1899], 1001900, 1002100);
	for (uint64_t i = 2200; i < d->cycles; i++)
		assert_int_equal(d->tick_log[i] - d->tick_log[i - 1], MS);
}

static void next_commander_takes_over_when_the_master_is_silent(void **state)
{
	(void)state;
	thread[0].until_ns = world.now + SECOND;
	thread[1].next_ns += 400 * US;
	run(3 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_LOCKED);
	assert_int_equal(shown()->master, 1);
	assert_int_equal(shown()->losses, 1);
	assert_int_equal(thread[1].young, thread[1].reads);
	assert_true(thread[1].reads > 990);
}

static void master_stays_master_when_an_earlier_one_comes(void **state)
{
	(void)state;
	thread[0].from_ns = world.now + SECOND;
	thread[1].next_ns += 400 * US;
	run(3 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_LOCKED);
	assert_int_equal(shown()->master, 1);
	assert_int_equal(shown()->losses, 0);
	assert_int_equal(thread[1].young, thread[1].reads);
}

static void period_that_does_not_fit_is_told(void **state)
{
	const struct event *e;

	(void)state;
	world.loop.options.phase_lock = LOOP_PHASE_YES;
	thread[0].period_ns = thread[1].period_ns = 1500 * US;
	run(2 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_UNFIT);
	assert_int_equal(shown()->master, 255);
	assert_true(on_its_own_grid());
	e = world_event(EVENT_PHASE);
	assert_non_null(e);
	assert_int_equal(e->a, POKEYS_PHASE_UNFIT);
	assert_int_equal(e->level, EVENT_WARNING);
	assert_int_equal(e->b, 1500 * US);
}

static void commander_that_fits_is_preferred(void **state)
{
	(void)state;
	thread[0].period_ns = 1500 * US;
	run(3 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_LOCKED);
	assert_int_equal(shown()->master, 1);
	assert_int_equal(thread[1].young, thread[1].reads);
}

static void slow_servo_thread_gets_fresh_data_too(void **state)
{
	(void)state;
	thread[0].period_ns = thread[1].period_ns = 2 * MS;
	run(3 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_LOCKED);
	assert_in_range(thread[0].reads, 498, 502);
	assert_int_equal(thread[0].young, thread[0].reads);
}

/* Device 1 is not reached in every tenth cycle. */
static void drop_some(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)data;
	(void)length;
	if (channel == 1)
		w->round_trip_ns[1] = w->device[1].cycles % 10 == 9 ? 0 : 100 * US;
}

static void device_that_is_away_does_not_hold_the_lead(void **state)
{
	(void)state;
	world.round_trip_ns[1] = 0;
	world.device[1].link = POKEYS_LINK_LOST;
	run(3 * SECOND);
	assert_in_range(shown()->lead_ns, 110 * US, 118 * US);
	assert_int_equal(thread[0].young, thread[0].reads);
}

/* Its cycles end with the window, which says nothing about what a cycle costs. */
static void answers_that_are_missing_do_not_make_the_lead_longer(void **state)
{
	(void)state;
	world.on_sent = drop_some;
	world.device[1].deadline_ns = 800 * US; /* asked again after the window */
	run(3 * SECOND);
	assert_true(world.device[1].resent > 200);
	assert_in_range(shown()->lead_ns, 110 * US, 118 * US);
}

static void device_that_nobody_commands_does_not_hold_the_lead(void **state)
{
	(void)state;
	world.round_trip_ns[1] = 450 * US;
	world.device[1].deadline_ns = 5 * MS;
	thread[1].period_ns = 0;
	run(3 * SECOND);
	assert_in_range(shown()->lead_ns, 110 * US, 118 * US);
	assert_int_equal(thread[0].young, thread[0].reads);
}

static void polling_thread_is_awake_for_a_tick_that_moves(void **state)
{
	(void)state;
	world.loop.options.mode = LOOP_SPIN;
	world.loop.options.duty = 0.5;
	thread[0].period_ns = thread[1].period_ns = 1004 * US;
	run(3 * SECOND);
	assert_int_equal(shown()->state, POKEYS_PHASE_LOCKED);
	assert_int_equal(world.loop.own->wakeup.max_ns, 0);
	assert_int_equal(thread[0].young, thread[0].reads);
}

static void stall_once(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 1000)
		w->oversleep_ns = 20 * MS;
}

static void stall_of_the_daemon_does_not_lose_the_lock(void **state)
{
	(void)state;
	world.on_sent = stall_once;
	end_ns = world.now + 3 * SECOND;
	assert_int_equal(world_run(3 * SECOND), 0);
	assert_in_range(world.loop.shared.skipped, 19, 21);
	assert_int_equal(shown()->state, POKEYS_PHASE_LOCKED);
	assert_int_equal(shown()->losses, 0);
	assert_int_equal(thread[0].young, thread[0].reads);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, begin, end)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(data_are_published_just_before_each_read),
		TEST(without_a_lock_reads_find_what_there_happens_to_be),
		TEST(nobody_to_follow_is_no_reason_to_move),
		TEST(stamps_that_make_no_sense_are_not_believed),
		TEST(commander_that_ends_leaves_the_cycle_to_itself),
		TEST(next_commander_takes_over_when_the_master_is_silent),
		TEST(master_stays_master_when_an_earlier_one_comes),
		TEST(period_that_does_not_fit_is_told),
		TEST(commander_that_fits_is_preferred),
		TEST(slow_servo_thread_gets_fresh_data_too),
		TEST(device_that_is_away_does_not_hold_the_lead),
		TEST(answers_that_are_missing_do_not_make_the_lead_longer),
		TEST(device_that_nobody_commands_does_not_hold_the_lead),
		TEST(polling_thread_is_awake_for_a_tick_that_moves),
		TEST(stall_of_the_daemon_does_not_lose_the_lock),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
