/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older scheme's names through the exchange: what each says of the device,
 * what each makes of the command, and that nothing of it acts where only the
 * canonical names are used.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct value_legacy *const legacy = &rig.values.legacy;
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init_older(&rig);
	return 0;
}

static void an_axis_follows_its_older_name_only_if_it_is_connected(void **state)
{
	(void)state;
	legacy->axis_set[0].enabled = 1;
	rig.values.machine_is_on = true;
	rig_period(&rig);
	assert_int_equal(command->axis[0].enable, 0);
	rig.exchange.legacy.linked[0] = true;
	rig_period(&rig);
	assert_int_equal(command->axis[0].enable, 1);
	legacy->axis_set[0].enabled = 0;
	rig_period(&rig);
	assert_int_equal(command->axis[0].enable, 0);
}

static void what_a_hal_file_sets_at_once_is_taken_while_the_machine_is_off(void **state)
{
	(void)state;
	rig.exchange.legacy.linked[0] = true;
	legacy->axis_set[0].enabled = 1;
	legacy->axis_set[0].offset = 10;
	rig.values.joint[0].scale = 200;
	rig.values.joint[0].pos_cmd = 1;
	rig_periods(&rig, 2);
	assert_int_equal(command->axis[0].position, 2200);
	assert_int_equal(command->axis[0].enable, 0);
	assert_false(rig.values.input_refused);
}

static void axis_enable_counts_only_if_chosen(void **state)
{
	(void)state;
	rig_drive_older(&rig);
	rig_period(&rig);
	assert_int_equal(command->axis[0].enable, 1);
	legacy->choice.axis_enable = true;
	rig_period(&rig);
	assert_int_equal(command->axis[0].enable, 0);
	legacy->axis[0].axis_enable = true;
	rig_period(&rig);
	assert_int_equal(command->axis[0].enable, 1);
	legacy->axis[0].axis_enable = false;
	legacy->axis[0].axis_enabled = true;
	rig_period(&rig);
	assert_int_equal(command->axis[0].enable, 1);
}

static void position_is_units_plus_offset_times_scale(void **state)
{
	(void)state;
	rig.values.joint[0].scale = 200.5;
	legacy->axis_set[0].offset = 10;
	rig.exchange.legacy.linked[0] = true;
	rig.values.joint[0].pos_cmd = 2;
	rig_periods(&rig, 2);
	assert_int_equal(command->axis[0].position, 2406);
	rig.daemon.engine.axis[0].position = 2406;
	rig_period(&rig);
	assert_true(fabs(rig.values.joint[0].pos_fb - 2) < 1e-9);
}

static void limits_the_wrong_way_round_turn_the_axis(void **state)
{
	(void)state;
	rig.values.joint[0].scale = 100;
	rig.exchange.legacy.linked[0] = true;
	legacy->axis_set[0].minimum = 5;
	legacy->axis_set[0].maximum = -5;
	rig.values.joint[0].pos_cmd = 3;
	rig_periods(&rig, 2);
	assert_int_equal(command->axis[0].position, -300);
}

static void the_whole_part_of_the_scale_is_a_choice(void **state)
{
	(void)state;
	rig.values.joint[0].scale = 200.9;
	rig.exchange.legacy.linked[0] = true;
	legacy->choice.whole_scale = true;
	rig.values.joint[0].pos_cmd = 1;
	rig_periods(&rig, 2);
	assert_int_equal(command->axis[0].position, 200);
}

static void an_enabled_axis_keeps_its_offset(void **state)
{
	(void)state;
	rig_drive_older(&rig);
	rig_period(&rig);
	legacy->axis_set[0].offset = 1000;
	rig_periods(&rig, 2);
	assert_int_equal(command->axis[0].position, 0);
	assert_true(rig.values.input_refused);
	legacy->axis_set[0].enabled = 0;
	rig_periods(&rig, 2);
	assert_int_equal(command->axis[0].position, 1000);
	assert_false(rig.values.input_refused);
}

/* Only LinuxCNC can say that it has seen it. */
static void a_lost_position_is_an_emergency_until_it_is_off(void **state)
{
	(void)state;
	rig.daemon.engine.emergency_pin = 1;
	rig.values.machine_is_on = true;
	rig_period(&rig);
	assert_false(legacy->engine.emergency);
	rig.daemon.engine.axis[0].position_epoch += 2;
	rig_periods(&rig, 1000);
	assert_true(legacy->engine.emergency);
	rig.values.machine_is_on = false;
	rig_period(&rig);
	assert_false(legacy->engine.emergency);
	/* to home it */
	rig.values.machine_is_on = true;
	rig_periods(&rig, 10);
	assert_false(legacy->engine.emergency);
	assert_true(rig.values.position_lost);
	rig.daemon.engine.axis[0].position_epoch += 2;
	rig_periods(&rig, 10);
	assert_true(legacy->engine.emergency);
}

/* It would be homed as before when it is switched on. */
static void and_while_the_machine_is_off_for_a_second(void **state)
{
	(void)state;
	rig.daemon.engine.emergency_pin = 1;
	rig_period(&rig);
	rig.daemon.engine.axis[0].position_epoch += 2;
	rig_periods(&rig, 900);
	assert_true(legacy->engine.emergency);
	rig_periods(&rig, 200);
	assert_false(legacy->engine.emergency);
	assert_true(rig.values.position_lost);
}

static void no_fresh_data_is_an_emergency(void **state)
{
	(void)state;
	rig.daemon.engine.emergency_pin = 1;
	rig_period(&rig);
	assert_false(legacy->engine.emergency);
	assert_true(legacy->engine.emergency_not);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_true(legacy->engine.emergency);
	assert_int_equal(legacy->engine.emergency_step, 11);
	legacy->choice.emergency_lost = false;
	rig.device_silent = false;
	rig_period(&rig);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_false(legacy->engine.emergency);
}

static void emergency_without_a_pin_is_a_choice(void **state)
{
	(void)state;
	rig_period(&rig);
	assert_true(legacy->engine.emergency);
	assert_int_equal(legacy->engine.emergency_step, 12);
	legacy->choice.emergency_unset = false;
	rig_period(&rig);
	assert_false(legacy->engine.emergency);
}

static void emergency_follows_its_pin_and_the_engine(void **state)
{
	(void)state;
	legacy->engine_set.emergency_pin = 52;
	rig_period(&rig);
	assert_int_equal(legacy->engine.emergency_step, 10);
	rig.daemon.digital_in[51 / 8] |= 1u << 51 % 8;
	rig_period(&rig);
	assert_true(legacy->engine.emergency);
	legacy->engine_set.emergency_invert = 1;
	rig_period(&rig);
	assert_false(legacy->engine.emergency);
	rig.daemon.engine.state = 101;
	rig_period(&rig);
	assert_int_equal(legacy->engine.emergency_step, 8);
	legacy->engine_set.emergency_pin = 0;
	rig.daemon.engine.state = 0;
	rig.daemon.engine.emergency_pin = 62; /* the device's own: pin 52 */
	rig_period(&rig);
	assert_int_equal(legacy->engine.emergency_step, 10);
}

/* Nets of before March 2025 lead Emergency.in to iocontrol.0.emc-enable-in. */
static void emergency_is_turned_around_as_it_was_if_chosen(void **state)
{
	(void)state;
	legacy->choice.old_emergency = true;
	rig_period(&rig); /* no pin is set */
	assert_true(legacy->engine.emergency && !legacy->engine.emergency_not);
	rig.daemon.engine.emergency = 1;
	rig_period(&rig);
	assert_true(!legacy->engine.emergency && legacy->engine.emergency_not);
	rig.daemon.engine.emergency = 0;
	legacy->engine_set.emergency_pin = 52; /* the device looks at it, not we */
	rig.daemon.digital_in[51 / 8] |= 1u << 51 % 8;
	rig_period(&rig);
	assert_true(legacy->engine.emergency);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_true(!legacy->engine.emergency && legacy->engine.emergency_not);
	assert_int_equal(legacy->engine.emergency_step, 11);
}

static void a_switch_is_true_when_tripped(void **state)
{
	struct legacy_axis_settings *set = &legacy->axis_set[3];

	(void)state;
	set->limit_minus = true; /* dedicated input */
	rig.daemon.engine.dedicated_limit_minus = 8;
	rig_period(&rig);
	assert_true(legacy->axis[3].limit_minus && !legacy->axis[3].limit_minus_not);
	set->limit_minus_invert = true;
	rig_period(&rig);
	assert_true(!legacy->axis[3].limit_minus && legacy->axis[3].limit_minus_not);
	set->limit_minus_pin = 5; /* while the axis is in state 0: the pin itself */
	set->limit_minus_invert = false;
	rig.daemon.digital_in[0] = 1u << 4;
	rig_period(&rig);
	assert_true(legacy->axis[3].limit_minus);
	rig.daemon.engine.axis[3].state = 1; /* from now on the device's word */
	rig_period(&rig);
	assert_false(legacy->axis[3].limit_minus);
	rig.daemon.engine.limit_minus = 8;
	rig_period(&rig);
	assert_true(legacy->axis[3].limit_minus);
}

/* Nets of the old component's time count on what it said. */
static void switches_at_pins_are_turned_as_they_were_if_chosen(void **state)
{
	struct legacy_axis_settings *set = &legacy->axis_set[3];
	const struct legacy_axis *axis = &legacy->axis[3];

	(void)state;
	set->limit_minus_pin = set->limit_plus_pin = set->home_pin = 5;
	rig.daemon.engine.axis[3].state = 1;
	legacy->choice.old_switches = true;
	rig_period(&rig);
	assert_true(axis->limit_minus && axis->limit_plus && !axis->home);
	assert_true(!axis->limit_minus_not && !axis->limit_plus_not && axis->home_not);
	set->limit_minus_invert = set->limit_plus_invert = set->home_invert = true;
	rig_period(&rig);
	assert_true(axis->limit_minus && !axis->limit_plus && axis->home);
	rig.daemon.engine.limit_minus = rig.daemon.engine.limit_plus = 8;
	rig.daemon.engine.home = 8;
	rig_period(&rig);
	assert_true(!axis->limit_minus && axis->limit_plus && !axis->home);
	/* while it stands, and at dedicated inputs, they said what they mean */
	rig.daemon.engine.axis[3].state = 0;
	rig.daemon.digital_in[0] = 1u << 4;
	rig_period(&rig);
	assert_true(!axis->limit_minus && !axis->limit_plus && !axis->home);
}

static void external_outputs_depend_on_the_board(void **state)
{
	(void)state;
	rig.daemon.identity.serial = 1;
	rig.daemon.identity.hardware = 32;
	rig_period(&rig);
	assert_int_equal(command->external_outputs_mask, 0);
	legacy->engine.relay[0] = true;
	rig_period(&rig);
	assert_int_equal(command->external_outputs, 0x80);
	assert_int_equal(command->external_outputs_mask, 0xff);
	legacy->engine.relay[0] = false;
	legacy->engine.relay[3] = true;
	legacy->engine.output[2] = true;
	rig_period(&rig);
	assert_int_equal(command->external_outputs, 0x22);
	rig.daemon.identity.hardware = 29; /* a board without */
	rig_period(&rig);
	assert_int_equal(command->external_outputs, 0);
	legacy->engine_set.extended = true;
	rig_period(&rig);
	assert_int_equal(command->external_outputs, 0x04);
	assert_int_equal(command->relays, 0x08);
}

static void analog_outputs_do_nothing_until_chosen(void **state)
{
	(void)state;
	rig.daemon.pwm_period = 1000;
	legacy->adcout[0].value = 2.5;
	legacy->adcout[0].enable = true;
	legacy->adcout[0].scale = 1;
	rig_period(&rig);
	assert_int_equal(legacy->adcout[0].duty, 500);
	assert_int_equal(command->pwm_duty[5], 0);
	assert_int_equal(command->pwm_enable, 0);
	legacy->choice.adcout = true;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[5], 500);
	assert_int_equal(command->pwm_enable, 1u << 5);
	assert_int_equal(command->pwm_period, 1000);
}

static void analog_outputs_are_clamped_and_never_nan(void **state)
{
	struct legacy_adcout *value = &legacy->adcout[5];

	(void)state;
	rig.daemon.pwm_period = 1000;
	legacy->choice.adcout = true;
	*value = (struct legacy_adcout){
		.value = 20, .enable = true, .scale = 1, .full = 10, .low = 1, .high = 8
	};
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[0], 800);
	value->value = -3;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[0], 100);
	value->value = NAN;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[0], 0);
	assert_true(rig.values.input_refused);
	value->value = 5;
	value->enable = false;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[0], 0);
}

static void encoders_have_a_factor(void **state)
{
	(void)state;
	legacy->encoder[4].scale = 0.01;
	legacy->encoder[12].scale = 2;
	rig.values.encoder[12].scale = 4;
	rig_period(&rig);
	rig.daemon.encoder[4] = 500;
	rig.daemon.encoder[12] = 100;
	rig_period(&rig);
	assert_true(fabs(legacy->encoder[4].position - 5) < 1e-9);
	assert_true(fabs(legacy->encoder[12].position - 200) < 1e-9);
	assert_true(fabs(rig.values.encoder[12].position - 25) < 1e-9);
	legacy->choice.encoder_factor = true;
	rig_period(&rig);
	assert_true(fabs(rig.values.encoder[12].position - 400) < 1e-9);
	legacy->choice.encoder_factor = false; /* and nothing moves */
	rig_period(&rig);
	rig_period(&rig);
	assert_true(fabs(rig.values.encoder[12].position - 25) < 1e-9);
}

static void limit_override_is_a_choice(void **state)
{
	(void)state;
	legacy->engine.override_wanted = 1;
	rig_period(&rig);
	assert_int_equal(command->flags & POKEYS_COMMAND_LIMIT_OVERRIDE, 0);
	legacy->choice.limit_override = true;
	rig_period(&rig);
	assert_int_not_equal(command->flags & POKEYS_COMMAND_LIMIT_OVERRIDE, 0);
}

static void the_emergency_output_is_a_choice(void **state)
{
	(void)state;
	legacy->engine_set.emergency_out_pin = 10;
	legacy->engine.emergency_out = true;
	rig_period(&rig);
	assert_int_equal(command->digital_out[1], 0);
	legacy->choice.emergency_out = true;
	rig_period(&rig);
	assert_int_equal(command->digital_out[1], 2);
}

/* A packet late by some milliseconds: the daemon goes on with what we command. */
static void outputs_stay_as_commanded_while_data_are_stale(void **state)
{
	(void)state;
	rig.daemon.pwm_period = 1000;
	rig.daemon.identity.hardware = 33;
	legacy->adcout[0] = (struct legacy_adcout){ .value = 2.5, .enable = true, .scale = 1 };
	legacy->choice.adcout = legacy->choice.emergency_out = true;
	legacy->engine_set.emergency_out_pin = 10;
	legacy->engine.emergency_out = true;
	legacy->engine.relay[1] = true;
	rig_period(&rig);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_true(rig.values.stale);
	assert_int_equal(command->pwm_duty[5], 500);
	assert_int_equal(command->pwm_enable, 1u << 5);
	assert_int_equal(command->digital_out[1], 2);
	assert_int_equal(command->external_outputs, 0x80);
	assert_int_equal(command->external_outputs_mask, UINT8_MAX);
	/* but which output is which is not known of a device that is not there */
	rig.daemon.link = POKEYS_LINK_SEARCHING;
	rig_period(&rig);
	assert_int_equal(command->external_outputs_mask, 0);
}

static void the_clock_tells_the_rate_and_the_way_through_hal(void **state)
{
	(void)state;
	rig.daemon.rtc.second = 7;
	rig_period(&rig);
	for (unsigned int i = 0; i < 1000; i++) {
		legacy->clock.second_back = i < 3 ? 6 : 7;
		rig_period(&rig);
	}
	assert_int_equal(legacy->clock.latency, 4);
	rig.daemon.rtc.second = 8;
	rig_period(&rig);
	assert_in_range(legacy->clock.rate, 999, 1001);
	assert_int_equal(legacy->clock.last_second, 7);
}

static void without_the_scheme_nothing_of_it_acts(void **state)
{
	(void)state;
	rig.exchange.legacy.on = false;
	rig.daemon.identity.hardware = 32;
	rig_drive_older(&rig);
	legacy->engine.relay[0] = true;
	legacy->choice.adcout = legacy->adcout[0].enable = true;
	legacy->engine.home_mask = 1;
	rig_periods(&rig, 3);
	assert_int_equal(command->axis[0].enable, 0);
	assert_int_equal(command->external_outputs_mask, 0);
	assert_int_equal(command->pwm_enable, 0);
	assert_int_equal(legacy->engine.home_mask, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(an_axis_follows_its_older_name_only_if_it_is_connected,
				       setup),
		cmocka_unit_test_setup(
			what_a_hal_file_sets_at_once_is_taken_while_the_machine_is_off, setup),
		cmocka_unit_test_setup(axis_enable_counts_only_if_chosen, setup),
		cmocka_unit_test_setup(position_is_units_plus_offset_times_scale, setup),
		cmocka_unit_test_setup(limits_the_wrong_way_round_turn_the_axis, setup),
		cmocka_unit_test_setup(the_whole_part_of_the_scale_is_a_choice, setup),
		cmocka_unit_test_setup(an_enabled_axis_keeps_its_offset, setup),
		cmocka_unit_test_setup(no_fresh_data_is_an_emergency, setup),
		cmocka_unit_test_setup(a_lost_position_is_an_emergency_until_it_is_off, setup),
		cmocka_unit_test_setup(and_while_the_machine_is_off_for_a_second, setup),
		cmocka_unit_test_setup(emergency_without_a_pin_is_a_choice, setup),
		cmocka_unit_test_setup(emergency_follows_its_pin_and_the_engine, setup),
		cmocka_unit_test_setup(emergency_is_turned_around_as_it_was_if_chosen, setup),
		cmocka_unit_test_setup(a_switch_is_true_when_tripped, setup),
		cmocka_unit_test_setup(switches_at_pins_are_turned_as_they_were_if_chosen, setup),
		cmocka_unit_test_setup(external_outputs_depend_on_the_board, setup),
		cmocka_unit_test_setup(analog_outputs_do_nothing_until_chosen, setup),
		cmocka_unit_test_setup(analog_outputs_are_clamped_and_never_nan, setup),
		cmocka_unit_test_setup(encoders_have_a_factor, setup),
		cmocka_unit_test_setup(limit_override_is_a_choice, setup),
		cmocka_unit_test_setup(the_emergency_output_is_a_choice, setup),
		cmocka_unit_test_setup(outputs_stay_as_commanded_while_data_are_stale, setup),
		cmocka_unit_test_setup(the_clock_tells_the_rate_and_the_way_through_hal, setup),
		cmocka_unit_test_setup(without_the_scheme_nothing_of_it_acts, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
