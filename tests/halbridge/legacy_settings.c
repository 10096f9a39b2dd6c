/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older names of settings: whose word counts, what is made of what, and
 * what reaches the canonical parameters.
 */
#include "tests/halbridge/rig.h"
#include "halbridge/legacy_range.h"
#include "halbridge/legacy_settings.h"

static struct values values;
static struct legacy_settings own;
static struct legacy_axis_settings *const set = &values.legacy.axis_set[2];
static struct value_axis_settings *const device = &values.set.axis[2];

static int setup(void **state)
{
	(void)state;
	memset(&values, 0, sizeof(values));
	memset(&own, 0, sizeof(own));
	table_set_parameters(&values);
	values.joint[2].scale = 200;
	return 0;
}

/* The device has been read: the canonical parameters show what it has. */
static void know_the_device(void)
{
	const size_t whole_numbers = offsetof(struct value_axis_settings, enable);

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		memset((char *)&values.set.axis[i] + whole_numbers, 0,
		       sizeof(values.set.axis[i]) - whole_numbers);
	device->enable = 1;
	device->mode = POKEYS_AXIS_BUFFERED;
	device->limit_neg = 1;
	device->homing_on_switch = 3;
	device->homing_off_switch = 8;
	device->max_velocity = 10;
	values.set.pin_function[7] = 130;
}

static bool driven[POKEYS_AXES];

static void look(void)
{
	legacy_settings_look(&own, &values, driven);
}

static void what_nobody_set_shows_what_the_device_has(void **state)
{
	(void)state;
	look();
	assert_int_equal(set->enabled, -1);
	know_the_device();
	look();
	assert_int_equal(set->enabled, 1);
	assert_int_equal(set->options, 1);
	assert_int_equal(set->switches, 1);
	assert_true(set->limit_minus);
	assert_int_equal(set->homing, 0x83);
	assert_true(set->on_home[0] && set->on_home[1] && set->off_home[3]);
	assert_true(fabs(set->max_speed - 2000) < 1e-9);
	assert_int_equal(values.legacy.pin_set.function[7], 130);
	assert_true(values.legacy.pin_set.in_invert[7]);
	device->invert = 1;
	device->mode = POKEYS_AXIS_POSITION;
	look();
	assert_int_equal(set->inverted, 1);
	assert_int_equal(set->options, 1 | 2 | 4 | 8);
}

/* An INI file sets it before the device is there; whether the axis is in use, the device says. */
static void what_was_set_before_the_device_is_there_is_handed_on(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	set->max_speed = 3000;
	look();
	look();
	assert_int_equal(set->enabled, -1);
	know_the_device();
	look();
	assert_int_equal(set->enabled, 1);
	assert_true(fabs(device->max_velocity - 15) < 1e-9);
}

static void nothing_is_handed_on_without_apply(void **state)
{
	(void)state;
	set->enabled = 1;
	set->inverted = 1;
	values.legacy.pin_set.function[3] = 4;
	look();
	assert_int_equal(device->enable, -1);
	assert_int_equal(values.set.pin_function[3], -1);
	values.legacy.engine.apply = true;
	look();
	assert_int_equal(device->enable, 1);
	assert_int_equal(device->invert, 1);
	assert_int_equal(device->soft_limits, 0);
	assert_int_equal(values.set.pin_function[3], 4);
}

/* Pins, not parameters: half of the play in pulses, as the vendor's library has it. */
static void backlash_reaches_the_device_with_apply(void **state)
{
	(void)state;
	values.legacy.engine.backlash = 1;
	values.legacy.axis[2].backlash_width = 6;
	values.legacy.axis[2].backlash_acceleration = 2;
	look();
	assert_int_equal(values.set.backlash, -1);
	assert_true(isnan(device->backlash_width));
	values.legacy.engine.apply = true;
	look();
	assert_int_equal(values.set.backlash, 1);
	assert_true(fabs(device->backlash_width - 0.06) < 1e-12);
	assert_true(fabs(device->backlash_acceleration - 10000) < 1e-9);
	assert_true(isnan(values.set.axis[3].backlash_width));
	/* in pulses it stays, whatever a unit is */
	values.joint[2].scale = -100;
	look();
	assert_true(fabs(device->backlash_width - 0.12) < 1e-12);
	values.legacy.engine.backlash = 0;
	values.legacy.axis[2].backlash_width = 0;
	look();
	assert_int_equal(values.set.backlash, -1);
	assert_true(isnan(device->backlash_width));
}

static void a_group_nobody_touched_is_left_alone(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	set->enabled = 1;
	look();
	assert_int_equal(values.set.axis[3].enable, -1);
	assert_int_equal(values.set.encoder[3].sampling, -1);
	assert_int_equal(values.set.fast_configuration, -1);
	assert_int_equal(values.set.engine.generator, -1);
}

static void what_was_set_by_hand_is_not_overwritten(void **state)
{
	(void)state;
	set->inverted = 1;
	look();
	know_the_device();
	look();
	assert_int_equal(set->inverted, 1);
	assert_false(set->limit_minus);
}

static void a_joint_becomes_pulses(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	set->velocity = 25.5;
	set->acceleration = 100;
	set->minimum = -10.5;
	set->maximum = 300;
	set->home = 5;
	set->home_offset = -2;
	set->search_velocity = -5.1;
	set->latch_velocity = 1.02;
	look();
	assert_true(fabs(set->max_speed - 5100) < 1e-9);
	assert_true(fabs(set->max_acceleration - 20000) < 1e-9);
	assert_true(fabs(set->max_deceleration - 30000) < 1e-9);
	assert_int_equal(set->enabled, 1);
	assert_int_equal(set->planner, 1);
	assert_int_equal(set->offset, 310);
	assert_int_equal(set->scale, 200);
	assert_int_equal(set->zero_position, 62000);
	assert_int_equal(set->home_position, 63000);
	assert_int_equal(set->arm_position, 59900);
	assert_int_equal(set->shown_maximum, 122000);
	assert_int_equal(set->back_off, 400);
	assert_int_equal(set->homing_speed, 20);
	assert_int_equal(set->homing_return, 20);
	assert_true(fabs(device->max_velocity - 25.5) < 1e-9);
	assert_true(fabs(device->max_acceleration - 100) < 1e-9);
	assert_true(fabs(device->back_off - 2) < 1e-9);
	assert_int_equal(device->homing_speed, 20);
}

static void bits_have_the_say_over_their_byte(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	set->enabled = 1;
	set->switches = 0xff;
	look();
	assert_true(set->limit_minus && set->home_invert);
	set->switches = 0;
	look();
	assert_int_equal(set->switches, 0xff);
	set->home_invert = false;
	look();
	assert_int_equal(set->switches, 0x7f);
	assert_int_equal(device->home_switch_invert, 0);
}

static void the_last_bit_that_is_set_to_false_stays_false(void **state)
{
	struct legacy_encoder_settings *encoder = &values.legacy.encoder_set[3];

	(void)state;
	know_the_device();
	values.set.encoder[3].sampling = 1;
	look();
	assert_true(encoder->enable && set->limit_minus);
	values.legacy.engine.apply = true;
	look();
	encoder->enable = false;
	set->limit_minus = false;
	look();
	look();
	assert_false(encoder->enable || set->limit_minus);
	assert_int_equal(encoder->options, 0);
	assert_int_equal(set->switches, 0);
	assert_int_equal(values.set.encoder[3].sampling, 0);
	assert_int_equal(device->limit_neg, 0);
}

static void a_home_switch_at_a_limit_switch_is_that_switch(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	set->enabled = 1;
	set->limit_plus = set->home_switch = true;
	set->limit_plus_pin = set->home_pin = 9;
	look();
	assert_true(set->home_on_plus && !set->home_switch);
	assert_int_equal(set->switches, 0x12);
	assert_int_equal(device->home, 0);
	assert_int_equal(device->home_on_limit_pos, 1);
}

static void what_somebody_sets_in_the_canonical_scheme_stays(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	set->enabled = 1;
	look();
	device->invert = 1;
	look();
	assert_int_equal(device->invert, 1);
	set->masked = 1;
	look();
	assert_int_equal(device->invert, 0);
}

static void an_axis_that_is_driven_is_driven_by_position(void **state)
{
	(void)state;
	driven[2] = true;
	values.legacy.engine.apply = true;
	set->enabled = 1;
	look();
	driven[2] = false;
	assert_int_equal(device->mode, POKEYS_AXIS_POSITION);
	assert_int_equal(set->position_mode, 0);
}

static unsigned int refused;

static void count_refused(void *argument, const struct legacy_range_item *item, double value)
{
	(void)argument;
	(void)item;
	(void)value;
	refused++;
}

static void what_cannot_be_is_told_once_and_put_back(void **state)
{
	static struct legacy_range range;

	(void)state;
	refused = 0;
	set->limit_plus_pin = 9;
	assert_int_equal(legacy_range_init(&range, &values), 0);
	set->limit_plus_pin = 56;
	set->enabled = 2;
	set->velocity = (double)NAN;
	values.legacy.encoder[28].scale = 1e13;
	legacy_range_look(&range, &values, count_refused, NULL);
	assert_int_equal(refused, 4);
	assert_int_equal(set->limit_plus_pin, 9);
	assert_int_equal(set->enabled, -1);
	assert_true(set->velocity == 0 && values.legacy.encoder[28].scale == 1);
	set->limit_plus_pin = 55;
	legacy_range_look(&range, &values, count_refused, NULL);
	assert_int_equal(refused, 4);
	assert_int_equal(set->limit_plus_pin, 55);
}

/* Its parameter is unsigned: HAL shows -3 as 4294967293. */
static void a_wheel_may_turn_the_other_way(void **state)
{
	static struct legacy_range range;

	(void)state;
	refused = 0;
	assert_int_equal(legacy_range_init(&range, &values), 0);
	know_the_device();
	device->mpg_multiplier = -5;
	look();
	legacy_range_look(&range, &values, count_refused, NULL);
	assert_int_equal(refused, 0);
	assert_int_equal((int32_t)set->mpg_multiplier, -5);
	values.legacy.engine.apply = true;
	set->mpg_multiplier = (uint32_t)-3;
	look();
	legacy_range_look(&range, &values, count_refused, NULL);
	assert_int_equal(refused, 0);
	assert_int_equal(device->mpg_multiplier, -3);
	/* a 0 in place of it counts, as in place of any other */
	set->mpg_multiplier = 0;
	look();
	assert_int_equal(device->mpg_multiplier, 0);
	legacy_range_look(&range, &values, count_refused, NULL);
	set->mpg_multiplier = 40000;
	legacy_range_look(&range, &values, count_refused, NULL);
	assert_int_equal(refused, 1);
	assert_int_equal(set->mpg_multiplier, 0);
}

static void inversion_keeps_the_function_of_a_pin(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	values.legacy.pin_set.out_invert[7] = true;
	look();
	assert_int_equal(values.set.pin_function[7], -1);
	values.set.pin_function[7] = 4;
	look();
	assert_int_equal(values.set.pin_function[7], 132);
}

static void encoders_and_engine_are_handed_on(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	values.legacy.encoder_set[5].enable = true;
	values.legacy.encoder_set[5].x4 = true;
	values.legacy.encoder_set[5].pin_a = 3;
	values.legacy.encoder_set[5].pin_b = 4;
	values.legacy.fast_set.enable = true;
	values.legacy.fast_set.alternative = true;
	values.legacy.fast_set.invert[1] = true;
	values.legacy.engine_set.generator = 0xc1;
	values.legacy.engine_set.emergency_pin = 52;
	values.legacy.engine_set.emergency_out_pin = 17;
	values.legacy.engine_set.probe_pin = 8;
	values.info.type_id = 32;
	look();
	/* its terminals are not known yet */
	assert_int_equal(values.set.engine.generator, -1);
	memset((void *)values.set.pin_function, 0, sizeof(values.set.pin_function));
	know_the_device();
	look();
	assert_int_equal(values.set.encoder[5].sampling, 4);
	assert_int_equal(values.set.encoder[5].pin_b, 4);
	assert_int_equal(values.legacy.encoder_set[5].options, 3);
	assert_int_equal(values.set.fast_configuration, 10);
	assert_int_equal(values.set.fast_invert[1], 1);
	assert_int_equal(values.set.engine.generator, 1);
	assert_int_equal(values.set.engine.swap_step_dir, 1);
	assert_int_equal(values.set.engine.extended_io, 1);
	assert_int_equal(values.set.engine.emergency_pin, 62);
	assert_int_equal(values.set.pin_function[16], 4);
	assert_int_equal(values.set.pin_function[51], 2);
	/* an input that is inverted stays so */
	assert_int_equal(values.set.pin_function[7], 130);
}

static void all_axes_are_enabled_once_something_is_set_up(void **state)
{
	(void)state;
	values.legacy.engine.apply = true;
	values.set.engine.axes = 0;
	values.legacy.engine.axes = 8;
	look();
	assert_int_equal(values.set.engine.axes, 0); /* nobody has set anything */
	values.legacy.engine.axes = 0;
	set->enabled = 1;
	look();
	assert_int_equal(values.set.engine.axes, 0); /* the device is not known */
	values.legacy.engine.axes = 8;
	look();
	assert_int_equal(values.set.engine.axes, 8);
	values.set.engine.axes = 3;
	look();
	assert_int_equal(values.set.engine.axes, 3); /* set by its canonical name */
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(what_nobody_set_shows_what_the_device_has, setup),
		cmocka_unit_test_setup(nothing_is_handed_on_without_apply, setup),
		cmocka_unit_test_setup(backlash_reaches_the_device_with_apply, setup),
		cmocka_unit_test_setup(a_group_nobody_touched_is_left_alone, setup),
		cmocka_unit_test_setup(what_was_set_by_hand_is_not_overwritten, setup),
		cmocka_unit_test_setup(a_joint_becomes_pulses, setup),
		cmocka_unit_test_setup(bits_have_the_say_over_their_byte, setup),
		cmocka_unit_test_setup(the_last_bit_that_is_set_to_false_stays_false, setup),
		cmocka_unit_test_setup(a_home_switch_at_a_limit_switch_is_that_switch, setup),
		cmocka_unit_test_setup(what_somebody_sets_in_the_canonical_scheme_stays, setup),
		cmocka_unit_test_setup(an_axis_that_is_driven_is_driven_by_position, setup),
		cmocka_unit_test_setup(what_cannot_be_is_told_once_and_put_back, setup),
		cmocka_unit_test_setup(a_wheel_may_turn_the_other_way, setup),
		cmocka_unit_test_setup(inversion_keeps_the_function_of_a_pin, setup),
		cmocka_unit_test_setup(encoders_and_engine_are_handed_on, setup),
		cmocka_unit_test_setup(what_was_set_before_the_device_is_there_is_handed_on, setup),
		cmocka_unit_test_setup(all_axes_are_enabled_once_something_is_set_up, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
