/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * LinuxCNC's INI file, read the way its users write it.
 *
 * libinih splits the lines, but this is not a file for libinih: an indented
 * line is a key here and no continuation, a '#' behind a value begins a
 * comment, sections may come twice, and most of the file is somebody else's.
 * So one line at a time is handed over, without its indent, and a line that
 * is no key is passed over in silence. The first of several equal keys counts,
 * as for LinuxCNC itself.
 *
 * A value that does not fit is kept cut: whoever reads it as a number will
 * complain with the line, and nobody else's line matters.
 */
#include "halbridge/ini_file.h"
#include <errno.h>
#include <ini.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct reading {
	struct ini_file *file;
	FILE *stream;
	unsigned int line;
	bool no_memory;
};

/* For inih: one line, whole or cut, indent removed. */
static char *read_line(char *text, int size, void *context)
{
	struct reading *reading = context;
	char line[1024];
	const char *begin = line;
	int next;

	if (!fgets(line, sizeof(line), reading->stream))
		return NULL;
	reading->line++;
	if (!strchr(line, '\n')) {
		while ((next = fgetc(reading->stream)) != EOF && next != '\n')
			;
	}
	begin += strspn(line, " \t");
	snprintf(text, (size_t)size, "%.*s\n", (int)strcspn(begin, "\r\n"), begin);
	return text;
}

static bool wanted(const char *section)
{
	return !strcmp(section, "POKEYS") || !strncmp(section, "JOINT_", 6);
}

static struct ini_entry *new_entry(struct ini_file *file)
{
	if (file->count == file->room) {
		size_t room = file->room ? 2 * file->room : 256;
		struct ini_entry *entry = realloc(file->entry, room * sizeof(*entry));

		if (!entry)
			return NULL;
		file->entry = entry;
		file->room = room;
	}
	return &file->entry[file->count++];
}

/* "5 # five" is 5 */
static void cut_comment(char *value)
{
	char *comment = strstr(value, " #");

	if (!comment)
		comment = strstr(value, "\t#");
	if (comment)
		*comment = '\0';
	for (size_t length = strlen(value); length && strchr(" \t", value[length - 1]); length--)
		value[length - 1] = '\0';
}

static int take(void *context, const char *section, const char *key, const char *value)
{
	struct reading *reading = context;
	struct ini_entry *entry;

	if (!wanted(section))
		return 1;
	entry = new_entry(reading->file);
	if (!entry) {
		reading->no_memory = true;
		return 0;
	}
	snprintf(entry->section, sizeof(entry->section), "%s", section);
	snprintf(entry->key, sizeof(entry->key), "%s", key);
	snprintf(entry->value, sizeof(entry->value), "%s", value);
	entry->line = reading->line;
	cut_comment(entry->value);
	return 1;
}

int ini_file_read(struct ini_file *file, const char *path)
{
	struct reading reading = { .file = file };
	int r;

	*file = (struct ini_file){ .path = path };
	reading.stream = fopen(path, "re");
	if (!reading.stream)
		return -errno;
	errno = 0;
	ini_parse_stream(read_line, &reading, take, &reading);
	r = reading.no_memory ? -ENOMEM : ferror(reading.stream) ? -EIO : 0;
	fclose(reading.stream);
	if (r)
		ini_file_free(file);
	return r;
}

void ini_file_free(struct ini_file *file)
{
	free(file->entry);
	file->entry = NULL;
	file->count = file->room = 0;
}

const struct ini_entry *ini_file_find(const struct ini_file *file, const char *section,
				      const char *key)
{
	for (size_t i = 0; i < file->count; i++) {
		const struct ini_entry *entry = &file->entry[i];

		if (!strcmp(entry->section, section) && !strcasecmp(entry->key, key))
			return entry;
	}
	return NULL;
}
