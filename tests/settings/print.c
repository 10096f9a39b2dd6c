/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is printed of a device can be pasted into a file and means the same;
 * what cannot be said is not said. Random settings go out and in again.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>
#include "settings/key.h"

static const struct settings_key *find(const char *name)
{
	for (size_t i = 0; i < settings_key_count; i++)
		if (!strcmp(settings_keys[i].name, name))
			return &settings_keys[i];
	fail_msg("there is no key %s", name);
	return NULL;
}

static unsigned int seed(void)
{
	const char *text = getenv("POKEYS_SEED");
	unsigned int value = text ? (unsigned int)strtoul(text, NULL, 10) :
				    (unsigned int)time(NULL);

	printf("POKEYS_SEED=%u\n", value);
	return value;
}

static void fill_random(struct pokeys_settings *settings)
{
	unsigned char *bytes = (unsigned char *)settings;

	for (size_t i = 0; i < sizeof(*settings); i++)
		bytes[i] = (unsigned char)(rand() >> 4);
}

/* Every text that is printed is taken again, and prints as itself. */
static void what_is_printed_of_anything_goes_in_again(void **state)
{
	char text[SETTINGS_VALUE_MAX], again[SETTINGS_VALUE_MAX];
	unsigned int printed = 0;

	(void)state;
	srand(seed());
	for (int round = 0; round < 300; round++) {
		struct pokeys_settings from, to = { 0 };

		fill_random(&from);
		for (size_t i = 0; i < settings_key_count; i++) {
			const struct settings_key *key = &settings_keys[i];

			for (uint32_t n = 0; n < (key->count ? key->count : 1); n++) {
				if (!settings_print(key, n, &from, text))
					continue;
				assert_null(settings_store(key, n, text, &to));
				printed++;
				if (key->type == SETTINGS_PIN_FUNCTION ||
				    key->type == SETTINGS_PIN_FLAG)
					continue;
				assert_true(settings_print(key, n, &to, again));
				assert_string_equal(text, again);
				assert_false(settings_differ(key, n, &from, &to));
			}
		}
	}
	assert_true(printed > 10000);
}

static void what_is_not_given_is_not_printed(void **state)
{
	static const struct pokeys_settings nothing;
	char text[SETTINGS_VALUE_MAX];

	(void)state;
	for (size_t i = 0; i < settings_key_count; i++) {
		assert_false(settings_print(&settings_keys[i], 0, &nothing, text));
		assert_string_equal(text, "");
		assert_false(settings_differ(&settings_keys[i], 0, &nothing, &nothing));
	}
}

static void value_without_a_word_is_told_as_a_raw_number(void **state)
{
	struct pokeys_settings settings = { .set = POKEYS_SET_GENERATOR, .generator = 7 };
	char text[SETTINGS_VALUE_MAX];

	(void)state;
	assert_false(settings_print(find("generator"), 0, &settings, text));
	assert_string_equal(text, "7");
}

static void lists_of_pins_are_short(void **state)
{
	struct pokeys_settings settings = { 0 };
	char text[SETTINGS_VALUE_MAX];

	(void)state;
	assert_null(settings_store(find("digital-inputs"), 0, "1-6, 8, 10,11", &settings));
	assert_null(settings_store(find("inverted-pins"), 0, "2", &settings));
	assert_true(settings_print(find("digital-inputs"), 0, &settings, text));
	assert_string_equal(text, "1-6,8,10,11");
	assert_true(settings_print(find("inverted-pins"), 0, &settings, text));
	assert_string_equal(text, "2");
	assert_true(settings_print(find("digital-outputs"), 0, &settings, text));
	assert_string_equal(text, "none");
}

static void nan_and_infinity_are_no_values(void **state)
{
	struct pokeys_settings settings = { 0 };
	char text[SETTINGS_VALUE_MAX];

	(void)state;
	settings.axis[0].set = POKEYS_AXIS_SET_MAX_SPEED;
	settings.axis[0].max_speed = NAN;
	assert_false(settings_print(find("axis.#.max-speed"), 0, &settings, text));
	settings.axis[0].max_speed = INFINITY;
	assert_false(settings_print(find("axis.#.max-speed"), 0, &settings, text));
	assert_true(settings_differ(find("axis.#.max-speed"), 0, &settings, &settings));
}

static void float_that_went_through_milliseconds_does_not_differ(void **state)
{
	const struct settings_key *key = find("axis.#.max-speed");
	struct pokeys_settings wanted = { 0 }, device = { 0 };

	(void)state;
	for (int i = 1; i < 125000; i += 7) {
		wanted.axis[0].set = device.axis[0].set = POKEYS_AXIS_SET_MAX_SPEED;
		wanted.axis[0].max_speed = (float)i;
		device.axis[0].max_speed = (float)i / 1e3f * 1e3f;
		assert_false(settings_differ(key, 0, &wanted, &device));
		device.axis[0].max_speed = (float)i * 1.0001f;
		assert_true(settings_differ(key, 0, &wanted, &device));
	}
}

static void functions_of_pins_have_words(void **state)
{
	char text[SETTINGS_VALUE_MAX];

	(void)state;
	assert_string_equal(settings_pin_text(0x04, text), "digital output");
	assert_string_equal(settings_pin_text(0x82, text), "digital input, inverted");
	assert_string_equal(settings_pin_text(0x7f, text), "function 0x7f");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_printed_of_anything_goes_in_again),
		cmocka_unit_test(what_is_not_given_is_not_printed),
		cmocka_unit_test(value_without_a_word_is_told_as_a_raw_number),
		cmocka_unit_test(lists_of_pins_are_short),
		cmocka_unit_test(nan_and_infinity_are_no_values),
		cmocka_unit_test(float_that_went_through_milliseconds_does_not_differ),
		cmocka_unit_test(functions_of_pins_have_words),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
