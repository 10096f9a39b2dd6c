/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A folder of a test. */
#ifndef TESTS_CONTROL_FOLDER_H
#define TESTS_CONTROL_FOLDER_H

/* How many files whose name has this in it; those that begin with a dot do not count. */
int folder_count(const char *path, const char *part);

/* Remove it, with its files and empty folders. As rmdir(2). */
int folder_remove(const char *path);

#endif
