/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Fresh or stale, by our own clock; packet errors; who is told what.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct values *const values = &rig.values;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig_periods(&rig, 2);
	return 0;
}

static void before_any_daemon_nothing_is_claimed(void **state)
{
	(void)state;
	rig_init(&rig);
	exchange_read(&rig.exchange, values, EXCHANGE_NOTHING, rig.now_ns);
	rig_write(&rig);
	assert_true(values->stale && !values->connected && !values->daemon_alive);
	assert_int_equal(values->attach_state, 0);
	assert_false(values->commander);
	for (unsigned int i = 0; i < POKEYS_PIN_BYTES; i++)
		assert_int_equal(rig.exchange.command.digital_out_mask[i], 0);
}

static void fresh_data_connect(void **state)
{
	(void)state;
	assert_true(values->connected && !values->stale && values->daemon_alive);
	assert_true(values->commander);
	assert_int_equal(values->attach_state, 1);
	assert_int_equal(values->link_state, POKEYS_LINK_RUNNING);
	assert_true(values->age_us == 200);
}

static void a_dead_daemon_is_locked_to_nobody(void **state)
{
	(void)state;
	assert_false(values->phase_locked);
	rig.daemon.phase.state = POKEYS_PHASE_LOCKED;
	rig.daemon.phase.error_ns = -2500;
	rig_period(&rig);
	assert_true(values->phase_locked && values->phase_error_us == -2.5);
	rig.daemon_dead = true;
	rig_periods(&rig, 10);
	assert_false(values->phase_locked);
}

static void a_dead_daemon_is_noticed_by_our_own_clock(void **state)
{
	unsigned int periods = 0;

	(void)state;
	rig.daemon_dead = true;
	while (!values->stale && periods < 100) {
		rig_period(&rig);
		periods++;
	}
	assert_in_range(periods, 4, 6);
	assert_false(values->connected);
	rig_periods(&rig, 10);
	assert_false(values->daemon_alive);
	assert_false(values->commander);
}

static void a_dead_daemon_is_noticed_however_patient_it_was(void **state)
{
	(void)state;
	rig.daemon.stale_after_ns = 60000 * RIG_MS;
	rig_period(&rig);
	rig.daemon_dead = true;
	rig_periods(&rig, 5);
	assert_true(values->connected);
	rig_period(&rig);
	assert_true(values->stale && !values->daemon_alive);
}

static void stale_pins_keep_their_last_values(void **state)
{
	(void)state;
	rig.daemon.digital_in[1] = 0x10;
	rig.daemon.encoder[0] = 99;
	rig.daemon.analog[6] = 4095;
	rig_period(&rig);
	rig.daemon_dead = true;
	rig_periods(&rig, 20);
	rig.daemon.digital_in[1] = 0;
	rig.daemon.encoder[0] = 5;
	rig.daemon.analog[6] = 0;
	rig_period(&rig);
	assert_true(values->stale);
	assert_true(values->pin.in[12] && !values->pin.in_not[12]);
	assert_int_equal(values->encoder[0].count, 99);
	assert_int_equal(values->analog[6].raw, 4095);
}

static void a_silent_device_is_stale_though_the_daemon_lives(void **state)
{
	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 7);
	assert_true(values->stale && values->daemon_alive);
	assert_true(values->age_us > 5000);
	rig.device_silent = false;
	rig_period(&rig);
	assert_true(values->connected);
}

static void age_grows_while_there_is_no_image(void **state)
{
	(void)state;
	for (int i = 0; i < 50; i++) {
		rig.now_ns += RIG_MS;
		exchange_read(&rig.exchange, values, EXCHANGE_NOTHING, rig.now_ns);
	}
	assert_true(values->age_us == 50200);
	/* and a daemon that knows nothing yet does not make it younger */
	rig.now_ns += RIG_MS;
	rig.daemon.t_digital_ns = 0;
	rig.daemon.t_motion_ns = 0;
	rig_read(&rig);
	assert_true(values->age_us == 51200);
}

static void age_of_what_never_came_counts_from_the_start(void **state)
{
	(void)state;
	rig_init(&rig);
	for (int i = 0; i <= 7; i++) {
		rig.now_ns += RIG_MS;
		exchange_read(&rig.exchange, values, EXCHANGE_NOTHING, rig.now_ns);
	}
	assert_true(values->age_us == 7000);
}

static void old_motion_data_are_stale_as_well(void **state)
{
	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 7);
	rig.daemon.t_digital_ns = rig.now_ns;
	rig_read(&rig);
	assert_true(values->stale);
}

static void a_device_without_motion_can_be_fresh(void **state)
{
	(void)state;
	rig_period(&rig);
	rig.daemon.capability.pulse_engine = 0;
	rig.daemon.t_motion_ns = 0;
	rig_read(&rig);
	assert_true(values->connected);
}

static void a_device_whose_positions_have_not_come_is_not_fresh(void **state)
{
	(void)state;
	rig_period(&rig);
	rig.daemon.t_motion_ns = 0;
	rig_read(&rig);
	assert_true(values->stale);
}

static void the_flag_is_believed_when_it_says_stale(void **state)
{
	(void)state;
	rig.daemon.flags |= POKEYS_STATE_STALE;
	rig_period(&rig);
	assert_true(values->stale);
}

static void only_a_running_link_is_connected(void **state)
{
	(void)state;
	for (uint8_t link = 0; link <= POKEYS_LINK_LOST; link++) {
		rig.daemon.link = link;
		rig_period(&rig);
		assert_int_equal(values->connected, link == POKEYS_LINK_RUNNING);
		assert_int_equal(values->link_state, link);
	}
}

static void time_stamps_from_the_future_are_not_fresh(void **state)
{
	(void)state;
	rig.now_ns += RIG_MS;
	rig_daemon(&rig);
	rig.daemon.t_digital_ns = rig.now_ns + 3600 * 1000 * RIG_MS;
	rig_read(&rig);
	assert_true(values->stale);
	rig.daemon.t_digital_ns = UINT64_MAX;
	rig_read(&rig);
	assert_true(values->stale);
	rig_daemon(&rig);
	rig.daemon.t_motion_ns = UINT64_MAX;
	rig_read(&rig);
	assert_true(values->stale);
}

static void an_absurd_limit_does_not_keep_a_dead_daemon_fresh(void **state)
{
	(void)state;
	rig.daemon.stale_after_ns = UINT64_MAX;
	rig.daemon.period_ns = UINT64_MAX;
	rig_period(&rig);
	rig.daemon_dead = true;
	rig_periods(&rig, 60100);
	assert_true(values->stale);
	assert_false(values->daemon_alive);
}

static void a_foreign_image_is_refused(void **state)
{
	(void)state;
	rig.now_ns += RIG_MS;
	exchange_read(&rig.exchange, values, EXCHANGE_REFUSED, rig.now_ns);
	assert_int_equal(values->attach_state, 2);
	assert_true(values->stale);
}

static void packet_errors_rise_and_fall_and_do_not_latch(void **state)
{
	(void)state;
	rig_periods(&rig, 20);
	assert_int_equal(values->packet_error_level, 0);
	rig.daemon.statistics.missed += 3;
	rig_period(&rig);
	assert_true(values->packet_error);
	assert_int_equal(values->packet_error_level, 2);
	assert_int_equal(values->packet_error_total, 3);
	rig_period(&rig);
	assert_false(values->packet_error);
	assert_int_equal(values->packet_error_level, 1);
	rig.device_silent = true;
	rig_periods(&rig, 30);
	assert_true(values->packet_error_exceeded);
	assert_int_equal(values->packet_error_level, 10);
	rig.device_silent = false;
	rig_period(&rig);
	assert_false(values->packet_error_exceeded);
	rig_periods(&rig, 10);
	assert_int_equal(values->packet_error_level, 0);
	assert_int_equal(values->packet_error_total, 3);
}

static void packet_error_settings_are_used_if_they_make_sense(void **state)
{
	(void)state;
	rig_periods(&rig, 20);
	values->packet_error_increment = 7;
	values->packet_error_limit = 9;
	values->packet_error_decrement = 4;
	rig.daemon.statistics.missed++;
	rig_period(&rig);
	assert_int_equal(values->packet_error_level, 7);
	rig.daemon.statistics.missed++;
	rig_period(&rig);
	assert_int_equal(values->packet_error_level, 9);
	rig_period(&rig);
	assert_int_equal(values->packet_error_level, 5);
	values->packet_error_decrement = 0;
	values->packet_error_limit = -1;
	rig_period(&rig);
	assert_int_equal(values->packet_error_level, 1);
	assert_true(values->input_refused);
}

static void a_new_daemons_counters_are_not_losses(void **state)
{
	(void)state;
	rig.daemon.statistics.missed = 10;
	rig_period(&rig);
	assert_int_equal(values->packet_error_total, 10);
	rig.daemon.epoch++;
	rig.daemon.statistics.missed = 5000;
	rig_period(&rig);
	assert_int_equal(values->packet_error_total, 10);
}

static void a_command_that_was_not_taken_is_no_commander(void **state)
{
	(void)state;
	rig_period(&rig);
	exchange_written(&rig.exchange, false);
	rig_read(&rig);
	assert_false(values->commander);
}

static void diagnostics_are_in_their_units(void **state)
{
	(void)state;
	rig.daemon.statistics.rtt_last_ns = 120500;
	rig.daemon.statistics.rtt_smoothed_ns = 130000;
	rig.daemon.statistics.rtt_max_ns = 990000;
	rig.daemon.statistics.rtt_variation_ns = 7000;
	rig.daemon.statistics.reconnects = 4;
	rig.daemon.statistics.refused_command = 6;
	rig.daemon.flags |= POKEYS_STATE_BAD_COMMAND | POKEYS_STATE_SAFE;
	rig.daemon.fault = POKEYS_FAULT_NO_ANSWER;
	rig.daemon.fault_count = 2;
	rig.daemon.cycle = 0x100000000u;
	rig_period(&rig);
	assert_true(values->rtt_us == 120.5 && values->rtt_avg_us == 130);
	assert_true(values->rtt_max_us == 990 && values->rtt_jitter_us == 7);
	assert_int_equal(values->reconnects, 4);
	assert_int_equal(values->command_refused_count, 6);
	assert_true(values->command_refused && values->safe_state);
	assert_int_equal(values->fault, POKEYS_FAULT_NO_ANSWER);
	assert_int_equal(values->fault_count, 2);
	assert_int_equal(values->cycle, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(before_any_daemon_nothing_is_claimed, setup),
		cmocka_unit_test_setup(fresh_data_connect, setup),
		cmocka_unit_test_setup(a_dead_daemon_is_locked_to_nobody, setup),
		cmocka_unit_test_setup(a_dead_daemon_is_noticed_by_our_own_clock, setup),
		cmocka_unit_test_setup(a_dead_daemon_is_noticed_however_patient_it_was, setup),
		cmocka_unit_test_setup(stale_pins_keep_their_last_values, setup),
		cmocka_unit_test_setup(a_silent_device_is_stale_though_the_daemon_lives, setup),
		cmocka_unit_test_setup(age_grows_while_there_is_no_image, setup),
		cmocka_unit_test_setup(age_of_what_never_came_counts_from_the_start, setup),
		cmocka_unit_test_setup(old_motion_data_are_stale_as_well, setup),
		cmocka_unit_test_setup(a_device_without_motion_can_be_fresh, setup),
		cmocka_unit_test_setup(a_device_whose_positions_have_not_come_is_not_fresh, setup),
		cmocka_unit_test_setup(the_flag_is_believed_when_it_says_stale, setup),
		cmocka_unit_test_setup(only_a_running_link_is_connected, setup),
		cmocka_unit_test_setup(time_stamps_from_the_future_are_not_fresh, setup),
		cmocka_unit_test_setup(an_absurd_limit_does_not_keep_a_dead_daemon_fresh, setup),
		cmocka_unit_test_setup(a_foreign_image_is_refused, setup),
		cmocka_unit_test_setup(packet_errors_rise_and_fall_and_do_not_latch, setup),
		cmocka_unit_test_setup(packet_error_settings_are_used_if_they_make_sense, setup),
		cmocka_unit_test_setup(a_new_daemons_counters_are_not_losses, setup),
		cmocka_unit_test_setup(a_command_that_was_not_taken_is_no_commander, setup),
		cmocka_unit_test_setup(diagnostics_are_in_their_units, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
