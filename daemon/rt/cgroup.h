/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Does our cpu cgroup have any realtime time? Cold; see cgroup.c. */
#ifndef RT_CGROUP_H
#define RT_CGROUP_H

#include <stdbool.h>
#include <stddef.h>

/*
 * True if the group named for the cpu controller in the file `membership`
 * (/proc/self/cgroup), below the folder `mount` (/sys/fs/cgroup), has a
 * realtime budget of nothing. `path` then is the file that says so.
 */
bool cgroup_forbids_realtime(const char *membership, const char *mount, char *path, size_t size);

#endif
