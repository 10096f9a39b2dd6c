/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Parameters that are the device's settings: whose they are, and what is
 * refused.
 */
#include "tests/halbridge/wish_rig.h"

static void nothing_is_wished_before_the_device_is_known(void **state)
{
	(void)state;
	values.set.pin_function[3] = 4;
	assert_false(rig_look());
	assert_int_equal(values.set.pin_function[3], 4);
	rig_know();
	assert_true(rig_look());
	assert_int_equal(wish.image.settings.pin_set[0], 1u << 3);
	assert_int_equal(wish.image.settings.pin_function[3], 4);
}

static void knowing_a_device_shows_its_settings_and_wishes_none(void **state)
{
	(void)state;
	rig_know();
	for (unsigned int i = 0; i < 3; i++)
		assert_false(rig_look());
	assert_int_equal(wish.image.generation, 0);
	for (size_t i = 0; i < wish.count; i++) {
		double shown = rig_parameter(&wish.item[i]);

		if (isnan(shown) || shown == wish.item[i].name->initial)
			fail_msg("%s, %u is not shown", wish.item[i].name->name,
				 wish.item[i].index);
	}
	assert_int_equal(values.set.pin_function[54], 1);
	assert_true(values.set.pwm_frequency == 10000);
	assert_true(values.set.axis[7].max_velocity == 1 / 200.0);
	assert_int_equal(values.set.encoder[24].sampling, 1);
}

static void check_refused(struct wish_item *item, double value)
{
	struct pokeys_settings before = wish.image.settings;
	double shown = rig_parameter(item);
	unsigned int count = refusals;

	rig_set(item, value);
	if (rig_parameter(item) == shown || (isnan(value) && isnan(item->name->initial)))
		return; /* not another value, or: give it back */
	assert_false(rig_look());
	assert_false(rig_look());
	if (refusals != count + 1 || refused != item)
		fail_msg("%s = %g is taken", item->name->name, value);
	assert_int_equal(values.diagnostics.config_input_refused, 1);
	assert_memory_equal(&before, &wish.image.settings, sizeof(before));
	rig_set(item, shown);
	assert_false(rig_look());
	assert_int_equal(values.diagnostics.config_input_refused, 0);
}

static void what_is_out_of_range_is_refused_once_and_the_old_value_stays(void **state)
{
	(void)state;
	rig_know();
	for (size_t i = 0; i < wish.count; i++)
		rig_set(&wish.item[i], rig_another(&wish.item[i]));
	rig_look();
	for (size_t i = 0; i < wish.count; i++) {
		struct wish_item *item = &wish.item[i];
		bool real = item->name->type == TABLE_FLOAT;

		if (real || item->name->high < INT32_MAX)
			check_refused(item, item->name->high * 1.01 + 1);
		if (real || item->name->low > INT32_MIN)
			check_refused(item, item->name->low < 0 ? item->name->low * 1.01 - 1 :
					    real                ? -1 :
								  -2);
		if (real)
			check_refused(item, (double)INFINITY);
	}
}

static void values_between_that_mean_nothing_are_refused(void **state)
{
	(void)state;
	rig_know();
	rig_look();
	values.set.encoder[4].sampling = 3;
	values.set.fast_configuration = 5;
	values.set.engine.emergency_pin = 7;
	values.set.engine.charge_pump = 3;
	values.set.engine.power_states = 8;
	values.set.failsafe.timeout_ms = 250;
	values.set.axis[2].max_velocity = 0;
	assert_false(rig_look());
	assert_int_equal(refusals, 7);
	assert_int_equal(values.diagnostics.config_input_refused, 7);
}

static void minus_one_gives_a_setting_back_to_the_device(void **state)
{
	(void)state;
	rig_know();
	rig_look();
	values.set.pin_function[9] = 2;
	assert_true(rig_look());
	values.set.pin_function[9] = -1;
	assert_true(rig_look());
	assert_int_equal(wish.image.settings.pin_set[1], 0);
	rig_look();
	assert_int_equal(values.set.pin_function[9], 1);
}

/* A wheel that is to turn the axis the other way, a pulse a count. */
static void multiplier_of_minus_one_is_a_multiplier(void **state)
{
	(void)state;
	rig_know();
	rig_look();
	values.set.axis[2].mpg_multiplier = -1;
	assert_true(rig_look());
	assert_true(wish.image.settings.axis[2].set & POKEYS_AXIS_SET_MPG_MULTIPLIER);
	assert_int_equal(wish.image.settings.axis[2].mpg_multiplier, -1);
	assert_false(rig_look());
	assert_int_equal(values.set.axis[2].mpg_multiplier, -1);
	values.set.axis[2].mpg_multiplier = SETTING_MULTIPLIER_LEFT;
	assert_true(rig_look());
	assert_false(wish.image.settings.axis[2].set & POKEYS_AXIS_SET_MPG_MULTIPLIER);
}

static void settings_that_go_together_take_the_devices_values_along(void **state)
{
	(void)state;
	rig_know();
	report.device.matrix_row_pin[5] = 33;
	wish_report(&wish, &report, &values);
	rig_look();
	values.set.matrix.columns = 6;
	assert_true(rig_look());
	assert_true(wish.image.settings.set & POKEYS_SET_MATRIX);
	assert_int_equal(wish.image.settings.matrix_columns, 6);
	assert_int_equal(wish.image.settings.matrix_row_pin[5], 33);
	assert_false(rig_look());
	assert_int_equal(values.set.matrix.row_pin[5], 33);
}

static bool look_twice(void)
{
	const bool first = rig_look();

	return rig_look() || first;
}

static void half_of_what_nobody_can_tell_is_not_wished(void **state)
{
	const struct pokeys_settings *wished = &wish.image.settings;

	(void)state;
	rig_know();
	report.device.set &= ~(uint32_t)POKEYS_SET_THREADING;
	wish_report(&wish, &report, &values);
	rig_look();
	values.set.threading.target_rpm = 500;
	values.set.threading.ticks = 4096;
	values.set.threading.mode = 1;
	values.set.threading.speed_gain = 7;
	values.set.threading.position_gain = 8;
	assert_false(look_twice());
	wish_report(&wish, &report, &values);
	assert_false(look_twice());
	assert_false(wished->set & POKEYS_SET_THREADING);
	assert_int_equal(values.set.threading.ticks, 4096);
	values.set.threading.ignore_axes = 4;
	assert_true(look_twice());
	assert_false(look_twice());
	assert_true(wished->set & POKEYS_SET_THREADING);
	assert_int_equal(wished->threading_rpm, 500);
	assert_int_equal(wished->threading_ticks, 4096);
	assert_int_equal(wished->threading_mode, 1);
	assert_int_equal(wished->threading_speed_gain, 7);
	assert_int_equal(wished->threading_position_gain, 8);
	assert_int_equal(wished->threading_ignore, 4);
	assert_int_equal(values.set.threading.speed_gain, 7);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(nothing_is_wished_before_the_device_is_known, rig_setup),
		cmocka_unit_test_setup(knowing_a_device_shows_its_settings_and_wishes_none,
				       rig_setup),
		cmocka_unit_test_setup(what_is_out_of_range_is_refused_once_and_the_old_value_stays,
				       rig_setup),
		cmocka_unit_test_setup(values_between_that_mean_nothing_are_refused, rig_setup),
		cmocka_unit_test_setup(multiplier_of_minus_one_is_a_multiplier, rig_setup),
		cmocka_unit_test_setup(minus_one_gives_a_setting_back_to_the_device, rig_setup),
		cmocka_unit_test_setup(half_of_what_nobody_can_tell_is_not_wished, rig_setup),
		cmocka_unit_test_setup(settings_that_go_together_take_the_devices_values_along,
				       rig_setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
