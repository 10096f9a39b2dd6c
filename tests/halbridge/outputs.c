/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs: inversion, who may be commanded at all, PWM's limits, lamps.
 */
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
		cmocka_unit_test_setup(brightness_is_sent_when_it_is_asked_for, setup),
		cmocka_unit_test_setup(a_modules_outputs_and_brightness_go_together, setup),
		cmocka_unit_test_setup(automatic_brightness_is_the_opposite_of_the_light, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
