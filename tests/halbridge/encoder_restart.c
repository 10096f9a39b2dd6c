// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Counts across a restart of the device, of the daemon, or of both: what LinuxCNC jogs by moves
 * by the wheel only.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig_period(&rig);
	return 0;
}

static void restart_the_device(int32_t count)
{
	for (int i = 0; i < POKEYS_ENCODERS; i++)
		rig.daemon.encoder[i] = count;
	rig.daemon.encoder_epoch++;
}

/* LinuxCNC jogs by it. */
static void a_restart_of_the_device_turns_no_hand_wheel(void **state)
{
	(void)state;
	rig.daemon.encoder_enabled = UINT32_C(1) << 1;
	rig.values.encoder[1].scale = 100;
	rig.daemon.encoder[1] = 70000;
	rig_period(&rig);
	assert_false(rig.values.encoder[1].count_lost || rig.values.encoder_count_lost);
	for (int i = 1; i <= 3; i++) {
		const int32_t before = rig.values.encoder[1].count;

		rig.device_silent = true;
		rig_periods(&rig, 20);
		assert_int_equal(rig.values.encoder[1].count, before);
		rig.device_silent = false;
		restart_the_device(2);
		rig_period(&rig);
		assert_int_equal(rig.values.encoder[1].count, before);
		assert_true(rig.values.encoder[1].velocity == 0);
		assert_true(rig.values.encoder[1].count_lost && rig.values.encoder_count_lost);
		rig.daemon.encoder[1] = 12;
		rig_period(&rig);
		assert_int_equal(rig.values.encoder[1].count, before + 10);
		assert_true(rig.values.encoder[1].position == (before + 10) / 100.0);
	}
	rig.values.encoder[1].reset = true;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 0);
	assert_false(rig.values.encoder[1].count_lost || rig.values.encoder_count_lost);
}

static void the_count_of_a_restarted_device_can_be_taken(void **state)
{
	(void)state;
	rig.values.encoder_keep_count = false;
	rig.daemon.encoder[1] = 70000;
	rig_period(&rig);
	rig.values.encoder[1].reset = true;
	rig_period(&rig);
	rig.values.encoder[1].reset = false;
	restart_the_device(2);
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 2);
	assert_true(rig.values.encoder[1].count_lost);
	rig.daemon.encoder[1] = 12;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 12);
}

/* For half a second, by so many counts in each period. */
static void turn(int32_t counts)
{
	for (int i = 0; i < 500; i++) {
		rig.daemon.encoder[1] += counts;
		rig_period(&rig);
	}
}

static void be_silent(uint64_t ms)
{
	rig.device_silent = true;
	for (uint64_t i = 0; i < ms; i++)
		rig_period(&rig);
	rig.device_silent = false;
}

/* Its cable is out, and somebody turns the wheel all the same. */
static void what_is_turned_in_a_silence_turns_no_hand_wheel(void **state)
{
	(void)state;
	rig.daemon.encoder_enabled = UINT32_C(1) << 1;
	rig.daemon.encoder[1] = 1000;
	rig_periods(&rig, 2);
	be_silent(4000);
	rig_periods(&rig, 20);
	assert_int_equal(rig.values.encoder[1].count, 1000);
	assert_false(rig.values.encoder[1].count_lost); /* nobody has turned it */
	rig.daemon.encoder[1] = 1001;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 1001);
	be_silent(600);
	rig.daemon.encoder[1] = 1501;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 1001);
	assert_true(rig.values.encoder[1].velocity == 0);
	assert_true(rig.values.encoder[1].count_lost && rig.values.encoder_count_lost);
	rig.daemon.encoder[1] = 1511;
	rig_periods(&rig, 2);
	assert_int_equal(rig.values.encoder[1].count, 1011);
	rig.values.encoder[1].reset = true;
	rig_period(&rig);
	assert_false(rig.values.encoder[1].count_lost);
}

/* A spindle that was stopped meanwhile must not look as if it still turned. */
static void no_speed_of_before_a_silence_is_shown(void **state)
{
	(void)state;
	turn(80);
	assert_true(rig.values.encoder[1].velocity > 70000);
	be_silent(10000);
	rig.daemon.encoder[1] += 3;
	rig_period(&rig);
	assert_true(rig.values.encoder[1].velocity == 0);
	rig.daemon.encoder[1]++; /* it rests on the edge of a line */
	rig_period(&rig);
	assert_true(rig.values.encoder[1].velocity < 2000);
}

/* Data count as fresh for two seconds here, and nothing of it is stale. */
static void a_silence_that_nobody_calls_stale_turns_none_either(void **state)
{
	(void)state;
	rig.daemon.stale_after_ns = 2000 * RIG_MS;
	rig.daemon.encoder[1] = 1000;
	rig_periods(&rig, 2);
	be_silent(1500);
	assert_false(rig.values.stale);
	rig.daemon.encoder[1] = 1500;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 1000);
	assert_true(rig.values.encoder[1].count_lost);
	/* once is enough: no sample that comes late is taken for another silence */
	rig.daemon.encoder[1] = 1501;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 1001);
}

/* The speed from before a silence must not be used to guess the count after it. */
static void a_silence_while_it_is_set_turns_none_either(void **state)
{
	(void)state;
	rig.daemon.device_tick_ms = 5000000;
	rig_period(&rig);
	turn(10);
	assert_true(rig.values.encoder[1].velocity > 0);
	rig.values.encoder[1].set_value = 7;
	rig.values.encoder[1].set = true;
	rig_periods(&rig, 2);
	rig.values.encoder[1].set = false;
	be_silent(30000);
	rig.daemon.epoch++;
	rig.daemon.device_tick_ms += 30000 + 503;
	rig_periods(&rig, 3);
	assert_in_range(rig.values.encoder[1].count, 5000, 5000 + 200);
	assert_true(rig.values.encoder[1].count_lost);
}

/* A lost packet or two are no silence, and who closes a loop over the count needs all of it. */
static void a_short_silence_loses_no_count(void **state)
{
	(void)state;
	rig.daemon.encoder[1] = 1000;
	rig_periods(&rig, 2);
	be_silent(400);
	rig.daemon.encoder[1] = 1500;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 1500);
	rig.values.encoder_keep_count = false;
	be_silent(4000);
	rig.daemon.encoder[1] = 2500;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 2500);
	assert_false(rig.values.encoder[1].count_lost);
}

/* The encoders of a slow group may be sampled later than what makes the data fresh. */
static void a_sample_of_before_the_silence_is_counted(void **state)
{
	uint64_t old_ns;

	(void)state;
	rig.daemon.encoder[1] = 1000;
	rig_periods(&rig, 2);
	old_ns = rig.daemon.encoder_t_ns[1];
	be_silent(600);
	rig.now_ns += RIG_MS;
	rig_daemon(&rig);
	rig.daemon.encoder[1] = 1003;
	rig.daemon.encoder_t_ns[1] = old_ns + RIG_MS;
	rig_read(&rig);
	assert_int_equal(rig.values.encoder[1].count, 1003);
	rig.daemon.encoder[1] = 1500;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 1003);
	rig.daemon.encoder[1] = 1501;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[1].count, 1004);
}

/* The sample in the first images of a restarted device may still be the old one. */
static void an_old_sample_is_not_taken_for_the_new_count(void **state)
{
	uint64_t old_ns;

	(void)state;
	for (int keep = 0; keep < 2; keep++) {
		setup(state);
		rig.values.encoder_keep_count = keep;
		rig.daemon.encoder[1] = 500;
		rig_period(&rig);
		old_ns = rig.daemon.encoder_t_ns[1];
		rig.daemon.encoder_epoch++;
		for (int i = 0; i < 3; i++) {
			rig.now_ns += RIG_MS;
			rig_daemon(&rig);
			rig.daemon.encoder_t_ns[1] = old_ns;
			rig_read(&rig);
			assert_int_equal(rig.values.encoder[1].count, 500);
		}
		rig.daemon.encoder[1] = 7;
		rig_period(&rig);
		assert_int_equal(rig.values.encoder[1].count, keep ? 500 : 7);
		rig.daemon.encoder[1] = 8;
		rig_period(&rig);
		assert_int_equal(rig.values.encoder[1].count, keep ? 501 : 8);
	}
}

/* It knows nothing of the time before, but the device's clock does. */
static void another_daemon_is_no_restart_of_the_device(void **state)
{
	for (int keep = 0; keep < 2; keep++) {
		const uint64_t without_ms = keep ? 300 : 3000;

		setup(state);
		rig.values.encoder_keep_count = keep;
		rig.daemon.device_tick_ms = 5000000;
		rig.daemon.encoder[1] = 1000;
		rig_period(&rig);
		rig.daemon.epoch++;
		rig.daemon.encoder_epoch = 17;
		rig.now_ns += without_ms * RIG_MS;
		rig.daemon.device_tick_ms += (uint32_t)without_ms + 100;
		rig.daemon.encoder[1] = 1500;
		rig_period(&rig);
		assert_int_equal(rig.values.encoder[1].count, 1500);
		assert_false(rig.values.encoder[1].count_lost);
	}
	/* ... and here it was restarted while there was no daemon, or does not tell its clock */
	for (uint32_t tick = 0; tick < 2; tick++) {
		rig.daemon.epoch++;
		rig.now_ns += 3000 * RIG_MS;
		rig.daemon.device_tick_ms = 2000 * tick;
		rig.daemon.encoder[1] = 3;
		rig_period(&rig);
		assert_int_equal(rig.values.encoder[1].count, 1500);
		assert_true(rig.values.encoder[1].count_lost);
	}
}

static void another_daemon_comes(uint32_t tick_ms)
{
	rig.daemon.epoch++;
	rig.daemon.device_tick_ms = tick_ms;
	rig_period(&rig);
}

/* With slow-hz = 0.1 the old daemon's last reading is 10 s old, and the new one's is not. */
static void a_clock_that_is_read_now_and_then_is_known_again(void **state)
{
	(void)state;
	for (uint32_t late_ms = 0; late_ms < 10000; late_ms += 3000) {
		setup(state);
		rig.daemon.device_tick_ms = 5000000; /* attached `late_ms` behind this reading */
		rig.now_ns += late_ms * RIG_MS;
		rig_period(&rig);
		rig.now_ns += 9000 * RIG_MS;
		rig_period(&rig);
		another_daemon_comes(5000000 + late_ms + 9000);
		assert_false(rig.values.encoder[1].count_lost);
		/* switched off for a moment: it began later than before */
		rig.now_ns += 9000 * RIG_MS;
		another_daemon_comes(700);
		assert_true(rig.values.encoder[1].count_lost);
	}
}

/* Half a year later, by clocks of which one is 200 parts in a million faster. */
static void clocks_that_differ_are_no_restart(void **state)
{
	const uint64_t later_ms = UINT64_C(15778800000);

	(void)state;
	rig.daemon.device_tick_ms = 5000000;
	rig_period(&rig);
	rig.now_ns += later_ms * RIG_MS;
	another_daemon_comes((uint32_t)(5000000 + later_ms + later_ms / 5000));
	assert_false(rig.values.encoder[1].count_lost);
	rig.daemon.device_tick_ms += 10000;
	rig.now_ns += 10000 * RIG_MS;
	rig_period(&rig);
	rig.now_ns += 60000 * RIG_MS;
	another_daemon_comes(50000);
	assert_true(rig.values.encoder[1].count_lost);
}

static void a_lost_count_is_known_again_by_its_index(void **state)
{
	(void)state;
	rig.daemon.encoder[25] = 1000;
	rig_period(&rig);
	restart_the_device(2);
	rig_period(&rig);
	assert_true(rig.values.encoder[25].count_lost);
	rig.values.encoder[25].index_enable = true;
	rig_period(&rig);
	rig.daemon.one_shot_ack = rig.exchange.command.one_shot_head;
	rig.daemon.one_shot[0] = (struct pokeys_one_shot_result){
		.id = rig.exchange.command.one_shot_head - 1,
		.outcome = POKEYS_OUTCOME_DONE,
	};
	rig_period(&rig);
	rig.daemon.encoder_index = UINT32_C(1) << 25;
	rig.daemon.encoder[25] = 4;
	rig_period(&rig);
	assert_false(rig.values.encoder[25].index_enable);
	assert_int_equal(rig.values.encoder[25].count, 4);
	assert_false(rig.values.encoder[25].count_lost);
}

static void a_restarted_daemon_does_not_move_the_position(void **state)
{
	(void)state;
	rig.daemon.device_tick_ms = 60000;
	rig.daemon.encoder[1] = 70000;
	rig_period(&rig);
	rig.values.encoder[1].reset = true;
	rig_period(&rig);
	rig.values.encoder[1].reset = false;
	rig.daemon.epoch++;
	rig.daemon.encoder[1] = 70005;
	rig_periods(&rig, 2);
	assert_int_equal(rig.values.encoder[1].count, 5);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(a_restart_of_the_device_turns_no_hand_wheel, setup),
		cmocka_unit_test_setup(the_count_of_a_restarted_device_can_be_taken, setup),
		cmocka_unit_test_setup(what_is_turned_in_a_silence_turns_no_hand_wheel, setup),
		cmocka_unit_test_setup(no_speed_of_before_a_silence_is_shown, setup),
		cmocka_unit_test_setup(a_silence_that_nobody_calls_stale_turns_none_either, setup),
		cmocka_unit_test_setup(a_silence_while_it_is_set_turns_none_either, setup),
		cmocka_unit_test_setup(a_short_silence_loses_no_count, setup),
		cmocka_unit_test_setup(a_sample_of_before_the_silence_is_counted, setup),
		cmocka_unit_test_setup(an_old_sample_is_not_taken_for_the_new_count, setup),
		cmocka_unit_test_setup(another_daemon_is_no_restart_of_the_device, setup),
		cmocka_unit_test_setup(a_clock_that_is_read_now_and_then_is_known_again, setup),
		cmocka_unit_test_setup(clocks_that_differ_are_no_restart, setup),
		cmocka_unit_test_setup(a_lost_count_is_known_again_by_its_index, setup),
		cmocka_unit_test_setup(a_restarted_daemon_does_not_move_the_position, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
