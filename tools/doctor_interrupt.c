// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Which interrupts may come to the daemon's core. What counts is where the
 * kernel really sends one (effective_affinity_list), which is less than where
 * it may; a kernel without that file is judged by smp_affinity_list. One that was
 * sent elsewhere a moment ago goes by that: the kernel moves it with the next one,
 * which of a vector that never fires does not come.
 *
 * A network interface's interrupts are found by what its driver's device lists
 * (msi_irqs; for virtio that is one folder up), and where it lists none by the
 * interface's name in /proc/interrupts.
 */
#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include "tools/doctor.h"

/* Numbers are given anew at each boot; a disk's (managed_irq) cannot be moved otherwise. */
#define DOCTOR_ELSEWHERE "irqaffinity=OTHER-CORES on the kernel command line; those of which " \
	"the kernel refuses it want isolcpus=managed_irq,..."

#define CORES "/sys/devices/system/cpu"

enum { IRQS = 4096, INTERRUPTS_TEXT = 1 << 18, CORES_MAX = 1024 };

struct irqs {
	size_t count;
	int number[IRQS];
};

static int by_number(const void *a, const void *b)
{
	return *(const int *)a - *(const int *)b;
}

static void add_folder(const char *path, struct irqs *irqs)
{
	DIR *folder = opendir(path);
	const struct dirent *entry;

	while (folder && irqs->count < IRQS && (entry = readdir(folder))) {
		char *end;
		long number = strtol(entry->d_name, &end, 10);

		if (end != entry->d_name && !*end)
			irqs->number[irqs->count++] = (int)number;
	}
	if (folder)
		closedir(folder);
	qsort(irqs->number, irqs->count, sizeof(irqs->number[0]), by_number);
}

/* Its handlers are folders. Many a number of the first sixteen has none, and never comes. */
static bool has_handler(const char *root, int irq)
{
	char path[512];
	DIR *folder;
	const struct dirent *entry = NULL;

	snprintf(path, sizeof(path), "%s/proc/irq/%d", root, irq);
	folder = opendir(path);
	while (folder && (entry = readdir(folder)))
		if (entry->d_type == DT_DIR && entry->d_name[0] != '.')
			break;
	if (folder)
		closedir(folder);
	return entry;
}

/* Where the kernel sends one, as a list of cores; empty: nowhere. */
static bool target(const char *root, int irq, char *list, size_t size)
{
	const bool told = probe_text(root, list, size, "/proc/irq/%d/effective_affinity_list", irq);

	if (told && (*list || !has_handler(root, irq)))
		return true;
	return probe_text(root, list, size, "/proc/irq/%d/smp_affinity_list", irq);
}

/* It was sent elsewhere; most cards' are moved by the next one that comes where it was. */
static bool is_leaving(const struct doctor *doctor, int irq)
{
	char list[256];

	return probe_text(doctor->root, list, sizeof(list), "/proc/irq/%d/smp_affinity_list",
			  irq) &&
	       *list && !probe_list_has(list, doctor->cpu);
}

/* Numbers of those that go to the core, as "24 25", or "24 25 and others" if they are too many;
 * how many, and how many are not told. */
static size_t on_core(const struct doctor *doctor, const struct irqs *irqs, char *text, size_t size,
		      size_t *untold)
{
	size_t count = 0, at = 0;
	int cut = 0;
	char list[256];

	text[0] = '\0';
	*untold = 0;
	for (size_t i = 0; i < irqs->count; i++) {
		if (!target(doctor->root, irqs->number[i], list, sizeof(list)))
			++*untold;
		if (!probe_list_has(list, doctor->cpu) || is_leaving(doctor, irqs->number[i]))
			continue;
		if (at + sizeof(" 12345 and others") < size)
			at += (size_t)snprintf(text + at, size - at, "%s%d", count ? " " : "",
					       irqs->number[i]);
		else if (!cut)
			cut = snprintf(text + at, size - at, " and others");
		count++;
	}
	return count;
}

size_t doctor_irqs_on_core(const struct doctor *doctor, int number[], size_t most)
{
	struct irqs irqs = { 0 };
	char path[512], list[256];
	size_t count = 0;

	snprintf(path, sizeof(path), "%s/proc/irq", doctor->root);
	add_folder(path, &irqs);
	for (size_t i = 0; i < irqs.count && count < most; i++)
		if (target(doctor->root, irqs.number[i], list, sizeof(list)) &&
		    probe_list_has(list, doctor->cpu) && !is_leaving(doctor, irqs.number[i]))
			number[count++] = irqs.number[i];
	return count;
}

/* The first core that is neither isolated nor the daemon's, -1 if there is none. */
static int other_core(const struct doctor *doctor)
{
	char online[256], isolated[256];

	if (!probe_text(doctor->root, online, sizeof(online), CORES "/online"))
		return -1;
	if (!probe_text(doctor->root, isolated, sizeof(isolated), CORES "/isolated"))
		*isolated = '\0';
	for (int core = 0; core < CORES_MAX; core++)
		if (core != doctor->cpu && probe_list_has(online, core) &&
		    !probe_list_has(isolated, core))
			return core;
	return -1;
}

/* Of very many the first ones only; whoever asks again is told the others. */
static void mend_irqs(const struct doctor *doctor, const struct irqs *irqs,
		      struct doctor_finding *finding)
{
	int other = other_core(doctor);
	char text[400], *others;
	size_t untold;

	on_core(doctor, irqs, text, sizeof(text), &untold);
	others = strstr(text, " and");
	if (others)
		*others = '\0';
	if (other < 0)
		doctor_mend(finding, "for each: echo OTHER-CORE > /proc/irq/NUMBER/"
				     "smp_affinity_list");
	else
		doctor_mend(finding,
			    "for i in %s; do echo %d > "
			    "/proc/irq/$i/smp_affinity_list; done",
			    text, other);
	doctor_keep(finding, DOCTOR_ELSEWHERE);
}

static void judge_all(const struct doctor *doctor, struct doctor_finding *finding)
{
	struct irqs irqs = { 0 };
	char path[512], text[64];
	size_t count, untold;

	snprintf(path, sizeof(path), "%s/proc/irq", doctor->root);
	add_folder(path, &irqs);
	count = on_core(doctor, &irqs, text, sizeof(text), &untold);
	if (!count && (untold || !irqs.count)) {
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/irq cannot be read");
		return;
	}
	if (!count) {
		doctor_say(finding, DOCTOR_OK, "none of %zu goes to core %d", irqs.count,
			   doctor->cpu);
		return;
	}
	doctor_say(finding, DOCTOR_ADVICE, "%zu of %zu go to core %d: %s", count, irqs.count,
		   doctor->cpu, text);
	mend_irqs(doctor, &irqs, finding);
}

/* Lines of /proc/interrupts that name the interface as a word of their own. */
static void add_by_name(const char *root, const char *name, struct irqs *irqs)
{
	char *text = malloc(INTERRUPTS_TEXT), *rest = text, *line;
	size_t length = strlen(name);

	if (text && probe_text(root, text, INTERRUPTS_TEXT, "/proc/interrupts"))
		while (irqs->count < IRQS && (line = strsep(&rest, "\n"))) {
			const char *at = strstr(line, name);

			if (at && at > line && at[-1] == ' ' && strchr("- :,", at[length]) &&
			    atoi(line) > 0)
				irqs->number[irqs->count++] = atoi(line);
		}
	free(text);
}

static void find_irqs(const char *root, const char *nic, struct irqs *irqs)
{
	static const char *const folders[] = { "device/msi_irqs", "device/../msi_irqs" };
	char path[512];

	for (size_t i = 0; i < 2 && !irqs->count; i++) {
		snprintf(path, sizeof(path), "%s/sys/class/net/%s/%s", root, nic, folders[i]);
		add_folder(path, irqs);
	}
	if (!irqs->count)
		add_by_name(root, nic, irqs);
}

static void judge_nic(const struct doctor *doctor, struct doctor_finding *finding)
{
	struct irqs irqs = { 0 };
	char text[64];
	size_t count, untold;

	find_irqs(doctor->root, finding->nic->name, &irqs);
	count = on_core(doctor, &irqs, text, sizeof(text), &untold);
	if (!strcmp(finding->nic->name, "lo"))
		doctor_say(finding, DOCTOR_OK, "the loopback has none");
	else if (doctor->cpu < 0)
		doctor_say(finding, DOCTOR_UNKNOWN, "no core is chosen, see the check core");
	else if (!irqs.count)
		doctor_say(finding, DOCTOR_UNKNOWN, "its interrupts were not found");
	else if (!count && untold)
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/irq cannot be read");
	else if (!count)
		doctor_say(finding, DOCTOR_OK, "its interrupts stay off core %d", doctor->cpu);
	else
		doctor_say(finding, DOCTOR_ADVICE,
			   "interrupt %s goes to core %d: every packet, "
			   "also a foreign one, interrupts the realtime thread",
			   text, doctor->cpu);
	if (finding->verdict == DOCTOR_ADVICE)
		mend_irqs(doctor, &irqs, finding);
}

static const struct doctor_check checks[] = {
	{ "interrupts", DOCTOR_CORE, judge_all },
	{ "nic-interrupts", DOCTOR_NIC, judge_nic },
};
const struct doctor_checks doctor_interrupt_checks = {
	checks,
	sizeof(checks) / sizeof(checks[0]),
};
