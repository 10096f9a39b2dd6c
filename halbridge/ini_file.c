/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * LinuxCNC's INI file, read the way its users write it.
 *
 * An indented line is a key and no continuation, a '#' or ';' behind a value and
 * a blank begins a comment, sections may come twice, and most of the file is
 * somebody else's: a line that is no key is passed over in silence. The first of
 * several equal keys counts, as for LinuxCNC itself. Read by hand, and not by
 * libinih as pokeysd.conf is, because LinuxCNC loads a module that wants no
 * library but its own.
 *
 * A value that does not fit is kept cut: whoever reads it as a number will
 * complain with the line, and nobody else's line matters.
 */
#include "halbridge/ini_file.h"
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct reading {
	struct ini_file *file;
	FILE *stream;
	char section[INI_FILE_SECTION];
	unsigned int line;
	bool all; /* sections */
};

enum { LINE = 1024 };

/* One line, whole or cut; false at the end. */
static bool read_line(struct reading *reading, char line[LINE])
{
	int next;

	if (!fgets(line, LINE, reading->stream))
		return false;
	reading->line++;
	if (!strchr(line, '\n')) {
		while ((next = fgetc(reading->stream)) != EOF && next != '\n')
			;
	}
	return true;
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

/* "5 # five" is 5: without what is behind a comment's beginning, and without blanks. */
static char *trim(char *text)
{
	size_t length;

	text += strspn(text, " \t");
	for (char *at = text; (at = strpbrk(at, "#;")); at++) {
		if (at > text && !strchr(" \t", at[-1]))
			continue;
		*at = '\0';
		break;
	}
	for (length = strlen(text); length && strchr(" \t\r\n", text[length - 1]); length--)
		text[length - 1] = '\0';
	return text;
}

static int take(struct reading *reading, char *line)
{
	char *equals = strchr(line, '=');
	struct ini_entry *entry;

	if (!equals || (!reading->all && !wanted(reading->section)))
		return 0;
	*equals = '\0';
	entry = new_entry(reading->file);
	if (!entry)
		return -ENOMEM;
	snprintf(entry->section, sizeof(entry->section), "%s", reading->section);
	snprintf(entry->key, sizeof(entry->key), "%s", trim(line));
	snprintf(entry->value, sizeof(entry->value), "%s", trim(equals + 1));
	entry->line = reading->line;
	return 0;
}

/* A section, a key, or somebody else's. */
static int look_at(struct reading *reading, char *line)
{
	line += strspn(line, " \t");
	if (*line == '#' || *line == ';')
		return 0;
	if (*line != '[')
		return take(reading, line);
	snprintf(reading->section, sizeof(reading->section), "%.*s",
		 (int)strcspn(line + 1, "]\r\n"), line + 1);
	return 0;
}

static int read_sections(struct ini_file *file, const char *path, bool all)
{
	struct reading reading = { .file = file, .all = all };
	char line[LINE];
	int r = 0;

	*file = (struct ini_file){ .path = path };
	reading.stream = fopen(path, "re");
	if (!reading.stream)
		return -errno;
	errno = 0;
	while (!r && read_line(&reading, line))
		r = look_at(&reading, line);
	if (!r && ferror(reading.stream))
		r = errno ? -errno : -EIO;
	fclose(reading.stream);
	if (r)
		ini_file_free(file);
	return r;
}

int ini_file_read(struct ini_file *file, const char *path)
{
	return read_sections(file, path, false);
}

int ini_file_read_all(struct ini_file *file, const char *path)
{
	return read_sections(file, path, true);
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
