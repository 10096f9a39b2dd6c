/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The part of pokeysd.conf that is made of a device's settings, whatever these are: the daemon
 * accepts it, and wants nothing of the device that it has not.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/control/config.h"
#include "settings/key.h"
#include "sim/prng.h"
#include "tools/config_draft.h"

enum {
	ENCODER_ON = 1,
	ENCODER_1X = 0,
	FUNCTION_ANALOG = 8,
	FUNCTION_OUTPUT = 4,
	FUNCTION_INVERTED = 0x80,
	SOFT_LIMITS = 32,
	POSITION = 13
};

static struct pokeys_settings device;
static struct config config;
static char *text;
static char said[8000];

static int begin(void **state)
{
	(void)state;
	memset(&device, 0, sizeof(device));
	device.set = UINT32_MAX & ~(unsigned int)POKEYS_SET_THREADING;
	memset(device.pin_set, 0xff, sizeof(device.pin_set));
	for (size_t i = 0; i < 25; i++)
		device.encoder[i].options_mask = device.encoder[i].pins_set = UINT8_MAX;
	for (size_t i = 0; i < POKEYS_AXES; i++) {
		device.axis[i].set = UINT32_MAX;
		device.axis[i].options_mask = device.axis[i].switches_mask = UINT8_MAX;
		device.axis[i].options = POSITION;
		device.axis[i].max_speed = 25000;
		device.axis[i].max_acceleration = device.axis[i].max_deceleration = 100000;
	}
	return 0;
}

static int end(void **state)
{
	(void)state;
	free(text);
	text = NULL;
	return 0;
}

static void complain_here(void *context, const char *line)
{
	const size_t at = strlen(said);

	(void)context;
	snprintf(said + at, sizeof(said) - at, "%s\n", line);
}

/* As the daemon takes it. */
static void draft(void)
{
	size_t length = 0;
	FILE *to;

	end(NULL);
	to = open_memstream(&text, &length);
	assert_non_null(to);
	fputs("[device mill]\naddress = 127.0.0.1\n", to);
	assert_int_equal(config_draft_settings(&device, to), 0);
	assert_int_equal(fclose(to), 0);
	said[0] = '\0';
	if (config_parse("draft", text, length, &config, complain_here, NULL))
		fail_msg("%s\n%s", said, text);
}

static void assert_changes_nothing(void)
{
	const struct pokeys_settings *wanted = &config.device[0].settings;

	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];

		for (uint32_t n = 0; n < (key->count ? key->count : 1); n++)
			if (strncmp(key->name, "failsafe", 8) != 0 &&
			    settings_differ(key, n, wanted, &device))
				fail_msg("%s (%u)\n%s", key->name, n, text);
	}
	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++)
		if (wanted->pin_set[pin / 8] >> pin % 8 & 1)
			assert_int_equal(wanted->pin_function[pin], device.pin_function[pin]);
}

static void assert_line(const char *line)
{
	char whole[200];

	snprintf(whole, sizeof(whole), "\n%s\n", line);
	if (!strstr(text, whole))
		fail_msg("no line \"%s\" in:\n%s", line, text);
}

static void an_encoder_that_counts_each_line_once_goes_on_so(void **state)
{
	(void)state;
	device.encoder[3].options = ENCODER_ON;
	device.encoder[3].pin_a = 4;
	device.encoder[3].pin_b = 5;
	draft();
	assert_line("encoder.3.sampling = 1");
	assert_changes_nothing();
}

static void a_soft_limit_may_be_zero(void **state)
{
	(void)state;
	device.axes = 1;
	device.axis[0].options |= SOFT_LIMITS;
	device.axis[0].soft_maximum = 60000;
	draft();
	assert_line("axis.0.soft-limits = on");
	assert_line("axis.0.soft-minimum = 0");
	assert_changes_nothing();
	/* this the daemon refuses, and it is in the device */
	device.axis[0].soft_minimum = 60000;
	draft();
	assert_changes_nothing();
}

static void what_a_feature_has_left_behind_does_no_harm(void **state)
{
	(void)state;
	device.axes = 2;
	device.axis[1].backlash_half = 12;
	device.axis[1].postep_address = 33;
	draft();
	assert_line("axis.1.backlash-width = 24");
	assert_line("backlash = off");
	assert_line("; axis.1.postep-address = 33");
	assert_changes_nothing();
}

static void a_deceleration_without_a_word_is_not_replaced(void **state)
{
	(void)state;
	device.axes = 1;
	device.axis[0].max_deceleration = 0;
	draft();
	assert_changes_nothing();
}

static void a_terminal_inverted_besides_another_function_is_told_of(void **state)
{
	(void)state;
	device.pin_function[44] = FUNCTION_ANALOG | FUNCTION_INVERTED;
	device.pin_function[10] = FUNCTION_OUTPUT | FUNCTION_INVERTED;
	draft();
	assert_line("inverted-pins = 11");
	assert_non_null(strstr(text, "; terminal 45: "));
	assert_changes_nothing();
}

/* The comment is at the line that the reason names, also if there are several. */
static void a_reason_is_at_its_own_line(void **state)
{
	char wanted[300];

	(void)state;
	device.axes = 4;
	for (int i = 0; i < 4; i++)
		device.axis[i].pin_enable = 7;
	draft();
	for (int i = 1; i < 4; i++) {
		snprintf(wanted, sizeof(wanted),
			 "\n# pokeysd rejects this line: "
			 "axis.%d.enable-pin: terminal 7 is used by axis.0.enable-pin as well, and "
			 "can only be used by one of them; remove the other\n"
			 "; axis.%d.enable-pin = 7\n",
			 i, i);
		if (!strstr(text, wanted))
			fail_msg("no %s in:\n%s", wanted, text);
	}
	assert_line("axis.0.enable-pin = 7");
	assert_changes_nothing();
}

static void a_failsafe_that_is_off_is_left_to_pokeysd(void **state)
{
	(void)state;
	device.failsafe_peripherals = 1;
	draft();
	assert_line("; failsafe-timeout-ms = off");
	device.failsafe_timeout = 5;
	draft();
	assert_line("failsafe-timeout-ms = 500");
}

static void a_name_with_a_blank_at_its_end_stays(void **state)
{
	(void)state;
	strcpy((char *)device.name, "Mill ");
	draft();
	assert_changes_nothing();
}

static void fill(struct sim_prng *random, unsigned int one_of)
{
	unsigned char *bytes = (unsigned char *)&device;

	for (size_t i = 0; i < sizeof(device); i++)
		if (sim_prng_next(random) % one_of == 0)
			bytes[i] = (unsigned char)sim_prng_next(random);
	device.set |= UINT32_MAX & ~(unsigned int)POKEYS_SET_THREADING;
	memset(device.pin_set, 0xff, sizeof(device.pin_set));
}

/* From a device in order to one that has lost its mind. */
static void any_device_is_left_as_it_is(void **state)
{
	static const unsigned int densities[] = { 300, 100, 30, 5, 1 };
	struct sim_prng random;

	(void)state;
	sim_prng_init(&random, 7);
	for (int i = 0; i < 100; i++) {
		begin(NULL);
		fill(&random, densities[i % 5]);
		draft();
		assert_changes_nothing();
	}
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, begin, end)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(an_encoder_that_counts_each_line_once_goes_on_so),
		TEST(a_soft_limit_may_be_zero),
		TEST(what_a_feature_has_left_behind_does_no_harm),
		TEST(a_deceleration_without_a_word_is_not_replaced),
		TEST(a_terminal_inverted_besides_another_function_is_told_of),
		TEST(a_reason_is_at_its_own_line),
		TEST(a_failsafe_that_is_off_is_left_to_pokeysd),
		TEST(a_name_with_a_blank_at_its_end_stays),
		TEST(any_device_is_left_as_it_is),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
