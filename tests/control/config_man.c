// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysd.conf(5) and the table of keys say the same, word for word, and the
 * example in it is a configuration that is accepted. With --print: the list as
 * it has to stand in the man page.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/control/config.h"

static char page[100000];
static char line[512];

static void note(void *context, const char *text)
{
	(void)context;
	snprintf(line, sizeof(line), "%s", text);
}

static void the_man_page_lists_the_keys_as_the_table_has_them(void **state)
{
	char *list = NULL, *there = strstr(page, "\n# KEYS\n\n");
	size_t length = 0;
	FILE *to = open_memstream(&list, &length);

	(void)state;
	config_man(to);
	fclose(to);
	assert_non_null(there);
	there += strlen("\n# KEYS\n\n");
	assert_true(length > 1000);
	for (size_t i = 0; i < length; i++)
		if (there[i] != list[i])
			fail_msg("the man page differs at: %.60s; expected: %.60s", there + i,
				 list + i);
	assert_memory_equal(there + length, "\n# EXAMPLE\n", strlen("\n# EXAMPLE\n"));
	free(list);
}

static void the_example_is_accepted(void **state)
{
	static struct config config;
	char *begin = strstr(page, "```\n"), *end;

	(void)state;
	assert_non_null(begin);
	begin += 4;
	end = strstr(begin, "```");
	assert_non_null(end);
	if (config_parse("example", begin, (size_t)(end - begin), &config, note, NULL))
		fail_msg("%s", line);
	assert_int_equal(config.devices, 2);
}

static void the_help_names_every_key_of_the_man_page(void **state)
{
	char *help = NULL;
	size_t length = 0;
	FILE *to = open_memstream(&help, &length);
	int keys = 0;

	(void)state;
	config_help(to);
	fclose(to);
	for (char *at = strstr(page, "\n# KEYS"); (at = strstr(at, "\n*")); at++) {
		char name[64];

		snprintf(name, sizeof(name), "\n  %.*s\n", (int)strcspn(at + 2, "*"), at + 2);
		if (strncmp(name, "\n  pokeys", 9)) {
			assert_non_null(strstr(help, name));
			keys++;
		}
	}
	assert_true(keys > 50);
	free(help);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_man_page_lists_the_keys_as_the_table_has_them),
		cmocka_unit_test(the_example_is_accepted),
		cmocka_unit_test(the_help_names_every_key_of_the_man_page),
	};
	FILE *file;

	if (argc > 1 && !strcmp(argv[1], "--print")) {
		config_man(stdout);
		return 0;
	}
	file = argc > 1 ? fopen(argv[1], "r") : NULL;
	if (!file || !fread(page, 1, sizeof(page) - 1, file)) {
		fprintf(stderr, "usage: %s pokeysd.conf.5.scd | --print\n", argv[0]);
		return 1;
	}
	fclose(file);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
