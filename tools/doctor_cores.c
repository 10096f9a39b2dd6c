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

/* As ranges, such as "0-1,4". False if it is empty or does not fit. */
static bool put_list(const bool has[CORES], char *list, size_t size)
{
	size_t at = 0;

	for (int first = 0; first < CORES && at < size; first++) {
		int end = first;

		if (!has[first])
			continue;
		while (end + 1 < CORES && has[end + 1])
			end++;
		at += (size_t)snprintf(list + at, size - at,
				       end > first + 1 ? "%s%d-%d" :
				       end > first     ? "%s%d,%d" :
							 "%s%d",
				       at ? "," : "", first, end);
		first = end;
	}
	return at && at < size;
}

const char *doctor_isolate(const struct doctor *doctor, char *list, char *others, size_t size)
{
	bool ours[CORES] = { false }, rest[CORES] = { false };
	int core[CORES];
	const int cores = find_cores(doctor->root, core), cpu = doctor->cpu;
	const int last = cores > 2 ? core[cores - 1] : cpu;
	char online[LIST] = "", isolated[LIST] = "", tickless[LIST] = "", siblings[LIST] = "";

	if (!cpu)
		return "core 0 does the kernel's own work and cannot be freed from it; choose "
		       "another cpu";
	if (cores < 2 || cpu < 0)
		return "there is no core to spare";
	probe_text(doctor->root, online, sizeof(online), CORE "/online");
	probe_text(doctor->root, isolated, sizeof(isolated), CORE "/isolated");
	probe_text(doctor->root, tickless, sizeof(tickless), CORE "/nohz_full");
	if (!probe_list_has(online, cpu))
		return "the core of cpu = does not exist or is switched off; choose another cpu";
	probe_text(doctor->root, siblings, sizeof(siblings),
		   CORE "/cpu%d/topology/thread_siblings_list", cpu);
	if (cores > 2 && (last <= cpu || probe_list_has(siblings, last)))
		return "LinuxCNC takes the isolated core with the highest number, which would be "
		       "the daemon's; choose a lower cpu";
	for (int i = 0; i < CORES; i++) {
		ours[i] = i == cpu || i == last;
		rest[i] = probe_list_has(online, i) && !ours[i] && !probe_list_has(siblings, i) &&
			  !probe_list_has(isolated, i) && !probe_list_has(tickless, i);
	}
	return put_list(ours, list, size) && put_list(rest, others, size) ?
		       NULL :
		       "there is no core left for everything else";
}
