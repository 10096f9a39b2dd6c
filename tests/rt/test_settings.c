/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What passes through the loop besides state and command: wishes and reports
 * of settings, and orders of the control thread.
 */
#include "tests/rt/doubles.h"
#include <errno.h>
#include <string.h>

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

static void wish(uint32_t session, uint32_t generation)
{
	world.shm[0].wish = (struct pokeys_wish){ .session = session, .generation = generation };
	world.shm[0].wish_result = 1;
}

static void new_wish_reaches_its_device_once(void **state)
{
	(void)state;
	wish(7, 3);
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(world.device[0].wishes, 1);
	assert_int_equal(world.device[0].wish_generation, 3);
	assert_int_equal(world.device[1].wishes, 0);
}

static uint32_t step;

/* Every packet of channel 0: another wish. */
static void wish_again(struct world *w, uint32_t channel, const uint8_t *data, size_t length)
{
	static const uint32_t wishes[][2] = { { 7, 3 }, { 7, 3 }, { 7, 4 }, { 8, 4 }, { 8, 4 } };

	(void)w;
	(void)data;
	(void)length;
	if (channel || step >= 5 || world.shm[0].wish_result)
		return;
	wish(wishes[step][0], wishes[step][1]);
	step++;
}

static void wish_with_the_same_session_and_generation_is_not_taken_again(void **state)
{
	(void)state;
	step = 0;
	world.on_sent = wish_again;
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(step, 5);
	assert_int_equal(world.device[0].wishes, 3);
}

static void foreign_wish_is_told_and_not_taken(void **state)
{
	const struct event *event;

	(void)state;
	world.shm[1].wish_result = -EPROTO;
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(world.device[1].wishes, 0);
	event = world_event(EVENT_FOREIGN_WISH);
	assert_non_null(event);
	assert_int_equal(event->device, 1);
	assert_null(world_event(EVENT_FOREIGN_WISH));
}

static void wish_without_session_or_generation_is_refused(void **state)
{
	(void)state;
	wish(0, 1);
	assert_int_equal(world_run(10 * MS), 0);
	assert_int_equal(world.device[0].wishes, 0);
	assert_non_null(world_event(EVENT_FOREIGN_WISH));
}

static void report_is_written_when_it_has_changed_and_before_the_state(void **state)
{
	const struct shm_device *shm = &world.shm[0];

	(void)state;
	world.device[0].report_count = 1;
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(shm->reports, 1);
	assert_int_equal(shm->report.count, 1);
	assert_int_equal(shm->report_before_state, 0);
	assert_true(shm->report.t_publish_ns > 0);
	assert_int_equal(shm->cell[shm->newest].report_count, 1);
	assert_int_equal(world.shm[1].reports, 0);
}

static void orders_are_executed_in_turn_one_a_cycle(void **state)
{
	struct loop_order order = { .device = 1, .what = DEVICE_ORDER_SAVE };
	struct loop_order result;

	(void)state;
	for (order.id = 1; order.id <= 3; order.id++)
		assert_int_equal(loop_order_give(&world.loop, &order), 0);
	assert_false(loop_order_result(&world.loop, &result));
	world.device[1].order_result = -EBUSY;
	assert_int_equal(world_run(20 * MS), 0);
	assert_int_equal(world.device[1].orders, 3);
	assert_int_equal(world.device[1].last_order, DEVICE_ORDER_SAVE);
	assert_int_equal(world.device[1].order_cycle[2], world.device[1].order_cycle[0] + 2);
	for (uint32_t id = 1; id <= 3; id++) {
		assert_true(loop_order_result(&world.loop, &result));
		assert_int_equal(result.id, id);
		assert_int_equal(result.result, -EBUSY);
	}
	assert_false(loop_order_result(&world.loop, &result));
	assert_int_equal(world.device[0].orders, 0);
}

static void order_may_bring_what_the_file_wants_now(void **state)
{
	const struct loop_order order = {
		.device = 0,
		.what = DEVICE_ORDER_APPLY,
		.replace = true,
		.settings = { .axes = 5 },
	};

	(void)state;
	assert_int_equal(loop_order_give(&world.loop, &order), 0);
	assert_int_equal(world_run(10 * MS), 0);
	assert_int_equal(world.device[0].wanted_axes, 5);
	assert_int_equal(world.device[0].last_order, DEVICE_ORDER_APPLY);
}

static void full_ring_and_unknown_device_are_refused(void **state)
{
	struct loop_order order = { .device = 2 };

	(void)state;
	assert_int_equal(loop_order_give(&world.loop, &order), -ENODEV);
	order.device = 0;
	for (int i = 0; i < LOOP_ORDERS; i++)
		assert_int_equal(loop_order_give(&world.loop, &order), 0);
	assert_int_equal(loop_order_give(&world.loop, &order), -EAGAIN);
	assert_int_equal(world_run(100 * MS), 0);
	/* executed, but nobody has taken the results: the slots are not free */
	assert_int_equal(loop_order_give(&world.loop, &order), -EAGAIN);
	assert_true(loop_order_result(&world.loop, &order));
	assert_int_equal(loop_order_give(&world.loop, &order), 0);
}

int main(void)
{
#define TWO(name) cmocka_unit_test_setup_teardown(name, begin_two, end)
	const struct CMUnitTest tests[] = {
		TWO(new_wish_reaches_its_device_once),
		TWO(wish_with_the_same_session_and_generation_is_not_taken_again),
		TWO(foreign_wish_is_told_and_not_taken),
		TWO(wish_without_session_or_generation_is_refused),
		TWO(report_is_written_when_it_has_changed_and_before_the_state),
		TWO(orders_are_executed_in_turn_one_a_cycle),
		TWO(order_may_bring_what_the_file_wants_now),
		TWO(full_ring_and_unknown_device_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
