/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Wireshark's dissector in examples/wireshark has every operation of the wire's
 * table and no other, as lines { id, first, last, "name" }. With --print: those
 * lines, to put into it.
 */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "wire/op.h"

/* first and last sub-operation; an operation without any takes all. */
static void format(const struct wire_op_row *row, char *line, size_t size)
{
	const bool any = !row->sub.where;

	snprintf(line, size, "\t{ 0x%02x, 0x%02x, 0x%02x, \"%s\" },\n", row->id,
		 any ? 0 : row->sub.first, any ? 0xff : row->sub.last, row->name);
}

static char *read_all(const char *path)
{
	static char text[1 << 16];
	FILE *file = fopen(path, "r");
	size_t length;

	if (!file)
		return NULL;
	length = fread(text, 1, sizeof(text) - 1, file);
	fclose(file);
	text[length] = '\0';
	return text;
}

static int count(const char *text, const char *what)
{
	int n = 0;

	for (const char *at = text; (at = strstr(at, what)); at++)
		n++;
	return n;
}

int main(int argc, char **argv)
{
	const bool print = argc > 1 && !strcmp(argv[1], "--print");
	const char *text = argc > 1 && !print ? read_all(argv[1]) : "";
	char line[128];
	int missing = 0;

	if (!text) {
		fprintf(stderr, "%s cannot be read\n", argv[1]);
		return 1;
	}
	for (int op = 0; op < WIRE_OP_COUNT; op++) {
		format(wire_op((enum wire_op)op), line, sizeof(line));
		if (print) {
			fputs(line, stdout);
		} else if (!strstr(text, line)) {
			printf("not there: %s", line);
			missing++;
		}
	}
	if (print)
		return 0;
	if (count(text, "\t{ 0x") != WIRE_OP_COUNT) {
		printf("%d operations, %d are in the table\n", count(text, "\t{ 0x"),
		       WIRE_OP_COUNT);
		return 1;
	}
	printf("%d operations\n", WIRE_OP_COUNT);
	return missing ? 1 : 0;
}
