/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A machine's INI file, as far as the userspace component wants it.
 */
#ifndef HALBRIDGE_INI_FILE_H
#define HALBRIDGE_INI_FILE_H

#include <stddef.h>

enum { INI_FILE_SECTION = 32, INI_FILE_KEY = 64, INI_FILE_VALUE = 256 };

struct ini_entry {
	char section[INI_FILE_SECTION], key[INI_FILE_KEY], value[INI_FILE_VALUE];
	unsigned int line;
};

struct ini_file {
	const char *path;
	struct ini_entry *entry; /* in the file's order */
	size_t count, room;
};

/*
 * Read [POKEYS] and [JOINT_n] of a file; keep `path` for as long as the file is used. 0, or
 * -errno (what is not a key is passed over: it is not our file). Cold.
 */
int ini_file_read(struct ini_file *file, const char *path);

/* The same with all sections, for callers that need other sections. */
int ini_file_read_all(struct ini_file *file, const char *path);

void ini_file_free(struct ini_file *file);

/* The first entry of that section (exact) and key (in any case), or NULL. */
const struct ini_entry *ini_file_find(const struct ini_file *file, const char *section,
				      const char *key);

#endif
