/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The table in print, so that whatever has to agree with it can be made from
 * it or held against it: the test of the live HAL, and the man page.
 *
 *	list-names names SCHEMES	every name of pokeys.0: NAME KIND TYPE DIRECTION
 *	list-names man SCHEMES		rows as pokeys_shm(9) has them (scdoc)
 *
 * SCHEMES is canonical, core, legacy, both, ponet (what names=all adds), former (what
 * ini= adds) or all.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "halbridge/table.h"

static const char *kind_name(const struct table_row *row)
{
	return row->kind == TABLE_PIN ? "pin" : "param";
}

static int list_names(unsigned int schemes)
{
	char name[TABLE_NAME_MAX + 1];

	for (struct table_cursor at = table_walk(schemes); table_next(&at);) {
		if (table_name(at.row, 0, at.index, name) < 0)
			return 1;
		printf("%s %s %s %s\n", name, kind_name(at.row), table_type_name(at.row->type),
		       table_direction_name(at.row->direction));
	}
	return 0;
}

/* "encoder.%02u.count" is shown as "encoder.NN.count", a second index as N. */
static void print_pattern(const char *pattern)
{
	while (*pattern) {
		if (!strncmp(pattern, "%02u", 4)) {
			printf("NN");
			pattern += 4;
		} else if (!strncmp(pattern, "%u", 2)) {
			printf("N");
			pattern += 2;
		} else {
			putchar(*pattern++);
		}
	}
}

/* One paragraph, indented, wrapped; what scdoc takes for mark-up is escaped. */
static void print_paragraph(const char *text)
{
	int column = 8;

	printf("\t");
	while (*text) {
		int length = (int)strcspn(text, " ");

		if (column > 8 && column + length > 80) {
			printf("\n\t");
			column = 8;
		}
		for (int i = 0; i < length; i++)
			printf(strchr(i ? "*_" : "*_-", text[i]) ? "\\%c" : "%c", text[i]);
		text += length;
		column += length + 1;
		if (*text && text++ && column + (int)strcspn(text, " ") <= 80)
			printf(" ");
	}
	printf("\n\n");
}

/* Indices, initial value and range, as far as there are any. */
static void print_details(const struct table_row *row)
{
	if (row->count > 1)
		printf(", %02u..%02u", row->first, row->first + row->count - 1u);
	if (row->inner)
		printf(" and %u..%u", row->inner_first, row->inner_first + row->inner - 1u);
	if (row->kind == TABLE_PARAM && row->initial != 0 && !isnan(row->initial))
		printf(", default %g", row->initial);
	if (row->low != row->high)
		printf(", %g to %g", row->low, row->high);
}

static int list_for_man(unsigned int schemes)
{
	for (struct table_cursor at = table_walk(schemes); table_next_row(&at);) {
		const struct table_row *row = at.row;

		printf("*");
		print_pattern(row->name);
		printf("* (%s %s %s", kind_name(row), table_type_name(row->type),
		       table_direction_name(row->direction));
		print_details(row);
		printf(")\n");
		print_paragraph(row->help);
	}
	return 0;
}

/* A word for a set of schemes, 0 if it is none. */
static unsigned int schemes_of(const char *word)
{
	static const char *const words[] = {
		[TABLE_CANONICAL] = "canonical",
		[TABLE_LEGACY] = "legacy",
		[TABLE_BOTH] = "both",
		[TABLE_PONET] = "ponet",
		[TABLE_ALL] = "all",
		[TABLE_CORE] = "core",
		[TABLE_FORMER] = "former",
		[TABLE_HEATERS] = "heaters",
		[TABLE_SERVOS] = "servos",
		[TABLE_LOOPS] = "loops",
	};

	for (unsigned int i = TABLE_CORE; i < sizeof(words) / sizeof(words[0]); i++) {
		if (words[i] && !strcmp(word, words[i]))
			return i;
	}
	return 0;
}

int main(int argc, char **argv)
{
	unsigned int schemes = argc == 3 ? schemes_of(argv[2]) : 0;

	if (schemes && !strcmp(argv[1], "names"))
		return list_names(schemes);
	if (schemes && !strcmp(argv[1], "man"))
		return list_for_man(schemes);
	fprintf(stderr, "usage: list-names names|man "
			"canonical|core|legacy|both|heaters|servos|loops|ponet|former|all\n");
	return 2;
}
