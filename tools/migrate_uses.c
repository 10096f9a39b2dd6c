/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a machine uses of the names of the older component: which pins it links, which values it
 * sets, and whether there is such a name.
 */
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "halbridge/ini_apply.h"
#include "tools/migrate.h"

static const char prefix[] = "pokeys.";

/* The text after a number or a Tcl variable, which may be any number; NULL = there is neither. */
static const char *behind_number(const char *text)
{
	const char *end = text;

	if (*text == '$') {
		end += 1 + (text[1] == '{' || text[1] == '(');
		while (isalnum((unsigned char)*end) || *end == '_' || *end == ':')
			end++;
		return end + (*end == '}' || *end == ')');
	}
	while (isdigit((unsigned char)*end))
		end++;
	return end > text ? end : NULL;
}

/* N, B or M alone between dots, blanks and dashes stands for a number. */
static bool is_index(const char *patterns, const char *at)
{
	return strchr("NBM", *at) && at > patterns && strchr(".-", at[-1]) && strchr(". -*", at[1]);
}

static bool fits_one(const char *patterns, const char *pattern, const char *name)
{
	for (; *pattern && *pattern != ' '; pattern++) {
		if (*pattern == '*') {
			for (const char *rest = name;; rest++) {
				if (fits_one(patterns, pattern + 1, rest))
					return true;
				if (!*rest)
					return false;
			}
		}
		if (is_index(patterns, pattern)) {
			name = behind_number(name);
			if (!name)
				return false;
		} else if (*name == '$') {
			name = behind_number(name);
			while (isdigit((unsigned char)pattern[1]))
				pattern++;
		} else if (*name++ != *pattern) {
			return false;
		}
	}
	return !*name;
}

bool migrate_fits(const char *patterns, const char *name)
{
	for (const char *at = patterns; *at; at += strspn(at, " ")) {
		if (fits_one(patterns, at, name))
			return true;
		at += strcspn(at, " ");
	}
	return false;
}

/* The name with `number` for each variable in it. */
static void put_number(const char *name, char number, char out[TABLE_NAME_MAX + 1])
{
	size_t length = 0;

	while (*name && length < TABLE_NAME_MAX) {
		if (*name == '$') {
			out[length++] = number;
			name = behind_number(name);
		} else {
			out[length++] = *name++;
		}
	}
	out[length] = '\0';
}

static bool find_name(struct migrate_use *use, unsigned int schemes, const char *name)
{
	char full[TABLE_NAME_MAX + 1];

	for (struct table_cursor at = table_walk(schemes); table_next(&at);) {
		if (table_name(at.row, 0, at.index, full) < 0 || strcmp(full + 9, name) != 0)
			continue;
		use->row = at.row;
		use->index = at.index;
		return true;
	}
	return false;
}

/* The older names first: some of the new scheme and of earlier versions are the same. */
static void look_up(struct migrate_use *use)
{
	static const unsigned int schemes[] = { TABLE_LEGACY, TABLE_BOTH | TABLE_PONET, TABLE_LOOPS,
						TABLE_FORMER };
	char name[TABLE_NAME_MAX + 1];

	for (char number = '0'; number <= '1'; number++) {
		put_number(use->name, number, name);
		for (size_t i = 0; i < sizeof(schemes) / sizeof(schemes[0]); i++)
			if (find_name(use, schemes[i], name))
				return;
	}
}

/* A word of a line, if it is one of the component's names. */
static int take_word(struct migrate *machine, const struct migrate_line *line, size_t number,
		     enum migrate_how how, const char *other)
{
	const char *word = line->word[number], *end;
	struct migrate_use *use;
	unsigned long device;

	if (strncmp(word, prefix, sizeof(prefix) - 1) != 0)
		return 0;
	end = behind_number(word + sizeof(prefix) - 1);
	device = strtoul(word + sizeof(prefix) - 1, NULL, 10);
	if (!end || *end != '.' || device >= TABLE_DEVICES)
		return 0;
	use = reallocarray(machine->use, machine->uses + 1, sizeof(*use));
	if (!use)
		return -ENOMEM;
	machine->use = use;
	use += machine->uses++;
	*use = (struct migrate_use){
		.line = line,
		.how = how,
		.word = number,
		.name = end + 1,
		.other = other,
		.device = (unsigned int)device,
		.is_computed = strchr(word, '$') != NULL,
	};
	look_up(use);
	return 0;
}

static int take_line(struct migrate *machine, const struct migrate_line *line)
{
	char *const *word = line->word;
	int result = 0;

	if (!strcmp(word[0], "net"))
		for (size_t i = 2; !result && i < line->words; i++)
			result = take_word(machine, line, i, MIGRATE_LINKED, word[1]);
	if (line->words < 3)
		return result;
	if (!strcmp(word[0], "setp") || !strcmp(word[1], "="))
		return take_word(machine, line, strcmp(word[0], "setp") ? 0 : 1, MIGRATE_SET,
				 word[2]);
	if (!strcmp(word[0], "linkps") || !strcmp(word[0], "linksp") || !strcmp(word[0], "linkpp"))
		for (size_t i = 1; !result && i < 3; i++)
			result = take_word(machine, line, i, MIGRATE_LINKED, word[3 - i]);
	return result;
}

double migrate_value(const char *text)
{
	char *end;
	double value;

	if (ini_word(text, &value))
		return value;
	value = strtod(text, &end);
	return *end || end == text ? (double)NAN : value;
}

int migrate_find_uses(struct migrate *machine)
{
	for (size_t i = 0; i < machine->lines; i++) {
		const int result = take_line(machine, &machine->line[i]);

		if (result)
			return result;
	}
	return 0;
}

unsigned int migrate_devices(const struct migrate *machine)
{
	unsigned int most = 0;

	for (size_t i = 0; i < machine->uses; i++)
		if (machine->use[i].device > most)
			most = machine->use[i].device;
	return most + 1;
}
