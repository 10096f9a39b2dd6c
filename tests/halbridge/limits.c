/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every counter and time runs over its limit while LinuxCNC reads and writes: data stay
 * fresh, positions and speeds go on, and no press is lost or made twice.
 */
#include "tests/halbridge/rig.h"

enum { PERIODS = 4000, RATE = 20 }; /* RATE: encoder counts in a period */

static struct rig rig;
static struct values *const values = &rig.values;
static struct pokeys_command *const command = &rig.exchange.command;

static void start(uint64_t limit_ns)
{
	struct exchange *exchange = &rig.exchange;

	rig_init(&rig);
	rig.now_ns = limit_ns - PERIODS / 2 * RIG_MS;
	rig.daemon.fault_count = UINT32_MAX;
	rig.daemon.cycle = UINT64_MAX - PERIODS / 2;
	rig.daemon.encoder[4] = INT32_MAX - RATE * PERIODS / 2;
	rig.daemon.engine.axis[2].position_epoch = UINT8_MAX;
	rig.daemon.engine.buffer_underruns = UINT32_MAX;
	rig.daemon.engine.stops = UINT8_MAX;
	rig.daemon.engine.task_count = UINT32_MAX;
	exchange->command.heartbeat = UINT32_MAX - PERIODS / 2;
	exchange->reads = UINT32_MAX - PERIODS / 2;
	values->one_shot_failed_count = values->input_refused_count = UINT32_MAX;
	values->encoder[4].scale = 100;
	rig_period(&rig);
	/* a new session counts from 0 */
	rig.daemon.one_shot_ack = UINT32_MAX - 3;
	exchange->command.one_shot_head = UINT32_MAX - 3;
	exchange->queue.head = exchange->queue.ack = UINT32_MAX - 3;
	rig_period(&rig);
}

static void finish(uint32_t id)
{
	rig_end(&rig, id, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
}

/* Each is one one-shot, whatever its number. */
static void is_pressed_once(void)
{
	const uint32_t head = command->one_shot_head;

	values->counter.reset = true;
	rig_period(&rig);
	assert_int_equal(command->one_shot_head, (uint32_t)(head + 1));
	finish(head);
	rig_period(&rig);
	values->counter.reset = false;
	rig_period(&rig);
	assert_int_equal(command->one_shot_head, (uint32_t)(head + 1));
}

static void reads_and_writes_beyond(uint64_t limit_ns)
{
	double before;

	start(limit_ns);
	for (unsigned int i = 0; i < 8; i++)
		is_pressed_once();
	assert_int_equal(command->one_shot_head, 4);
	before = values->encoder[4].position;
	for (unsigned int i = 0; i < PERIODS; i++) {
		const uint64_t heartbeat = command->heartbeat;

		rig.daemon.encoder[4] = (int32_t)((uint32_t)rig.daemon.encoder[4] + RATE);
		rig_period(&rig);
		assert_true(values->connected && !values->stale && !values->read_missing);
		assert_true(values->daemon_alive && values->commander);
		assert_int_equal(command->heartbeat, heartbeat + 1);
		assert_true(fabs(values->encoder[4].position - before - RATE / 100.0) < 1e-6);
		before = values->encoder[4].position;
		if (i > 100)
			assert_true(fabs(values->encoder[4].velocity - 10 * RATE) < 1e-3);
	}
	assert_true(rig.daemon.encoder[4] < 0 && rig.now_ns > limit_ns);
	assert_true(values->encoder[4].position > RATE * PERIODS / 100.0 - 1);
	assert_int_equal(values->one_shot_failed_count, UINT32_MAX);
	assert_false(values->position_lost);
}

static void thirty_two_bits_of_milliseconds(void **state)
{
	(void)state;
	reads_and_writes_beyond((UINT64_C(1) << 32) * RIG_MS);
}

static void the_nanoseconds_that_a_double_holds(void **state)
{
	(void)state;
	reads_and_writes_beyond(UINT64_C(1) << 53);
}

/* The number of a count has eight bits, and what comes behind 255 is a new count as well. */
static void counts_of_a_position_are_told_apart(void **state)
{
	struct pokeys_axis *axis = &rig.daemon.engine.axis[2];

	(void)state;
	start(1000 * RIG_MS);
	values->joint[2].scale = 1;
	rig_period(&rig);
	axis->position_epoch = 0;
	axis->position = 500;
	rig_period(&rig);
	assert_true(values->position_lost);
	assert_true(values->joint[2].pos_fb == 0);
	axis->position_epoch = 1;
	rig_period(&rig);
	assert_false(values->position_lost);
	assert_true(values->joint[2].pos_fb == 500);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(thirty_two_bits_of_milliseconds),
		cmocka_unit_test(the_nanoseconds_that_a_double_holds),
		cmocka_unit_test(counts_of_a_position_are_told_apart),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
