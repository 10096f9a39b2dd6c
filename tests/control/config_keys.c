// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Every key of the table, at its limits and just outside them. The cases are
 * made from the table, so a new key is tested without a new test; that the
 * table says what the documentation says, config_man.c checks.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/control/config_key.h"

struct seen {
	int count;
	char line[1024]; /* the first one */
};

static void see(void *context, const char *line)
{
	struct seen *seen = context;

	if (!seen->count++)
		snprintf(seen->line, sizeof(seen->line), "%s", line);
}

/* Counts the complaints that contain a text. */
struct search {
	const char *wanted;
	int matches;
};

static void look_for(void *context, const char *line)
{
	struct search *seen = context;

	seen->matches += strstr(line, seen->wanted) != NULL;
}

/* '#' in a key's name becomes the index. */
static void name_of(const struct config_key *key, uint32_t index, char *out, size_t size)
{
	const char *hash = strchr(key->name, '#');

	if (hash)
		snprintf(out, size, "%.*s%u%s", (int)(hash - key->name), key->name, index,
			 hash + 1);
	else
		snprintf(out, size, "%s", key->name);
}

static const char *section_of(const struct config_key *key)
{
	static const char *const names[CONFIG_SECTIONS] = {
		[CONFIG_DAEMON] = "daemon",
		[CONFIG_DEVICE] = "device a",
		[CONFIG_HEATER] = "heater a",
		[CONFIG_SERVO] = "servo a",
	};

	return names[key->section];
}

/* One value of one key through the whole parser. The faults that name the key. */
static int faults_with(const struct config_key *key, uint32_t index, const char *value,
		       struct seen *seen)
{
	static struct config config;
	char name[64], text[512];
	int length;

	memset(seen, 0, sizeof(*seen));
	name_of(key, index, name, sizeof(name));
	length = snprintf(text, sizeof(text), "[%s]\n%s = %s\n", section_of(key), name, value);
	config_parse("f.conf", text, (size_t)length, &config, see, seen);
	return seen->count && strstr(seen->line, name) && !strncmp(seen->line, "f.conf:2: [", 11) &&
	       strstr(seen->line, "allowed: ");
}

/* The parser's answer for one value alone, without the rules between keys. */
static const char *stored(const struct config_key *key, uint32_t index, const char *value)
{
	static struct config_raw_daemon daemon;
	static struct config_raw_device device;
	static struct config_raw_heater heater;
	static struct config_raw_servo servo;

	if (key->section == CONFIG_HEATER)
		return config_store(key, index, value, &heater);
	if (key->section == CONFIG_SERVO)
		return config_store(key, index, value, &servo);
	if (key->section == CONFIG_DAEMON)
		return config_store(key, index, value, &daemon);
	return config_store(key, index, value, &device);
}

static bool is_number(const struct config_key *key)
{
	return (key->type == CONFIG_INTEGER || key->type == CONFIG_REAL) &&
	       key->minimum <= key->maximum;
}

static void assert_refused(const struct config_key *key, uint32_t index, const char *value)
{
	struct seen seen;

	if (!stored(key, index, value))
		fail_msg("%s = %s was taken", key->name, value);
	if (!faults_with(key, index, value, &seen))
		fail_msg("%s = %s: the complaint is \"%s\"", key->name, value, seen.line);
}

static void every_number_is_taken_at_its_limits_and_refused_outside(void **state)
{
	const struct config_key *key;
	char text[64];
	int keys = 0;

	(void)state;
	for (size_t i = 0; (key = config_key_at(i)); i++) {
		double step = key->type == CONFIG_INTEGER ? 1 : key->maximum * 1e-9;

		if (!is_number(key))
			continue;
		keys++;
		for (uint32_t n = 0; n < (key->count ? key->count : 1); n++) {
			snprintf(text, sizeof(text), "%.17g", key->minimum);
			assert_null(stored(key, n, text));
			snprintf(text, sizeof(text), "%.17g", key->maximum);
			assert_null(stored(key, n, text));
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
	const struct config_key *key;
	(void)state;
	for (size_t i = 0; (key = config_key_at(i)); i++) {

		if (!key->words)
			continue;
		for (const struct settings_word *word = key->words; word->name; word++) {
			assert_null(stored(key, 0, word->name));
			assert_true(strlen(word->name) > 0);
		}
		assert_refused(key, 0, "perhaps");
		assert_refused(key, 0, "Leave");
	}
}

static void no_key_takes_nonsense(void **state)
{
	static const char *const nonsense[] = {
		"-",   "+5",  "0x10",  "10ms",      "1e400",
		"nan", "inf", "1,5x",  "5 6",       "99999999999999999999",
		"--",  "1-",  "-1-3",  "3-1",       "1,1",
		",",   "0",   "1.2.3", "256.1.1.1", "not/a/path it is",
	};
	const struct config_key *key;

	(void)state;
	for (size_t i = 0; (key = config_key_at(i)); i++) {
		int refused = 0;

		if (key->type == CONFIG_SETTING)
			continue; /* tests/settings */
		for (size_t n = 0; n < sizeof(nonsense) / sizeof(nonsense[0]); n++)
			refused += stored(key, 0, nonsense[n]) != NULL;
		/* names may be anything without blank and slash, a number may be one of these */
		if (key->type == CONFIG_TEXT)
			assert_in_range(refused, 2, 4);
		else
			assert_in_range(refused, 16, sizeof(nonsense) / sizeof(nonsense[0]));
		assert_refused(key, 0, "\"quoted text\"");
	}
}

static void every_key_may_stand_once_only(void **state)
{
	const struct config_key *key;
	static struct config config;

	(void)state;
	for (size_t i = 0; (key = config_key_at(i)); i++) {
		const char *value = key->fallback ? key->fallback : "1";
		struct search seen = { 0 };
		char name[64], text[512], expected[128];

		name_of(key, 0, name, sizeof(name));
		snprintf(text, sizeof(text), "[%s]\n\n%s = %s\n\n%s = %s\n", section_of(key), name,
			 value, name, value);
		snprintf(expected, sizeof(expected), "%s was there before, at line 3", name);
		seen.wanted = expected;
		assert_true(config_parse("f", text, strlen(text), &config, look_for, &seen) > 0);
		assert_int_equal(seen.matches, 1);
	}
}

static void an_index_outside_names_the_range(void **state)
{
	static struct config config;
	static const char *const names[] = { "axis.8.mode",     "axis.-1.mode", "axis..mode",
					     "encoder.25.pins", "axis.00.mode", "axis.1000.mode" };

	(void)state;
	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		struct seen seen = { 0 };
		char text[128];

		snprintf(text, sizeof(text), "[device a]\naddress=10.0.0.1\n%s = 1\n", names[i]);
		assert_int_equal(config_parse("f", text, strlen(text), &config, see, &seen), 1);
		assert_non_null(strstr(seen.line, "f:3: [device a]"));
		assert_non_null(strstr(seen.line, names[i]));
	}
}

static void settings_go_through_the_whole_parser(void **state)
{
	const struct config_key *key;
	struct seen seen;
	int keys = 0;

	(void)state;
	for (size_t i = 0; (key = config_key_at(i)); i++) {
		if (key->type != CONFIG_SETTING)
			continue;
		keys++;
		assert_int_equal(config_key_number(key), i);
		for (uint32_t n = 0; n < (key->count ? key->count : 1); n++)
			if (!faults_with(key, n, "\"quoted\"", &seen))
				fail_msg("%s: the complaint is \"%s\"", key->name, seen.line);
	}
	assert_int_equal(keys, settings_key_count);
}

static void defaults_are_those_of_the_device(void **state)
{
	static const char text[] = "[device a]\naddress = 10.0.0.1\n";
	static struct config config;
	struct device_config defaults;
	struct seen seen = { 0 };
	const struct device_config *got = &config.device[0];

	(void)state;
	device_config_defaults(&defaults);
	assert_int_equal(config_parse("f", text, sizeof(text) - 1, &config, see, &seen), 0);
	assert_int_equal(got->port, defaults.port);
	assert_int_equal(got->period_ns, defaults.period_ns);
	assert_int_equal(got->heartbeat_timeout_ns, defaults.heartbeat_timeout_ns);
	assert_int_equal(got->stale_after_ns, defaults.stale_after_ns);
	assert_int_equal(got->lost_after_ns, defaults.lost_after_ns);
	assert_int_equal(got->fast_divider, defaults.fast_divider);
	assert_true(fabs(got->slow_hz - defaults.slow_hz) < 1e-9);
	assert_int_equal(got->slow_together, defaults.slow_together);
	assert_true(fabs(got->encoder_hz - defaults.encoder_hz) < 1e-9);
	assert_true(fabs(got->analog_hz - defaults.analog_hz) < 1e-9);
	/* the file's own default: the device's failsafe is armed */
	assert_int_equal(got->settings.set, defaults.settings.set | POKEYS_SET_FAILSAFE);
	assert_int_equal(got->settings.failsafe_timeout, 10);
	assert_int_equal(got->settings.failsafe_peripherals, 15);
	assert_memory_equal(got->settings.pin_set, defaults.settings.pin_set,
			    sizeof(defaults.settings.pin_set));
	for (int i = 0; i < POKEYS_AXES; i++) {
		assert_int_equal(got->settings.axis[i].set, 0);
		assert_int_equal(got->settings.axis[i].options_mask, 0);
	}
	for (int i = 0; i < 25; i++) {
		assert_int_equal(got->settings.encoder[i].options_mask, 0);
		assert_int_equal(got->settings.encoder[i].pins_set, 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_number_is_taken_at_its_limits_and_refused_outside),
		cmocka_unit_test(every_word_is_taken_and_no_other),
		cmocka_unit_test(no_key_takes_nonsense),
		cmocka_unit_test(every_key_may_stand_once_only),
		cmocka_unit_test(an_index_outside_names_the_range),
		cmocka_unit_test(settings_go_through_the_whole_parser),
		cmocka_unit_test(defaults_are_those_of_the_device),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
