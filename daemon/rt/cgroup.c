/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Why the kernel answers EPERM to root.
 *
 * With cgroups of version 1 and CONFIG_RT_GROUP_SCHED every cpu group has a
 * realtime budget of its own, and a new group begins with none: then nobody
 * in it may have SCHED_FIFO, whatever rights he has. The errno is the same as
 * for a missing capability, and looking for a missing capability can take a
 * day. So it is looked up and said.
 */
#include <stdio.h>
#include <string.h>
#include "daemon/rt/cgroup.h"

/* "cpu" as one of "cpu,cpuacct"? */
static bool has_cpu(const char *controllers)
{
	const char *c = controllers;

	while (*c) {
		size_t n = strcspn(c, ",");

		if (n == 3 && !memcmp(c, "cpu", 3))
			return true;
		c += n + (c[n] == ',');
	}
	return false;
}

static bool read_number(const char *path, long *value)
{
	FILE *f = fopen(path, "re");
	bool ok;

	if (!f)
		return false;
	ok = fscanf(f, "%ld", value) == 1;
	fclose(f);
	return ok;
}

/* A line "4:cpu,cpuacct:/group": true if that group has no realtime time. */
static bool line_forbids(char *line, const char *mount, char *path, size_t size)
{
	char *controllers = strchr(line, ':'), *group;
	long runtime;

	group = controllers ? strchr(controllers + 1, ':') : NULL;
	if (!group)
		return false;
	*controllers++ = '\0';
	*group++ = '\0';
	group[strcspn(group, "\n")] = '\0';
	if (!has_cpu(controllers))
		return false;
	snprintf(path, size, "%s/%s%s%scpu.rt_runtime_us", mount, controllers, group,
		 *group && group[strlen(group) - 1] == '/' ? "" : "/");
	return read_number(path, &runtime) && runtime == 0;
}

bool cgroup_forbids_realtime(const char *membership, const char *mount, char *path, size_t size)
{
	FILE *f = fopen(membership, "re");
	bool forbids = false;
	char line[512];

	if (!f)
		return false;
	while (!forbids && fgets(line, sizeof line, f))
		forbids = line_forbids(line, mount, path, size);
	fclose(f);
	return forbids;
}
