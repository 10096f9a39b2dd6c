/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Zeros under the older names: what nobody said, and what somebody did.
 *
 * INI and HAL files list everything, and most of it is 0. The older component let
 * the device keep what it has for many of these; a charge pump, a jog wheel or a
 * filter that was set up in the device must not be gone with the first start.
 */
#include "tests/halbridge/rig.h"
#include "halbridge/legacy_settings.h"

enum { AXIS = 2, ENCODER = 3 };

static struct values values;
static struct legacy_settings own;
static struct legacy_axis_settings *const set = &values.legacy.axis_set[AXIS];
static struct value_axis_settings *const device = &values.set.axis[AXIS];
static struct legacy_encoder_settings *const encoder = &values.legacy.encoder_set[ENCODER];
static bool driven[POKEYS_AXES];

static int setup(void **state)
{
	(void)state;
	memset(&values, 0, sizeof(values));
	memset(&own, 0, sizeof(own));
	table_set_parameters(&values);
	return 0;
}

static void look(void)
{
	legacy_settings_look(&own, &values, driven);
}

/* It has been read: the canonical parameters show what it has. */
static void know_the_device(void)
{
	memset((void *)values.set.pin_function, 0, sizeof(values.set.pin_function));
	device->enable = 1;
	device->enable_pin = 17;
	device->enable_invert = 1;
	device->home_filter = 20;
	device->probe_filter = 30;
	device->mpg_encoder = 5;
	device->mpg_multiplier = 4;
	device->mpg_divider = 2;
	device->limit_neg = 1;
	values.set.encoder[ENCODER].sampling = 4;
	values.set.engine.generator = values.set.engine.emergency_pin = 0;
	values.set.engine.charge_pump = 1;
}

static void what_is_zero_stays_as_the_device_has_it(void **state)
{
	(void)state;
	set->enabled = 1;
	set->inverted = 1;
	values.legacy.engine_set.emergency_pin = 52;
	encoder->enable = true;
	values.legacy.engine.apply = true;
	look();
	know_the_device();
	own.axis_group[AXIS].put = false; /* as after any change */
	look();
	assert_int_equal(device->invert, 1);
	assert_int_equal(device->limit_neg, 0); /* a switch that nobody has is none */
	assert_int_equal(device->enable_pin, 17);
	assert_int_equal(device->enable_invert, 1);
	assert_int_equal(device->home_filter, 20);
	assert_int_equal(device->probe_filter, 30);
	assert_int_equal(device->mpg_encoder, 5);
	assert_int_equal(device->mpg_multiplier, 4);
	assert_int_equal(device->mpg_divider, 2);
	assert_int_equal(values.set.engine.emergency_pin, 62);
	assert_int_equal(values.set.engine.charge_pump, 1);
	assert_int_equal(values.set.encoder[ENCODER].sampling, 4);
}

/* A HAL file sets its zeros before it says that all of it is to be applied. */
static void zeros_of_a_file_are_not_wishes(void **state)
{
	(void)state;
	know_the_device();
	look();
	assert_int_equal(set->home_filter, 20);
	set->enabled = 1;
	set->home_filter = 0;
	set->enable_pin = 0;
	set->mpg_encoder = 0;
	values.legacy.engine_set.charge_pump = 0;
	values.legacy.engine_set.emergency_invert = 1;
	values.legacy.engine.apply = true;
	look();
	look();
	assert_int_equal(device->home_filter, 20);
	assert_int_equal(device->enable_pin, 17);
	assert_int_equal(device->mpg_encoder, 5);
	assert_int_equal(values.set.engine.charge_pump, 1);
	assert_int_equal(values.set.engine.emergency_invert, 1);
}

static void a_zero_in_place_of_something_else_is_one(void **state)
{
	(void)state;
	know_the_device();
	values.legacy.engine.apply = true;
	look();
	set->home_filter = 0;
	set->enable_invert = false;
	values.legacy.engine_set.charge_pump = 0;
	encoder->x4 = false;
	look();
	assert_int_equal(device->home_filter, 0);
	assert_int_equal(device->enable_invert, 0);
	assert_int_equal(values.set.engine.charge_pump, 0);
	assert_int_equal(values.set.encoder[ENCODER].sampling, 1);
	/* and it is one as long as it stands there */
	device->home_filter = 20;
	set->inverted = 1;
	look();
	assert_int_equal(device->home_filter, 0);
	encoder->enable = false;
	look();
	assert_int_equal(values.set.encoder[ENCODER].sampling, 0);
}

static void an_axis_that_is_not_enabled_is_left_alone(void **state)
{
	(void)state;
	set->enabled = 0;
	set->velocity = 20;
	set->limit_plus = true;
	values.legacy.engine.apply = true;
	look();
	know_the_device();
	look();
	assert_int_equal(set->enabled, 0);
	assert_int_equal(device->enable, 1);
	assert_int_equal(device->limit_neg, 1);
	assert_int_equal(device->limit_pos, -1);
	set->enabled = 1;
	look();
	assert_int_equal(device->limit_neg, 0);
	assert_int_equal(device->limit_pos, 1);
	set->enabled = 0;
	look();
	assert_int_equal(device->enable, 0);
}

static void an_axis_of_which_nobody_said_is_as_in_the_device(void **state)
{
	(void)state;
	set->limit_plus = true;
	look();
	assert_int_equal(set->enabled, -1);
	values.legacy.engine.apply = true;
	look();
	assert_int_equal(device->limit_pos, -1);
	know_the_device();
	set->limit_plus_invert = true;
	look();
	assert_int_equal(set->enabled, 1);
	assert_int_equal(device->limit_pos, 1);
	/* or as its speed says */
	values.legacy.axis_set[5].velocity = 10;
	look();
	assert_int_equal(values.legacy.axis_set[5].enabled, 1);
	assert_int_equal(values.set.axis[5].enable, 1);
}

static void terminals_get_the_function_that_an_axis_needs(void **state)
{
	volatile int32_t *function = values.set.pin_function;

	(void)state;
	set->enabled = 1;
	set->limit_minus_pin = 28;
	set->limit_plus_pin = 29;
	set->home_pin = 30;
	set->enable_pin = 31;
	values.legacy.engine.apply = true;
	look();
	assert_int_equal(function[27], -1);
	know_the_device();
	function[28] = 130;
	look();
	assert_int_equal(function[27], 2);
	assert_int_equal(function[28], 130); /* an input that is inverted stays so */
	assert_int_equal(function[29], 2);
	assert_int_equal(function[30], 4);
	assert_int_equal(function[31], 0);
	/* what somebody makes of it afterwards is his affair */
	function[27] = 8;
	look();
	assert_int_equal(function[27], 8);
}

/* An INI file whose speeds are per minute asks for seven million pulses a second. */
static void no_speed_is_wished_that_the_generator_cannot_make(void **state)
{
	(void)state;
	set->enabled = 1;
	set->velocity = 9000;
	values.joint[AXIS].scale = -800;
	values.legacy.engine.apply = true;
	look();
	values.legacy.engine.khz = 125;
	look();
	assert_true(set->max_speed == 7.2e6);
	assert_true(fabs(device->max_velocity - 156.25) < 1e-9);
	set->velocity = 100;
	look();
	assert_true(fabs(device->max_velocity - 100) < 1e-9);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(what_is_zero_stays_as_the_device_has_it, setup),
		cmocka_unit_test_setup(zeros_of_a_file_are_not_wishes, setup),
		cmocka_unit_test_setup(a_zero_in_place_of_something_else_is_one, setup),
		cmocka_unit_test_setup(an_axis_that_is_not_enabled_is_left_alone, setup),
		cmocka_unit_test_setup(an_axis_of_which_nobody_said_is_as_in_the_device, setup),
		cmocka_unit_test_setup(terminals_get_the_function_that_an_axis_needs, setup),
		cmocka_unit_test_setup(no_speed_is_wished_that_the_generator_cannot_make, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
