/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Parameters that are the device's settings: each has its place in the wish,
 * in the protocol's units, and disturbs no other.
 */
#include "tests/halbridge/wish_rig.h"

static void every_device_setting_has_its_place(void **state)
{
	size_t named = 0;

	(void)state;
	for (struct table_cursor at = table_walk(TABLE_CANONICAL); table_next(&at);) {
		bool found = false;

		if (strncmp(at.row->help, "device setting: ", 16))
			continue;
		named++;
		for (size_t i = 0; i < wish.count; i++)
			found |= wish.item[i].name == at.row && wish.item[i].index == at.index;
		if (!found)
			fail_msg("%s, %u goes nowhere", at.row->name, at.index);
	}
	assert_true(named > 500);
}

static void every_setting_reaches_its_place_and_comes_back(void **state)
{
	(void)state;
	rig_know();
	rig_look();
	for (size_t i = 0; i < wish.count; i++) {
		struct wish_item *item = &wish.item[i];
		struct wish_context context = { .scale = 200, .pwm_hz = 25e6 };
		uint32_t generation = wish.image.generation;
		double wanted = rig_another(item), raw;

		rig_set(item, wanted);
		if (!rig_look())
			fail_msg("%s, %u is not wished", item->name->name, item->index);
		assert_int_equal(wish.image.generation, generation + 1);
		assert_true(item->row->unit->to(&context, wanted, &raw));
		assert_true(wish_is_set(item->row, &wish.image.settings, item->index, &context));
		assert_true(wish_load(item->row, &wish.image.settings, item->index, &context) ==
			    wish_round(item->row, raw));
		assert_true(rig_parameter(item) == wanted);
	}
	assert_int_equal(refusals, 0);
	/* what the daemon then reports changes nothing */
	report.device = wish.image.settings;
	wish_report(&wish, &report, &values);
	assert_false(rig_look());
}

static void settings_do_not_disturb_each_other(void **state)
{
	static struct pokeys_settings before;
	static const struct wish_context context = { .scale = 200, .pwm_hz = 25e6 };

	(void)state;
	for (size_t i = 0; i < 900; i++) {
		struct wish_item *item;

		rig_setup(NULL);
		if (i >= wish.count)
			break;
		rig_know();
		rig_look();
		item = &wish.item[i];
		before = wish.image.settings;
		rig_set(item, rig_another(item));
		rig_look();
		wish_store(item->row, &before, item->index, &context,
			   wish_load(item->row, &wish.image.settings, item->index, &context));
		wish_flag(item->row, &before, item->index, &context, true);
		assert_memory_equal(&before, &wish.image.settings, sizeof(before));
	}
}

static void a_new_scale_keeps_units_and_changes_pulses(void **state)
{
	const struct pokeys_axis_settings *axis = &wish.image.settings.axis[1];

	(void)state;
	rig_know();
	rig_look();
	values.set.axis[1].max_velocity = 50;
	values.set.axis[1].soft_min = -10;
	values.set.axis[1].soft_max = 30;
	assert_true(rig_look());
	assert_true(axis->max_speed == 10000 && axis->soft_minimum == -2000 &&
		    axis->soft_maximum == 6000);
	values.joint[1].scale = 100;
	assert_true(rig_look());
	assert_true(axis->max_speed == 5000 && axis->soft_minimum == -1000 &&
		    axis->soft_maximum == 3000);
	values.joint[1].scale = -100;
	assert_true(rig_look());
	assert_true(axis->max_speed == 5000 && axis->soft_minimum == -3000 &&
		    axis->soft_maximum == 1000);
	assert_false(rig_look());
	assert_true(values.set.axis[1].soft_min == -10 && values.set.axis[1].soft_max == 30);
}

static void an_axis_turned_round_shows_its_limits_turned_round(void **state)
{
	(void)state;
	rig_know();
	report.device.axis[0].soft_minimum = -400;
	report.device.axis[0].soft_maximum = 1000;
	wish_report(&wish, &report, &values);
	values.joint[0].scale = -200;
	rig_look();
	assert_true(values.set.axis[0].soft_min == -5 && values.set.axis[0].soft_max == 2);
}

/* The device has half of the play, in pulses, whichever way the axis is turned. */
static void play_is_halved_and_counted_in_pulses(void **state)
{
	const struct pokeys_axis_settings *axis = &wish.image.settings.axis[1];

	(void)state;
	rig_know();
	rig_look();
	values.set.axis[1].backlash_width = 0.06;
	values.set.axis[1].backlash_acceleration = 10000;
	assert_true(rig_look());
	assert_true(axis->set & POKEYS_AXIS_SET_BACKLASH_WIDTH);
	assert_int_equal(axis->backlash_half, 6);
	assert_int_equal(axis->backlash_acceleration, 2);
	values.joint[1].scale = -400;
	assert_true(rig_look());
	assert_int_equal(axis->backlash_half, 12);
	assert_int_equal(axis->backlash_acceleration, 4);
	/* what is too slow for the device's steps is not made none */
	values.set.axis[1].backlash_acceleration = 1;
	assert_true(rig_look());
	assert_int_equal(axis->backlash_acceleration, 1);
	assert_int_equal(refusals, 0);
	values.set.axis[1].backlash_width = 328;
	values.set.axis[1].backlash_acceleration = 700000;
	values.set.sync.out_pin[3] = 60;
	assert_false(rig_look());
	assert_int_equal(refusals, 3);
	assert_int_equal(axis->backlash_half, 12);
	values.set.axis[1].backlash_width = (double)NAN;
	assert_true(rig_look());
	assert_false(axis->set & POKEYS_AXIS_SET_BACKLASH_WIDTH);
}

static void bytes_are_the_protocols(void **state)
{
	const struct pokeys_settings *settings = &wish.image.settings;

	(void)state;
	rig_know();
	memset(&report.device.encoder, 0, sizeof(report.device.encoder));
	report.device.generator = 0;
	report.device.fast_options = 0;
	report.device.axis[3].homing_algorithm = 0;
	wish_report(&wish, &report, &values);
	rig_look();
	values.set.encoder[2].sampling = 4;
	values.set.encoder[3].sampling = 2;
	values.set.fast_4x = 0;
	values.set.fast_invert[2] = 1;
	values.set.engine.extended_io = 1;
	values.set.axis[3].homing_on_switch = 3;
	values.set.axis[3].homing_off_switch = 8;
	values.set.axis[3].home_switch_invert = 0;
	values.set.poextbus_crc = 1;
	values.set.failsafe.pin[54] = 0;
	values.set.axis[4].mode = 1;
	values.set.axis[5].mode = 3;
	assert_true(rig_look());
	assert_int_equal(settings->encoder[2].options & settings->encoder[2].options_mask, 3);
	assert_int_equal(settings->encoder[3].options & settings->encoder[3].options_mask, 5);
	assert_int_equal(settings->fast_options, 16 | 128);
	assert_int_equal(settings->generator, 128);
	assert_int_equal(settings->axis[3].homing_algorithm, 0x83);
	assert_int_equal(settings->axis[3].switches_mask, 128);
	assert_int_equal(settings->axis[3].switches & 128, 0);
	assert_int_equal(settings->poextbus_no_crc, 0);
	assert_int_equal(settings->axis[4].options & 12, 12);
	assert_int_equal(settings->axis[5].options & 12, 0);
	assert_int_equal(settings->axis[5].options_mask & 12, 12);
	assert_int_equal(settings->failsafe_outputs[6] & 0xc0, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(every_device_setting_has_its_place, rig_setup),
		cmocka_unit_test_setup(every_setting_reaches_its_place_and_comes_back, rig_setup),
		cmocka_unit_test_setup(settings_do_not_disturb_each_other, rig_setup),
		cmocka_unit_test_setup(a_new_scale_keeps_units_and_changes_pulses, rig_setup),
		cmocka_unit_test_setup(an_axis_turned_round_shows_its_limits_turned_round,
				       rig_setup),
		cmocka_unit_test_setup(play_is_halved_and_counted_in_pulses, rig_setup),
		cmocka_unit_test_setup(bytes_are_the_protocols, rig_setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
