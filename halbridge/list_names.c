/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The table in print, so that whatever has to agree with it can be made from
 * it or held against it: the test of the live HAL, and the man page.
 *
 *	list-names names	every name of pokeys.0: NAME KIND TYPE DIRECTION
 *	list-names man		rows as pokeys_shm(9) has them (scdoc)
 */
#include <stdio.h>
#include <string.h>
#include "halbridge/table.h"

static const char *kind_name(const struct table_row *row)
{
	return row->kind == TABLE_PIN ? "pin" : "param";
}

static int list_names(void)
{
	char name[TABLE_NAME_MAX + 1];

	for (size_t i = 0; i < table_row_count; i++) {
		const struct table_row *row = &table_rows[i];

		for (unsigned int k = 0; k < row->count; k++) {
			if (table_name(row, 0, k, name) < 0)
				return 1;
			printf("%s %s %s %s\n", name, kind_name(row), table_type_name(row->type),
			       table_direction_name(row->direction));
		}
	}
	return 0;
}

/* "encoder.%02u.count" is shown as "encoder.NN.count". */
static void print_pattern(const char *pattern)
{
	const char *index = strstr(pattern, "%02u");

	if (index)
		printf("%.*sNN%s", (int)(index - pattern), pattern, index + 4);
	else
		printf("%s", pattern);
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
			printf(strchr("*_", text[i]) ? "\\%c" : "%c", text[i]);
		text += length;
		column += length + 1;
		if (*text && text++ && column + (int)strcspn(text, " ") <= 80)
			printf(" ");
	}
	printf("\n\n");
}

static int list_for_man(void)
{
	for (size_t i = 0; i < table_row_count; i++) {
		const struct table_row *row = &table_rows[i];

		printf("*");
		print_pattern(row->name);
		printf("* (%s %s %s", kind_name(row), table_type_name(row->type),
		       table_direction_name(row->direction));
		if (row->count > 1)
			printf(", 00..%02u", row->count - 1u);
		if (row->kind == TABLE_PARAM && row->initial != 0)
			printf(", default %g", row->initial);
		printf(")\n");
		print_paragraph(row->help);
	}
	return 0;
}

int main(int argc, char **argv)
{
	if (argc == 2 && !strcmp(argv[1], "names"))
		return list_names();
	if (argc == 2 && !strcmp(argv[1], "man"))
		return list_for_man();
	fprintf(stderr, "usage: list-names names|man\n");
	return 2;
}
