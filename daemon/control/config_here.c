// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What of a good file cannot be on this machine: its groups, network
 * interfaces and cores. The daemon finds out at its start, one at a time, and may
 * be started again; --check-config is to be believed, so there it is told with all
 * the rest.
 */
#include <grp.h>
#include <net/if.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "daemon/control/config_key.h"

/* As the shared memory takes it: a name, or a number that need not have one. */
static bool group_is_there(const char *group)
{
	return getgrnam(group) || (!group[strspn(group, "0123456789")] && strlen(group) <= 10 &&
				   strtoull(group, NULL, 10) < UINT32_MAX);
}

static void judge_group(struct config_file *file, const char *key, const char *group)
{
	if (*group && !group_is_there(group))
		config_fault(file, config_line_of(&file->daemon_lines, key, 0),
			     "[daemon]: %s: "
			     "there is no group \"%s\" on this machine; create it (groupadd -r "
			     "%s)",
			     key, group, group);
}

void config_judge_here(struct config_file *file)
{
	const struct config_raw_daemon *raw = &file->daemon;
	const struct config_lines *lines = &file->daemon_lines;
	long cores = sysconf(_SC_NPROCESSORS_CONF);

	judge_group(file, "group", raw->group);
	judge_group(file, "monitor-group", raw->monitor_group);
	if (*raw->interface && !if_nametoindex(raw->interface))
		config_fault(file, config_line_of(lines, "interface", 0),
			     "[daemon]: interface: "
			     "there is no network interface \"%s\" on this machine (ip link lists "
			     "those that are there)",
			     raw->interface);
	if (cores > 0 && raw->cpu >= cores)
		config_fault(file, config_line_of(lines, "cpu", 0),
			     "[daemon]: cpu: \"%d\" is not "
			     "on this machine; it has cores 0..%ld",
			     (int)raw->cpu, cores - 1);
}
