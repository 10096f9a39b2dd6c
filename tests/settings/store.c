/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every key of the table at its limits and just outside them, and nonsense:
 * taken whole, or refused and nothing touched. The cases are made from the
 * table, so a new key is tested without a new test.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "settings/key.h"

static uint32_t indices(const struct settings_key *key)
{
	return key->count ? key->count : 1;
}

static const struct settings_key *find(const char *name)
{
	for (size_t i = 0; i < settings_key_count; i++)
		if (!strcmp(settings_keys[i].name, name))
			return &settings_keys[i];
	fail_msg("there is no key %s", name);
	return NULL;
}

static void assert_taken(const struct settings_key *key, uint32_t index, const char *text)
{
	struct pokeys_settings settings = { 0 };
	const char *wrong = settings_store(key, index, text, &settings);

	if (wrong)
		fail_msg("%s[%u] = %s: %s", key->name, index, text, wrong);
	assert_true(settings_given(key, index, &settings));
}

static void assert_refused(const struct settings_key *key, uint32_t index, const char *text)
{
	struct pokeys_settings settings, before;

	memset(&settings, 0x5a, sizeof(settings));
	before = settings;
	if (!settings_store(key, index, text, &settings))
		fail_msg("%s[%u] = %s was taken", key->name, index, text);
	assert_memory_equal(&settings, &before, sizeof(settings));
}

static void numbers_are_taken_at_their_limits_and_refused_outside(void **state)
{
	char text[64];
	int keys = 0;

	(void)state;
	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];
		double step = key->type == SETTINGS_REAL ? key->maximum * 1e-9 :
			      key->scale > 0             ? key->scale :
							   1;

		if ((key->type != SETTINGS_NUMBER && key->type != SETTINGS_REAL) ||
		    key->maximum < key->minimum)
			continue;
		keys++;
		for (uint32_t n = 0; n < indices(key); n++) {
			snprintf(text, sizeof(text), "%.17g", key->minimum);
			assert_taken(key, n, text);
			snprintf(text, sizeof(text), "%.17g", key->maximum);
			assert_taken(key, n, text);
			snprintf(text, sizeof(text), "%.17g", key->minimum - step);
			assert_refused(key, n, text);
			snprintf(text, sizeof(text), "%.17g", key->maximum + step);
			assert_refused(key, n, text);
		}
	}
	assert_true(keys > 20);
}

static void every_word_is_taken_and_no_other(void **state)
{
	(void)state;
	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];

		for (const struct settings_word *word = key->words; word && word->name; word++)
			for (uint32_t n = 0; n < indices(key); n++)
				assert_taken(key, n, word->name);
		if (key->type != SETTINGS_TEXT) {
			assert_refused(key, 0, "perhaps");
			assert_refused(key, 0, "Leave");
		}
	}
}

static void leave_stores_nothing(void **state)
{
	static const struct pokeys_settings nothing;

	(void)state;
	for (size_t i = 0; i < settings_key_count; i++) {
		struct pokeys_settings settings = { 0 };

		assert_null(settings_store(&settings_keys[i], 0, "leave", &settings));
		assert_memory_equal(&settings, &nothing, sizeof(settings));
	}
}

static void no_key_takes_nonsense(void **state)
{
	static const char *const nonsense[] = {
		"",      "-",   "+5",   "0x10", "10ms",       "1e400",
		"nan",   "inf", "1,5x", "5 6",  "1e",         "99999999999999999999",
		"--",    "1-",  "-1-3", "3-1",  "1,1,x",      ",",
		"1.2.3", "56",  "0-3",  "1-56", "\"quoted\"", "256,",
	};

	(void)state;
	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];
		bool number = key->type == SETTINGS_NUMBER || key->type == SETTINGS_REAL;

		for (size_t n = 0; n < sizeof(nonsense) / sizeof(nonsense[0]); n++) {
			if (key->type == SETTINGS_TEXT && n && n != 22)
				continue;
			if (!strcmp(nonsense[n], "56") && (number || key->type == SETTINGS_BYTES))
				continue;
			assert_refused(key, 0, nonsense[n]);
		}
	}
}

static void a_key_touches_only_its_own_bits(void **state)
{
	struct pokeys_settings settings = { 0 };

	(void)state;
	assert_null(settings_store(find("axis.#.invert"), 2, "on", &settings));
	assert_null(settings_store(find("axis.#.soft-limits"), 2, "off", &settings));
	assert_int_equal(settings.axis[2].options, 2);
	assert_int_equal(settings.axis[2].options_mask, 2 | 32);
	assert_null(settings_store(find("generator"), 0, "internal", &settings));
	assert_null(settings_store(find("generator-swap"), 0, "on", &settings));
	assert_int_equal(settings.generator, 0x41);
	assert_int_equal(settings.set, POKEYS_SET_GENERATOR);
	assert_null(settings_store(find("encoder.#.sampling"), 24, "2", &settings));
	assert_int_equal(settings.encoder[24].options, 4);
	assert_int_equal(settings.encoder[24].options_mask, 6);
	assert_null(settings_store(find("encoder.#.pins"), 24, "11, 13", &settings));
	assert_int_equal(settings.encoder[24].pin_a, 10);
	assert_int_equal(settings.encoder[24].pin_b, 12);
}

static void values_are_those_of_the_wire(void **state)
{
	struct pokeys_settings settings = { 0 };

	(void)state;
	settings_store(find("emergency-pin"), 0, "52", &settings);
	assert_int_equal(settings.emergency_pin, 62);
	settings_store(find("charge-pump"), 0, "default", &settings);
	assert_int_equal(settings.charge_pump, 1);
	settings_store(find("failsafe-timeout-ms"), 0, "1500", &settings);
	assert_int_equal(settings.failsafe_timeout, 15);
	settings_store(find("axis.#.mpg-encoder"), 0, "0", &settings);
	assert_int_equal(settings.axis[0].mpg_encoder, 1);
	settings_store(find("axis.#.soft-minimum"), 7, "-2147483648", &settings);
	assert_int_equal(settings.axis[7].soft_minimum, INT32_MIN);
	settings_store(find("counter-inputs"), 0, "5", &settings);
	assert_int_equal(settings.pin_function[4], 0x42);
	settings_store(find("failsafe-on"), 0, "1,9", &settings);
	assert_int_equal(settings.failsafe_outputs[0], 1);
	assert_int_equal(settings.failsafe_outputs[1], 1);
	settings_store(find("matrix-rows"), 0, "5,3-4", &settings);
	assert_int_equal(settings.matrix_rows, 3);
	assert_memory_equal(settings.matrix_row_pin, ((uint8_t[]){ 4, 2, 3, 0 }), 4);
	settings_store(find("device-name"), 0, "mill of 20 character", &settings);
	assert_string_equal(settings.name, "mill of 20 character");
	assert_non_null(settings_store(find("device-name"), 0, "mill of 21 characters", &settings));
	assert_non_null(settings_store(find("failsafe-timeout-ms"), 0, "1550", &settings));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(numbers_are_taken_at_their_limits_and_refused_outside),
		cmocka_unit_test(every_word_is_taken_and_no_other),
		cmocka_unit_test(leave_stores_nothing),
		cmocka_unit_test(no_key_takes_nonsense),
		cmocka_unit_test(a_key_touches_only_its_own_bits),
		cmocka_unit_test(values_are_those_of_the_wire),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
