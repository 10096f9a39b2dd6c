/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs: inversion, who may be commanded at all, PWM's limits, lamps.
 */
#include <pokeys/settings.h>
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct values *const values = &rig.values;
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig.daemon.pwm_period = 25000;
	rig.daemon.kbd48_module = 255;
	rig_periods(&rig, 2);
	return 0;
}

static void an_inverted_output_is_on_when_its_pin_is_not(void **state)
{
	(void)state;
	rig.daemon.digital_out_owned[1] = 0x03;
	values->pin.out_invert[8] = true;
	rig_period(&rig);
	assert_int_equal(command->digital_out[1] & 0x03, 0x01);
	rig.daemon.digital_out[1] = 0x01;
	rig_period(&rig);
	assert_false(values->pin.out_fb[8]);
	values->pin.out[8] = true;
	rig_period(&rig);
	assert_int_equal(command->digital_out[1] & 0x03, 0x00);
	rig.daemon.digital_out[1] = 0x00;
	rig_period(&rig);
	assert_true(values->pin.out_fb[8]);
}

static void loading_commands_no_output_that_nobody_configured(void **state)
{
	static const uint8_t none[sizeof(command->poextbus_mask)];

	(void)state;
	rig.daemon.engine.outputs = 0xff;
	memset(rig.daemon.poextbus, 0xff, sizeof(rig.daemon.poextbus));
	rig_periods(&rig, 20);
	assert_memory_equal(command->poextbus_mask, none, sizeof(none));
	assert_int_equal(command->external_outputs_mask | command->relays_mask, 0);
	assert_int_equal(command->ponet_mask, 0);
	assert_int_equal(command->pwm_enable, 0);
	assert_int_equal(command->pwm_period, 0);
	assert_int_equal(command->kbd48_flags, 0);
}

static void a_byte_once_true_is_followed_from_then_on(void **state)
{
	(void)state;
	values->poextbus.out[13] = true;
	values->external.output[2] = true;
	rig_period(&rig);
	assert_int_equal(command->poextbus_mask[1], 0xff);
	assert_int_equal(command->poextbus_mask[0], 0);
	assert_int_equal(command->external_outputs_mask, 0xff);
	values->poextbus.out[13] = false;
	values->external.output[2] = false;
	rig_period(&rig);
	assert_int_equal(command->poextbus[1], 0);
	assert_int_equal(command->poextbus_mask[1], 0xff);
	assert_int_equal(command->external_outputs, 0);
	assert_int_equal(command->external_outputs_mask, 0xff);
}

static void a_bus_output_can_be_inverted(void **state)
{
	(void)state;
	values->poextbus.out_invert[79] = true;
	rig_period(&rig);
	assert_int_equal(command->poextbus[9], 0x80);
	assert_int_equal(command->poextbus_mask[9], 0xff);
}

static void pwm_is_value_over_scale_plus_offset_within_its_limits(void **state)
{
	struct value_pwm *spindle = &values->pwm[2];

	(void)state;
	spindle->enable = true;
	spindle->scale = 24000;
	spindle->value = 6000;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[2], 6250);
	spindle->offset = 0.5;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[2], 18750);
	spindle->max_dc = 0.6;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[2], 15000);
	spindle->value = -24000;
	spindle->min_dc = 0.1;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[2], 2500);
	assert_false(values->input_refused);
}

static void pwm_that_is_not_enabled_has_duty_0_and_stays_driven(void **state)
{
	(void)state;
	values->pwm[1].enable = true;
	values->pwm[1].value = 1;
	values->pwm[1].min_dc = 0.2;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[1], 25000);
	values->pwm[1].enable = false;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[1], 0);
	assert_int_equal(command->pwm_enable, 1u << 1);
}

static void a_pwm_parameter_out_of_range_keeps_the_last_good_one(void **state)
{
	(void)state;
	values->pwm[0].enable = true;
	values->pwm[0].value = 10;
	values->pwm[0].max_dc = 0.5;
	rig_period(&rig);
	values->pwm[0].max_dc = 1.5;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[0], 12500);
	assert_true(values->input_refused);
	values->pwm[0].max_dc = (double)NAN;
	values->pwm[0].scale = 0;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[0], 12500);
	values->pwm[0].max_dc = 1;
	values->pwm[0].scale = 10;
	rig_period(&rig);
	assert_int_equal(command->pwm_duty[0], 25000);
	assert_false(values->input_refused);
}

static void a_refusal_names_the_parameter_and_its_range(void **state)
{
	struct refusal_note note;
	char line[128];

	(void)state;
	values->pwm[4].max_dc = 1.5;
	values->pwm[3].scale = 0;
	rig_period(&rig);
	assert_true(refusal_take(&rig.exchange.refusals, &note));
	refusal_line(&note, "pokeys.0", TABLE_CANONICAL, line, sizeof(line));
	assert_string_equal(line, "pokeys.0.pwm.03.scale = 0: must not be 0; the last good value "
				  "stays in use");
	assert_true(refusal_take(&rig.exchange.refusals, &note));
	refusal_line(&note, "pokeys.0", TABLE_CANONICAL, line, sizeof(line));
	assert_string_equal(line, "pokeys.0.pwm.04.max-dc = 1.5: must be 0 to 1; the old value "
				  "stays in use");
}

static void assert_note(const char *expected)
{
	struct refusal_note note;
	char line[160];

	assert_true(refusal_take(&rig.exchange.refusals, &note));
	refusal_line(&note, "pokeys.0", TABLE_CANONICAL, line, sizeof(line));
	assert_string_equal(line, expected);
	assert_false(refusal_take(&rig.exchange.refusals, &note));
}

/* HAL's pin 32 is terminal 33, and pokeysd.conf has only 32 of them. */
static void an_output_that_drives_nothing_is_told_with_its_terminal(void **state)
{
	struct refusal_note note;

	(void)state;
	rig.daemon.config_state = POKEYS_CONFIG_APPLIED;
	rig.daemon.digital_out_owned[3] = 0x80;
	values->pin.out[31] = true;
	rig_periods(&rig, 3);
	assert_false(values->input_refused);
	values->pin.out[32] = true;
	rig_periods(&rig, 50);
	assert_true(values->input_refused);
	assert_int_equal(values->input_refused_count, 1);
	assert_note("pokeys.0.pin.32.out = 1: drives nothing: terminal 33 is not a digital output "
		    "(add it to digital-outputs in pokeysd.conf, then pokeysctl config apply)");
	rig.daemon.digital_out_owned[4] = 0x01;
	rig_periods(&rig, 2);
	assert_false(values->input_refused);
	/* another program has made an input of it */
	rig.daemon.digital_out_owned[4] = 0;
	rig_periods(&rig, 2);
	assert_true(values->input_refused);
	assert_int_equal(values->input_refused_count, 2);
	values->pin.out[32] = false;
	rig_period(&rig);
	assert_false(values->input_refused);
	while (refusal_take(&rig.exchange.refusals, &note))
		assert_int_equal(note.reason, REFUSAL_NO_OUTPUT);
}

/* ... and what is not known is not judged. */
static void an_output_is_judged_once_the_settings_are_there(void **state)
{
	static const uint8_t on_their_way[] = {
		POKEYS_CONFIG_UNKNOWN,
		POKEYS_CONFIG_WAITING,
		POKEYS_CONFIG_APPLYING,
	};

	(void)state;
	values->pin.out[32] = true;
	for (size_t i = 0; i < sizeof(on_their_way); i++) {
		rig.daemon.config_state = on_their_way[i];
		rig_periods(&rig, 20);
		assert_false(values->input_refused);
	}
	rig.device_silent = true;
	rig_periods(&rig, 20);
	rig.daemon.config_state = POKEYS_CONFIG_REFUSED;
	rig_periods(&rig, 20);
	assert_false(values->input_refused);
	rig.device_silent = false;
	rig_periods(&rig, 2);
	assert_true(values->input_refused);
	/* a loss does not tell it again */
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_true(values->input_refused);
	rig.device_silent = false;
	rig_periods(&rig, 20);
	assert_int_equal(values->input_refused_count, 1);
}

/* The fourth channel's terminal is the probe's on a PoKeys57CNC. */
static void a_pwm_output_that_the_board_has_not_is_told(void **state)
{
	(void)state;
	values->pwm[0].enable = values->pwm[3].enable = true;
	rig_periods(&rig, 2);
	assert_false(values->input_refused);
	rig.daemon.capability.pwm_pins = UINT64_C(0x3f) << 16 & ~(UINT64_C(1) << 18);
	rig_periods(&rig, 2);
	assert_true(values->input_refused);
	assert_int_equal(values->input_refused_count, 1);
	assert_note("pokeys.0.pwm.03.enable = 1: drives nothing: this device has no such PWM "
		    "output (pokeysctl terminals lists them)");
	values->pwm[3].enable = false;
	rig_period(&rig);
	assert_false(values->input_refused);
}

static void brightness_is_sent_when_it_is_asked_for(void **state)
{
	(void)state;
	values->kbd48.brightness = 40;
	rig_period(&rig);
	assert_int_equal(command->kbd48_flags, POKEYS_KBD48_BRIGHTNESS);
	assert_int_equal(command->kbd48_brightness, 40);
	values->kbd48.brightness = 256;
	rig_period(&rig);
	assert_int_equal(command->kbd48_brightness, 40);
	assert_true(values->input_refused);
	values->kbd48.brightness = -1;
	rig_period(&rig);
	assert_int_equal(command->kbd48_flags, 0);
}

static void a_modules_outputs_and_brightness_go_together(void **state)
{
	(void)state;
	values->ponet.module[2].out[1] = 0x01020304;
	rig_period(&rig);
	assert_int_equal(command->ponet_mask, 1u << 2);
	assert_int_equal(command->ponet_data[2][4], 4);
	assert_int_equal(command->ponet_data[2][7], 1);
	assert_int_equal(command->ponet_brightness[2], 255);
	values->ponet.module[2].brightness = 10;
	values->ponet.module[5].brightness = 0;
	rig_period(&rig);
	assert_int_equal(command->ponet_brightness[2], 10);
	assert_int_equal(command->ponet_mask, 1u << 2 | 1u << 5);
	values->ponet.module[2].brightness = 300;
	rig_period(&rig);
	assert_int_equal(command->ponet_brightness[2], 10);
	assert_true(values->input_refused);
}

static void automatic_brightness_is_the_opposite_of_the_light(void **state)
{
	(void)state;
	rig.daemon.kbd48_module = 4;
	rig.daemon.ponet[4].type = 16;
	rig.daemon.ponet[4].light = 55;
	values->kbd48.auto_brightness = true;
	rig_period(&rig);
	assert_int_equal(command->kbd48_brightness, 200);
	rig.daemon.ponet[4].failures = 3;
	rig_period(&rig);
	assert_int_equal(command->kbd48_flags, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(an_inverted_output_is_on_when_its_pin_is_not, setup),
		cmocka_unit_test_setup(loading_commands_no_output_that_nobody_configured, setup),
		cmocka_unit_test_setup(a_byte_once_true_is_followed_from_then_on, setup),
		cmocka_unit_test_setup(a_bus_output_can_be_inverted, setup),
		cmocka_unit_test_setup(pwm_is_value_over_scale_plus_offset_within_its_limits,
				       setup),
		cmocka_unit_test_setup(pwm_that_is_not_enabled_has_duty_0_and_stays_driven, setup),
		cmocka_unit_test_setup(a_pwm_parameter_out_of_range_keeps_the_last_good_one, setup),
		cmocka_unit_test_setup(a_refusal_names_the_parameter_and_its_range, setup),
		cmocka_unit_test_setup(an_output_that_drives_nothing_is_told_with_its_terminal,
				       setup),
		cmocka_unit_test_setup(an_output_is_judged_once_the_settings_are_there, setup),
		cmocka_unit_test_setup(a_pwm_output_that_the_board_has_not_is_told, setup),
		cmocka_unit_test_setup(brightness_is_sent_when_it_is_asked_for, setup),
		cmocka_unit_test_setup(a_modules_outputs_and_brightness_go_together, setup),
		cmocka_unit_test_setup(automatic_brightness_is_the_opposite_of_the_light, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
