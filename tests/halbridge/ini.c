/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A machine's INI file: what its users write, and what they should not.
 */
#include "tests/halbridge/rig.h"
#include <errno.h>
#include <stdio.h>
#include <unistd.h>
#include "halbridge/binding.h"
#include "halbridge/ini_apply.h"

static char path[] = "/tmp/pokeys-ini-XXXXXX";
static struct ini_file file;
static struct instance instance;
static struct values values;
static uint64_t storage[BINDING_PINS];
static void *pointers[BINDING_PINS];
static char said[4096];
static unsigned int lines;

static int setup(void **state)
{
	(void)state;
	snprintf(path, sizeof(path), "/tmp/pokeys-ini-XXXXXX");
	memset(&values, 0, sizeof(values));
	memset(&instance, 0, sizeof(instance));
	memset(storage, 0, sizeof(storage));
	table_set_parameters(&values);
	for (size_t i = 0; i < BINDING_PINS; i++)
		pointers[i] = &storage[i];
	instance.values = &values;
	instance.pointers = pointers;
	instance.schemes = TABLE_BOTH;
	said[0] = '\0';
	lines = 0;
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	ini_file_free(&file);
	unlink(path);
	return 0;
}

static void read_text(const char *text)
{
	int descriptor = mkstemp(path);

	assert_true(descriptor >= 0);
	assert_int_equal(write(descriptor, text, strlen(text)), strlen(text));
	close(descriptor);
	assert_int_equal(ini_file_read(&file, path), 0);
}

static void complain(void *argument, const char *line)
{
	size_t at = strlen(said);

	(void)argument;
	snprintf(said + at, sizeof(said) - at, "%s\n", line);
	lines++;
}

static unsigned int apply(const char *text)
{
	read_text(text);
	return ini_apply(&file, &instance, complain, NULL);
}

static void lines_are_read_as_people_write_them(void **state)
{
	(void)state;
	read_text("junk before any section\n[POKEYS]\r\nA=1\r\n  B = 2\n\tC =3 # three\nD = 4 ; "
		  "four\n"
		  "no key at all\n# D = 5\n; D = 6\nG = # nothing\n[OTHER]\nA = 9\n[POKEYS]\n"
		  "A = 5\nE=\n[pokeys]\nF = 1\n[JOINT_2]\n"
		  "HOME = -1\n[POKEYS]\nlast = 6");
	assert_string_equal(ini_file_find(&file, "POKEYS", "A")->value, "1");
	assert_string_equal(ini_file_find(&file, "POKEYS", "b")->value, "2");
	assert_int_equal(ini_file_find(&file, "POKEYS", "B")->line, 4);
	assert_string_equal(ini_file_find(&file, "POKEYS", "C")->value, "3");
	assert_string_equal(ini_file_find(&file, "POKEYS", "D")->value, "4");
	assert_string_equal(ini_file_find(&file, "POKEYS", "D")->value, "4");
	assert_string_equal(ini_file_find(&file, "POKEYS", "E")->value, "");
	assert_string_equal(ini_file_find(&file, "POKEYS", "G")->value, "");
	assert_string_equal(ini_file_find(&file, "POKEYS", "LAST")->value, "6");
	assert_string_equal(ini_file_find(&file, "JOINT_2", "HOME")->value, "-1");
	assert_null(ini_file_find(&file, "POKEYS", "F"));
	assert_null(ini_file_find(&file, "OTHER", "A"));
}

static void long_lines_are_one_line(void **state)
{
	char text[4000];

	(void)state;
	memset(text, 'x', sizeof(text));
	memcpy(text, "[POKEYS]\nA = ", 13);
	memcpy(text + 3000, "\nB = 1\n", 8);
	read_text(text);
	assert_int_equal(ini_file_find(&file, "POKEYS", "B")->line, 3);
	assert_true(strlen(ini_file_find(&file, "POKEYS", "A")->value) < INI_FILE_VALUE);
}

static void a_file_that_is_not_there_is_an_error(void **state)
{
	(void)state;
	assert_int_equal(ini_file_read(&file, "/nonexistent/machine.ini"), -ENOENT);
	assert_null(ini_file_find(&file, "POKEYS", "A"));
}

static void every_key_reaches_its_parameter(void **state)
{
	unsigned int found = 0;

	(void)state;
	for (size_t i = 0; i < ini_pokeys_key_count + ini_joint_key_count; i++) {
		const struct ini_key *key = i < ini_pokeys_key_count ?
						    &ini_pokeys_keys[i] :
						    &ini_joint_keys[i - ini_pokeys_key_count];
		bool exists = false;

		for (struct table_cursor at = table_walk(TABLE_LEGACY); table_next_row(&at);)
			exists |= !strcmp(at.row->name, key->name);
		if (!exists)
			fail_msg("%s sets %s, which is no name", key->key, key->name);
		assert_true(key->low < key->high);
		found++;
	}
	assert_true(found > 90);
}

static void values_go_where_they_belong(void **state)
{
	(void)state;
	assert_int_equal(apply("[POKEYS]\nPin_54_Function = 68\nadcout_5_OFFSET = -2.5\n"
			       "encoder.3.scale = 1e-3\nencoder.25.scale = 4\n"
			       "PEv2_EmergencyInput_invert = 0\nPEv2_EmergencyInputPolarity = 1\n"
			       "PEv2_FilterProbeInput_1 = 3\nPEv2_FilterProbeSwitch_1 = 4\n"
			       "PEv2_EnableHome_7 = yes\nPEv2_linked_joint_6 = 3\n"
			       "[JOINT_3]\nSTEP_SCALE = -400.25\n[JOINT_6]\nSTEP_SCALE = 7\n"),
			 0);
	assert_int_equal(values.legacy.pin_set.function[54], 68);
	assert_true(values.legacy.adcout[5].offset == -2.5);
	assert_true(values.legacy.encoder[3].scale == 1e-3);
	assert_true(values.encoder[25].scale == 4 && values.legacy.encoder[25].scale == 4);
	assert_int_equal(values.legacy.engine_set.emergency_invert, 1);
	assert_int_equal(values.legacy.axis_set[1].probe_filter, 4);
	assert_true(values.legacy.axis_set[7].home_switch);
	assert_true(values.joint[6].scale == -400.25);
}

/* A wheel that turns the other way, limits either side of 0: the parameters are unsigned. */
static void numbers_below_zero_are_taken_where_the_device_has_them(void **state)
{
	(void)state;
	assert_int_equal(apply("[POKEYS]\nPEv2_MPGjogMultiplier_1 = -3\n"
			       "PEv2_SoftLimitMinimum_1 = -2147483648\n"
			       "PEv2_SoftLimitMaximum_1 = -10\nPEv2_HomeBackOffDistance_1 = -20\n"
			       "PEv2_SoftLimitMinimum_2 = 4294967286\n"),
			 0);
	assert_int_equal((int32_t)values.legacy.axis_set[1].mpg_multiplier, -3);
	assert_int_equal((int32_t)values.legacy.axis_set[1].soft_minimum, INT32_MIN);
	assert_int_equal((int32_t)values.legacy.axis_set[1].soft_maximum, -10);
	assert_int_equal((int32_t)values.legacy.axis_set[1].back_off, -20);
	assert_int_equal((int32_t)values.legacy.axis_set[2].soft_minimum, -10);
	teardown(NULL);
	setup(NULL);
	assert_int_equal(apply("[POKEYS]\nPEv2_MPGjogMultiplier_1 = -32769\n"
			       "PEv2_SoftLimitMinimum_1 = -2147483649\n"
			       "PEv2_MPGjogDivider_1 = -1\n"),
			 3);
	assert_non_null(strstr(said, "must be a whole number from -32768 to 32767"));
	assert_int_equal(values.legacy.axis_set[1].mpg_multiplier, 0);
	assert_int_equal(values.legacy.axis_set[1].mpg_divider, 0);
}

static void a_key_may_set_a_pin(void **state)
{
	size_t pin = 0;

	(void)state;
	apply("[POKEYS]\nApplyIniSettings = 1\nAdcOut_2_enable = 1\n");
	for (struct table_cursor at = table_walk(TABLE_BOTH); table_next(&at);) {
		bool ours = !strcmp(at.row->name, "PEv2.params.ApplyIniSettings") ||
			    (!strcmp(at.row->name, "adcout.%u.enable") && at.index == 2);

		if (at.row->kind == TABLE_PIN)
			assert_int_equal(storage[pin++] != 0, ours);
	}
}

static void bad_values_leave_what_was(void **state)
{
	static const char *const bad[] = {
		"Pin_0_Function = 256",   "Pin_0_Function = -1",  "Pin_0_Function = 1.5",
		"Pin_0_Function =",       "Pin_0_Function = 4x",  "Pin_0_Function = nan",
		"Pin_0_Function = 1e999", "Pin_0_Function = yes",
	};
	char text[64], expected[64];

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		setup(NULL);
		values.legacy.pin_set.function[0] = 4;
		snprintf(text, sizeof(text), "\n[POKEYS]\n%s\n", bad[i]);
		assert_int_equal(apply(text), 1);
		assert_int_equal(lines, 1);
		snprintf(expected, sizeof(expected), "%s:3: [POKEYS]Pin_0_Function", path);
		assert_non_null(strstr(said, expected));
		assert_non_null(strstr(said, "must be a whole number from 0 to 255"));
		assert_int_equal(values.legacy.pin_set.function[0], 4);
		teardown(NULL);
	}
}

static void large_limits_are_told_with_all_digits(void **state)
{
	(void)state;
	assert_int_equal(apply("[POKEYS]\nAdcIn_1_scale = nan\n"), 1);
	assert_non_null(strstr(said, "must be a number from -1000000000 to 1000000000;"));
}

static void indices_that_do_not_exist_are_passed_over(void **state)
{
	(void)state;
	assert_int_equal(apply("[POKEYS]\nPin_55_Function = 4\nPEv2_AxisEnabled_8 = 1\n"
			       "PEv2_linked_joint_0 = 15\nencoder.29.scale = 2\n"),
			 0);
	assert_int_equal(lines, 0);
}

static void keys_that_nobody_reads_are_found(void **state)
{
	char list[200];

	(void)state;
	assert_int_equal(apply("[POKEYS]\nDEVICE_ID=5\ndevice_id_1 = 6\nCOMM_TIMEOUT=1\n"
			       "PIN_3_function = 4\nPin_55_Function = 4\nPin__Function = 4\n"
			       "PEv2_linked_joint_7 = 1\nencoder.24.macro_dirA = 1\n"
			       "adcout_0_max_v = 5\nPEv2_AxisEnabeld_0 = 1\nPin_3_Functions = 4\n"
			       "[JOINT_1]\nP = 1\n"),
			 0);
	assert_int_equal(ini_unknown(&file, &instance, list, sizeof(list)), 4);
	assert_string_equal(list, "Pin_55_Function (line 6), Pin__Function (line 7), "
				  "PEv2_AxisEnabeld_0 (line 11), Pin_3_Functions (line 12)");
	assert_int_equal(ini_unknown(&file, &instance, list, 60), 4);
	assert_string_equal(list, "Pin_55_Function (line 6), Pin__Function (line 7), ...");
	assert_int_equal(ini_unknown(&file, &instance, list, 10), 4);
	assert_string_equal(list, "...");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(lines_are_read_as_people_write_them, setup,
						teardown),
		cmocka_unit_test_setup_teardown(long_lines_are_one_line, setup, teardown),
		cmocka_unit_test_setup_teardown(a_file_that_is_not_there_is_an_error, setup,
						teardown),
		cmocka_unit_test_setup_teardown(every_key_reaches_its_parameter, setup, teardown),
		cmocka_unit_test_setup_teardown(values_go_where_they_belong, setup, teardown),
		cmocka_unit_test_setup_teardown(
			numbers_below_zero_are_taken_where_the_device_has_them, setup, teardown),
		cmocka_unit_test_setup_teardown(a_key_may_set_a_pin, setup, teardown),
		cmocka_unit_test_setup_teardown(bad_values_leave_what_was, setup, teardown),
		cmocka_unit_test_setup_teardown(large_limits_are_told_with_all_digits, setup,
						teardown),
		cmocka_unit_test_setup_teardown(indices_that_do_not_exist_are_passed_over, setup,
						teardown),
		cmocka_unit_test_setup_teardown(keys_that_nobody_reads_are_found, setup, teardown),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
