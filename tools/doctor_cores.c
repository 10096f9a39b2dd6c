// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Which core to give the daemon where nobody has chosen one, and which cores to isolate for it
 * and for LinuxCNC, which takes the isolated core of the highest number. docs/tuning.md has the
 * same as a tree.
 */
#include <stdlib.h>
#include <string.h>
#include "tools/doctor.h"

#define CORE "/sys/devices/system/cpu"

enum { CORES = 1024, LIST = 256 };

/* The first of each set of siblings, in order; others have no execution units of their own. */
static int find_cores(const char *root, int core[CORES])
{
	char online[LIST], siblings[LIST];
	int count = 0;

	if (!probe_text(root, online, sizeof(online), CORE "/online"))
		return 0;
	for (int i = 0; i < CORES; i++)
		if (probe_list_has(online, i) &&
		    (!probe_text(root, siblings, sizeof(siblings),
				 CORE "/cpu%d/topology/thread_siblings_list", i) ||
		     atoi(siblings) == i))
			core[count++] = i;
	return count;
}

/* Those of them that are isolated. */
static int find_isolated(const char *root, const int core[], int cores, int isolated[CORES])
{
	char list[LIST];
	int count = 0;

	if (!probe_text(root, list, sizeof(list), CORE "/isolated"))
		return 0;
	for (int i = 0; i < cores; i++)
		if (probe_list_has(list, core[i]))
			isolated[count++] = core[i];
	return count;
}

/* The core below another one; core 0 does the kernel's own work. */
static int below(const int core[], int cores, int other)
{
	for (int i = cores - 1; i > 0; i--)
		if (core[i] < other)
			return core[i];
	return other;
}

int doctor_propose_core(const struct doctor *doctor)
{
	int core[CORES], isolated[CORES];
	const int cores = find_cores(doctor->root, core);
	const int apart = find_isolated(doctor->root, core, cores, isolated);

	if (cores < 2)
		return -1;
	if (apart)
		return below(core, cores, isolated[apart - 1]);
	return cores > 3 ? core[cores - 2] : core[1];
}

static void append(char *list, size_t size, int core)
{
	const size_t at = strlen(list);

	snprintf(list + at, size - at, "%s%d", at ? "," : "", core);
}

bool doctor_isolate(const struct doctor *doctor, char *list, char *others, size_t size)
{
	int core[CORES];
	const int cores = find_cores(doctor->root, core);
	const int last = cores > 2 ? core[cores - 1] : doctor->cpu;
	char online[LIST];

	*list = *others = '\0';
	if (cores < 2 || doctor->cpu <= 0 ||
	    !probe_text(doctor->root, online, sizeof(online), CORE "/online"))
		return false;
	for (int i = 0; i < CORES; i++)
		if (probe_list_has(online, i))
			append(i == doctor->cpu || i == last ? list : others, size, i);
	return *list && *others;
}
