// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the flight recorder leaves in a folder is looked at, and taken away again,
 * whatever it is; a link is not followed.
 */
#include <dirent.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>
#include "tests/control/folder.h"

int folder_count(const char *path, const char *part)
{
	DIR *all = opendir(path);
	struct dirent *entry;
	int count = 0;

	while (all && (entry = readdir(all)))
		count += entry->d_name[0] != '.' && strstr(entry->d_name, part) != NULL;
	if (all)
		closedir(all);
	return count;
}

int folder_remove(const char *path)
{
	DIR *all = opendir(path);
	struct dirent *entry;

	while (all && (entry = readdir(all)))
		if (unlinkat(dirfd(all), entry->d_name, 0))
			unlinkat(dirfd(all), entry->d_name, AT_REMOVEDIR);
	if (all)
		closedir(all);
	return rmdir(path);
}
