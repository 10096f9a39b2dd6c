// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What pokeysctl config prints: a section that the daemon's file takes, one
 * line for each difference, and for whatever a report may hold no crash, no
 * control character and no value that the device has not.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>
#include "settings/key.h"
#include "tools/config_print.h"

static char out[1 << 16];

static FILE *begin(void)
{
	memset(out, 0, sizeof(out));
	return fmemopen(out, sizeof(out), "w");
}

static void set(struct pokeys_settings *settings, const char *name, uint32_t index,
		const char *text)
{
	for (size_t i = 0; i < settings_key_count; i++)
		if (!strcmp(settings_keys[i].name, name)) {
			assert_null(settings_store(&settings_keys[i], index, text, settings));
			return;
		}
	fail_msg("there is no key %s", name);
}

static void pins_known(struct pokeys_settings *settings)
{
	memset(settings->pin_set, 0xff, sizeof(settings->pin_set));
}

static void show_is_a_section_of_the_file(void **state)
{
	struct pokeys_report report = { .state = POKEYS_CONFIG_APPLIED };
	FILE *to = begin();

	(void)state;
	pins_known(&report.device);
	set(&report.device, "digital-inputs", 0, "1-6,8");
	set(&report.device, "axes", 0, "3");
	set(&report.device, "axis.#.max-speed", 2, "25000");
	set(&report.device, "device-name", 0, "mill");
	report.device.pin_function[9] = 0x61;
	report.device.set |= POKEYS_SET_GENERATOR;
	report.device.generator = 9;
	config_print_show("mill", 65432, &report, to);
	fclose(to);
	assert_string_equal(out, "[device mill]\n"
				 "serial = 65432\n"
				 "digital-inputs = 1-6,8\n"
				 "axes = 3\n"
				 "; generator: the device has 9, for which there is no word\n"
				 "generator-swap = off\n"
				 "generator-extended-io = off\n"
				 "axis.2.max-speed = 25000\n"
				 "device-name = mill\n"
				 "; terminal 10: function 0x61, for which there is no key\n");
}

static void difference_is_one_line_with_both_values(void **state)
{
	struct pokeys_report report = { .state = POKEYS_CONFIG_WAITING };
	FILE *to = begin();

	(void)state;
	pins_known(&report.device);
	set(&report.wanted, "digital-outputs", 0, "31,32");
	set(&report.wanted, "inverted-pins", 0, "32");
	set(&report.device, "digital-outputs", 0, "31,32");
	set(&report.wanted, "axis.#.max-speed", 0, "40000");
	set(&report.device, "axis.#.max-speed", 0, "25000");
	set(&report.wanted, "axis.#.invert", 0, "on");
	set(&report.device, "axis.#.invert", 0, "on");
	set(&report.device, "axis.#.soft-limits", 0, "on");
	assert_int_equal(config_print_diff(&report, to), 2);
	fclose(to);
	assert_string_equal(out, "terminal 32: digital output, inverted is wanted, the device has "
				 "digital output\n"
				 "axis.0.max-speed: 40000 is wanted, the device has 25000\n");
}

static void nothing_wanted_differs_in_nothing(void **state)
{
	struct pokeys_report report = { 0 };
	FILE *to = begin();

	(void)state;
	pins_known(&report.device);
	assert_int_equal(config_print_diff(&report, to), 0);
	fclose(to);
	assert_string_equal(out, "");
}

static void what_the_device_does_not_have_is_no_difference_once_all_is_applied(void **state)
{
	struct pokeys_report report = { .state = POKEYS_CONFIG_APPLYING };
	FILE *to = begin();

	(void)state;
	set(&report.wanted, "failsafe-timeout-ms", 0, "1000");
	assert_true(config_print_diff(&report, to) > 0);
	report.state = POKEYS_CONFIG_APPLIED;
	assert_int_equal(config_print_diff(&report, to), 0);
	fclose(to);
}

static void anything_is_printed_safely(void **state)
{
	const char *text = getenv("POKEYS_SEED");
	unsigned int seed = text ? (unsigned int)strtoul(text, NULL, 10) : (unsigned int)time(NULL);
	struct pokeys_report report;
	unsigned char *bytes = (unsigned char *)&report;

	(void)state;
	printf("POKEYS_SEED=%u\n", seed);
	srand(seed);
	for (int round = 0; round < 100; round++) {
		FILE *to = begin();

		for (size_t i = 0; i < sizeof(report); i++)
			bytes[i] = (unsigned char)(rand() >> 4);
		config_print_show("mill", 0, &report, to);
		config_print_show_json("mill", &report, to);
		config_print_diff(&report, to);
		config_print_diff_json("mill", &report, to);
		fclose(to);
		for (const char *c = out; *c; c++)
			assert_true(*c == '\n' || (*c >= ' ' && *c <= '~'));
		assert_true(strlen(out) < sizeof(out) - 1);
	}
}

static void every_state_has_a_name(void **state)
{
	(void)state;
	assert_string_equal(config_print_state(POKEYS_CONFIG_APPLIED), "applied");
	assert_string_equal(config_print_state(200), "?");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(show_is_a_section_of_the_file),
		cmocka_unit_test(difference_is_one_line_with_both_values),
		cmocka_unit_test(nothing_wanted_differs_in_nothing),
		cmocka_unit_test(
			what_the_device_does_not_have_is_no_difference_once_all_is_applied),
		cmocka_unit_test(anything_is_printed_safely),
		cmocka_unit_test(every_state_has_a_name),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
