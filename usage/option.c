// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * getopt takes --check for --check-config, and so a typing error for something else; and
 * of a mistake it says what is wrong, but not what to do. So here long options are looked
 * up before it sees them, and it is not to say anything.
 *
 * A word that is some option's value is taken for an option if it begins with "--": who
 * means it writes --config=--file. An empty value is none: what stands there is a
 * variable of a shell that nobody has set.
 */
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include "usage/option.h"

static bool is_long(const struct option *table, const char *name)
{
	const size_t length = strcspn(name, "=");

	while (table->name && (strncmp(table->name, name, length) || table->name[length]))
		table++;
	return table->name;
}

static bool spelled_out(const char *program, int argc, char **argv, const struct option *table)
{
	for (int i = 1; i < argc && strcmp(argv[i], "--"); i++) {
		if (strncmp(argv[i], "--", 2) || is_long(table, argv[i] + 2))
			continue;
		fprintf(stderr, "%s: there is no option %.*s; %s --help lists them\n", program,
			(int)strcspn(argv[i], "="), argv[i], program);
		return false;
	}
	return true;
}

static bool is_letter(const struct option *table, int letter)
{
	while (table->name && table->val != letter)
		table++;
	return table->name;
}

/* What getopt has found amiss in the word before this one. */
static void tell(const char *program, const char *word, int result, const struct option *table)
{
	if (result == ':')
		fprintf(stderr, "%s: %s needs a value; %s --help lists the options\n", program,
			word, program);
	else if (!strncmp(word, "--", 2) && strchr(word, '=') && is_letter(table, optopt))
		fprintf(stderr, "%s: %.*s takes no value; %s --help lists the options\n", program,
			(int)strcspn(word, "="), word, program);
	else
		fprintf(stderr, "%s: there is no option -%c; %s --help lists them\n", program,
			optopt, program);
}

/* `name` is that of a long option, or NULL. */
static void tell_empty(const char *program, int letter, const char *name)
{
	const char word[] = { '-', (char)letter, '\0' };

	fprintf(stderr, "%s: %s%s needs a value, not an empty one; %s --help lists the options\n",
		program, name ? "--" : word, name ? name : "", program);
}

int usage_option(const char *program, int argc, char **argv, const char *letters,
		 const struct option *table)
{
	int option, place = -1;

	if (optind == 1 && !spelled_out(program, argc, argv, table))
		return '?';
	opterr = 0;
	option = getopt_long(argc, argv, letters, table, &place);
	if (option == '?' || option == ':') {
		tell(program, argv[optind - 1], option, table);
		return '?';
	}
	if (option == -1 || !optarg || *optarg)
		return option;
	tell_empty(program, option, place < 0 ? NULL : table[place].name);
	return '?';
}
