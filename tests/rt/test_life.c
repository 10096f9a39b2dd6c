/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * From the first cycle to the last: what passes between the loop and the
 * control thread, commands and addresses in, news out, and an orderly end.
 */
#include "tests/rt/doubles.h"
#include <errno.h>
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

static int end(void **state)
{
	(void)state;
	world_end();
	return 0;
}

static const struct pokeys_state *image(uint32_t i)
{
	return &world.shm[i].cell[world.shm[i].newest];
}

static void options_out_of_range_are_refused(void **state)
{
	const struct loop_options good = { MS, LOOP_SPIN, 0.5, 0.9, LOOP_PHASE_AUTO };
	struct loop_options bad[6];

	(void)state;
	for (int i = 0; i < 6; i++)
		bad[i] = good;
	bad[0].period_ns = 249999;
	bad[1].period_ns = 4000001;
	bad[2].collect = 0.05;
	bad[3].collect = 0.95;
	bad[4].duty = 0.05;
	bad[5].duty = 1.5;
	for (int i = 0; i < 6; i++) {
		world.loop.options = bad[i];
		assert_int_equal(loop_prepare(&world.loop), -EINVAL);
		assert_null(world.loop.own);
	}
	world.loop.options = good;
	world.loop.count = 0;
	assert_int_equal(loop_prepare(&world.loop), -EINVAL);
	world.loop.count = TRANSPORT_CHANNELS + 1;
	assert_int_equal(loop_prepare(&world.loop), -EINVAL);
}

static void stop_ends_when_all_devices_are_safe(void **state)
{
	uint64_t cycles;

	(void)state;
	world.device[0].stop_takes_ns = 20 * MS;
	world.device[1].stop_takes_ns = 50 * MS;
	assert_int_equal(world_run(100 * MS), 0);
	assert_true(world.device[0].stopping && world.device[1].stopping);
	assert_true(world.loop.shared.ended);
	assert_in_range(world.now - world.device[1].stop_ns, 50 * MS, 52 * MS);
	/* it cycled until then: the safe state needs packets */
	cycles = world.device[1].cycles;
	assert_in_range(cycles, 148, 154);
}

static void stop_does_not_wait_for_ever(void **state)
{
	(void)state;
	world.device[0].stop_takes_ns = 1000 * SECOND;
	assert_int_equal(world_run(100 * MS), 0);
	assert_in_range(world.now - world.device[0].stop_ns, 800 * MS, 802 * MS);
	assert_true(world.loop.shared.ended);
}

/* Each has its say when there is no cycle any more: whether it is in its safe state. */
static void devices_are_told_of_the_end_once_after_their_last_cycle(void **state)
{
	(void)state;
	world.device[0].stop_takes_ns = 1000 * SECOND;
	assert_int_equal(world_run(10 * MS), 0);
	for (uint32_t i = 0; i < 2; i++) {
		assert_int_equal(world.device[i].ends, 1);
		assert_int_equal(world.device[i].ended_cycles, world.device[i].cycles);
	}
}

static void last_image_says_that_the_daemon_is_ending(void **state)
{
	(void)state;
	world.device[0].stop_takes_ns = 5 * MS;
	world.loop.shared.flags = POKEYS_STATE_REALTIME | POKEYS_STATE_STALE;
	assert_int_equal(world_run(10 * MS), 0);
	for (uint32_t i = 0; i < 2; i++) {
		assert_int_equal(image(i)->t_publish_ns, world.now);
		/* and control may set only the flags that are its own */
		assert_int_equal(image(i)->flags, POKEYS_STATE_REALTIME | POKEYS_STATE_STOPPING);
	}
}

static void images_carry_the_flags_of_control(void **state)
{
	(void)state;
	world.loop.shared.flags = POKEYS_STATE_FALLBACK | POKEYS_STATE_GUARD;
	assert_int_equal(world_run(2 * MS), 0);
	assert_int_equal(world.shm[0].cell[0].flags & POKEYS_STATE_FALLBACK, POKEYS_STATE_FALLBACK);
	assert_int_equal(world.shm[0].cell[1].flags & POKEYS_STATE_GUARD, POKEYS_STATE_GUARD);
}

static void newest_command_reaches_the_device(void **state)
{
	(void)state;
	world.shm[0].command_result = 1;
	world.shm[0].command.heartbeat = 4711;
	assert_int_equal(world_run(10 * MS), 0);
	assert_int_equal(world.device[0].commands, world.device[0].cycles);
	assert_int_equal(world.device[0].heartbeat, 4711);
	assert_int_equal(world.device[0].refused, 0);
	assert_int_equal(world.device[1].commands, 0);
}

static void foreign_command_is_refused_as_a_whole(void **state)
{
	(void)state;
	world.shm[0].command_result = -EPROTO;
	assert_int_equal(world_run(10 * MS), 0);
	assert_int_equal(world.device[0].commands, 0);
	assert_int_equal(world.device[0].refused, -EPROTO);
	assert_int_equal(world.device[1].refused, 0);
}

static void address_is_aimed_at_before_the_device_hears_of_it(void **state)
{
	(void)state;
	assert_int_equal(world_run(10 * MS), 0);
	assert_int_equal(world.aims, 2);
	assert_int_equal(world.aimed_at[1].address, 0x0a000002);
	assert_int_equal(world.aimed_at[1].port, 20055);
	assert_int_equal(world.device[1].address, 0x0a000002);
	assert_int_equal(world.device[1].port, 20055);
	assert_true(world.device[1].address_ns >= world.aim_log[1]);
}

static void move_device(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 20)
		w->loop.shared.address[0] = UINT64_C(0x0a0000ff) << 16 | 30000;
}

static void device_that_moved_is_followed(void **state)
{
	(void)state;
	world.on_sent = move_device;
	assert_int_equal(world_run(50 * MS), 0);
	assert_int_equal(world.aims, 2);
	assert_int_equal(world.device[0].address, 0x0a0000ff);
	assert_int_equal(world.device[0].port, 30000);
	assert_int_equal(world.aimed_at[0].address, 0x0a0000ff);
}

static void failed_aim_is_repeated_ten_times_a_second_and_told_once(void **state)
{
	const struct event *e;

	(void)state;
	world.aim_result = -ENETUNREACH;
	assert_int_equal(world_run(SECOND), 0);
	assert_in_range(world.aims, 9, 11);
	for (uint64_t i = 1; i < world.aims; i++)
		assert_true(world.aim_log[i] - world.aim_log[i - 1] >= 100 * MS);
	e = world_event(EVENT_TRANSPORT);
	assert_non_null(e);
	assert_int_equal(e->a, -ENETUNREACH);
	assert_int_equal(e->device, 0);
	assert_null(world_event(EVENT_TRANSPORT));
	assert_int_equal(world.sent[0], 0);
}

static void break_route(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 20)
		w->t->error[0] = -ENETUNREACH;
}

static void lost_route_is_mended_by_aiming_anew(void **state)
{
	(void)state;
	world.on_sent = break_route;
	world.device[0].deadline_ns = 50 * MS;
	assert_int_equal(world_run(300 * MS), 0);
	assert_int_equal(world.aims, 2);
	assert_int_equal(world.t->error[0], 0);
	assert_true(world.sent[0] > 200);
}

static void device_that_somebody_else_drives_hears_of_it(void **state)
{
	(void)state;
	world.loop.shared.in_use = 2;
	assert_int_equal(world_run(10 * MS), 0);
	assert_false(world.device[0].in_use);
	assert_true(world.device[1].in_use);
}

static void wanted_addresses_are_told(void **state)
{
	(void)state;
	world.device[1].wants_address = true;
	assert_int_equal(world_run(10 * MS), 0);
	assert_int_equal(world.loop.shared.wanted, 2);
}

static uint64_t news_at_20;

static void change_link(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 10)
		w->loop.shared.notify = 0;
	if (w->sent[0] == 20)
		w->device[1].link = POKEYS_LINK_LOST;
	if (w->sent[0] == 30)
		news_at_20 = w->loop.shared.notify;
}

static void change_of_link_is_news(void **state)
{
	(void)state;
	news_at_20 = 0;
	world.on_sent = change_link;
	assert_int_equal(world_run(40 * MS), 0);
	assert_int_equal(news_at_20, 2);
	assert_int_equal(world.loop.shared.link[0], POKEYS_LINK_RUNNING);
	assert_int_equal(world.loop.shared.link[1], POKEYS_LINK_LOST);
}

static void diagnostic_image_comes_ten_times_a_second(void **state)
{
	(void)state;
	assert_int_equal(world_run(2 * SECOND), 0);
	for (uint32_t i = 0; i < 2; i++)
		assert_in_range(world.shm[i].diags, 20, 22);
	/* not both in one cycle */
	for (uint64_t a = 0; a < 20; a++)
		for (uint64_t b = 0; b < 20; b++)
			assert_int_not_equal(world.shm[0].diag_log[a], world.shm[1].diag_log[b]);
}

static void diagnostic_image_holds_what_the_loop_measured(void **state)
{
	const struct pokeys_diag *d = &world.shm[0].diag;

	(void)state;
	world.publish_takes_ns = 2 * US;
	world.loop.events.dropped = 3;
	world.loop.shared.minor_faults = 5;
	world.loop.shared.guard_passed = 7;
	world.loop.shared.guard_dropped = 8;
	assert_int_equal(world_run(SECOND), 0);
	assert_string_equal(d->transport, "memory");
	/* the device's part */
	assert_int_equal(d->round_trip.count, world.device[0].delivered);
	assert_int_equal(d->wakeup.count, d->cycle);
	assert_int_equal(d->publish.min_ns, 2 * US);
	assert_true(d->cycle_work.min_ns >= 100 * US && d->cycle_work.max_ns <= 110 * US);
	assert_true(d->transport_system_calls >= d->cycle * 2);
	assert_int_equal(d->events_dropped, 3);
	assert_int_equal(d->minor_faults, 5);
	assert_int_equal(d->guard_passed, 7);
	assert_int_equal(d->guard_dropped, 8);
	assert_int_equal(d->t_publish_ns, world.now);
}

static void fail_transport(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	(void)channel;
	(void)data;
	(void)length;
	if (w->sent[0] == 20)
		w->t->failed = -EBADF;
}

static void broken_transport_ends_the_loop_and_is_told(void **state)
{
	const struct event *e;

	(void)state;
	world.on_sent = fail_transport;
	assert_int_equal(world_run(10 * SECOND), -EBADF);
	assert_in_range(world.device[0].cycles, 10, 11);
	assert_true(world.loop.shared.ended);
	assert_int_equal(image(0)->flags & POKEYS_STATE_STOPPING, POKEYS_STATE_STOPPING);
	assert_int_equal(world.device[0].ends, 1);
	e = world_event(EVENT_TRANSPORT);
	assert_non_null(e);
	assert_int_equal(e->a, -EBADF);
	assert_int_equal(e->device, 255);
}

static void loop_may_be_prepared_and_released_again(void **state)
{
	(void)state;
	loop_release(&world.loop);
	assert_int_equal(loop_prepare(&world.loop), 0);
	/* its channel is attached already */
	loop_release(&world.loop);
	assert_int_equal(loop_prepare(&world.loop), -EBUSY);
	assert_null(world.loop.own);
}

#define ONE(f) cmocka_unit_test_setup_teardown(f, begin_one, end)
#define TWO(f) cmocka_unit_test_setup_teardown(f, begin_two, end)

int main(void)
{
	const struct CMUnitTest tests[] = {
		ONE(options_out_of_range_are_refused),
		TWO(stop_ends_when_all_devices_are_safe),
		ONE(stop_does_not_wait_for_ever),
		TWO(devices_are_told_of_the_end_once_after_their_last_cycle),
		TWO(last_image_says_that_the_daemon_is_ending),
		ONE(images_carry_the_flags_of_control),
		TWO(newest_command_reaches_the_device),
		TWO(foreign_command_is_refused_as_a_whole),
		TWO(address_is_aimed_at_before_the_device_hears_of_it),
		ONE(device_that_moved_is_followed),
		ONE(failed_aim_is_repeated_ten_times_a_second_and_told_once),
		ONE(lost_route_is_mended_by_aiming_anew),
		TWO(device_that_somebody_else_drives_hears_of_it),
		TWO(wanted_addresses_are_told),
		TWO(change_of_link_is_news),
		TWO(diagnostic_image_comes_ten_times_a_second),
		ONE(diagnostic_image_holds_what_the_loop_measured),
		ONE(broken_transport_ends_the_loop_and_is_told),
		ONE(loop_may_be_prepared_and_released_again),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
