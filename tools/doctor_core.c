// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The core that the realtime thread is for. Isolation is three settings of the
 * kernel's command line that are easily set for three different cores, or for
 * another one than pokeysd.conf names, so each is held against the same core.
 *
 * Spinning on a core that is not isolated starves whatever else the scheduler
 * put there: a problem. Sleeping on it is only worse than it could be.
 */
#include <ctype.h>
#include <string.h>
#include "tools/doctor.h"

#define CORE "/sys/devices/system/cpu"

enum { LIST = 96 };

static void judge_core(const struct doctor *doctor, struct doctor_finding *finding)
{
	char online[256];

	if (doctor->cpu < 0) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "no core is chosen for the realtime thread "
			   "(%s), so the scheduler moves it",
			   doctor->plan.read ? "cpu = any" : "pokeysd.conf was not read");
		doctor_mend(finding, "cpu = N under [daemon] in pokeysd.conf, or here --cpu N");
	} else if (!probe_text(doctor->root, online, sizeof(online), CORE "/online")) {
		doctor_say(finding, DOCTOR_UNKNOWN, CORE "/online cannot be read");
	} else if (!probe_list_has(online, doctor->cpu)) {
		doctor_say(finding, DOCTOR_PROBLEM, "core %d is not there; online are %s",
			   doctor->cpu, online);
		doctor_mend(finding,
			    "another cpu in pokeysd.conf, or echo 1 > " CORE "/cpu%d/online",
			    doctor->cpu);
	} else {
		doctor_say(finding, DOCTOR_OK, "core %d of %s", doctor->cpu, online);
	}
}

static bool is_list(const char *text)
{
	return isdigit((unsigned char)*text); /* not "", "(null)" */
}

/* A list with our core in it, of a file or of the command line: others' cores stay in it. */
static void with_core(const struct doctor *doctor, const char *list, char *out)
{
	if (!is_list(list))
		snprintf(out, LIST, "%d", doctor->cpu);
	else if (probe_list_has(list, doctor->cpu))
		snprintf(out, LIST, "%s", list);
	else
		snprintf(out, LIST, "%s,%d", list, doctor->cpu);
}

struct lists {
	char isolated[LIST], tickless[LIST], offloaded[LIST];
};

/* The present values of the three parameters. */
static void find_lists(const struct doctor *doctor, struct lists *found)
{
	memset(found, 0, sizeof(*found));
	probe_text(doctor->root, found->isolated, LIST - 8, CORE "/isolated");
	probe_text(doctor->root, found->tickless, LIST - 8, CORE "/nohz_full");
	if (!probe_command_line(doctor->root, "rcu_nocbs", found->offloaded, LIST - 8))
		*found->offloaded = '\0';
}

/*
 * The mending of all three is one line of the boot loader's. Core 0 is the one that the
 * kernel keeps for what it takes off the others, and the last one cannot do without itself.
 * If no core is isolated yet, LinuxCNC's core is isolated as well. Otherwise ours would be the
 * only isolated core, and LinuxCNC would use it.
 */
static void mend_command_line(const struct doctor *doctor, struct doctor_finding *finding)
{
	struct lists found, set;
	char others[LIST];

	if (!doctor->cpu) {
		doctor_mend(finding, "another cpu in pokeysd.conf: core 0 does the kernel's own "
				     "work and cannot be freed from it");
		return;
	}
	find_lists(doctor, &found);
	if (!is_list(found.isolated) && !is_list(found.tickless) && !is_list(found.offloaded) &&
	    !doctor_isolate(doctor, set.isolated, others, LIST)) {
		memcpy(set.tickless, set.isolated, LIST);
		memcpy(set.offloaded, set.isolated, LIST);
	} else {
		with_core(doctor, found.isolated, set.isolated);
		with_core(doctor, found.tickless, set.tickless);
		with_core(doctor, found.offloaded, set.offloaded);
	}
	doctor_mend(finding,
		    "kernel command line (GRUB_CMDLINE_LINUX in /etc/default/grub, then "
		    "update-grub): isolcpus=managed_irq,domain,%s nohz_full=%s rcu_nocbs=%s",
		    set.isolated, set.tickless, set.offloaded);
}

/* By a cpuset (cpuset.cpus.partition = isolated) and not by the command line. */
static bool isolated_by_cpuset(const struct doctor *doctor, char *list, size_t size)
{
	return probe_text(doctor->root, list, size, "/sys/fs/cgroup/cpuset.cpus.isolated") &&
	       probe_list_has(list, doctor->cpu);
}

static void judge_isolated(const struct doctor *doctor, struct doctor_finding *finding)
{
	char list[256], cpuset[256];

	if (!probe_text(doctor->root, list, sizeof(list), CORE "/isolated")) {
		doctor_say(finding, DOCTOR_UNKNOWN, CORE "/isolated cannot be read");
	} else if (probe_list_has(list, doctor->cpu)) {
		doctor_say(finding, DOCTOR_OK, "isolated are %s", list);
	} else if (isolated_by_cpuset(doctor, cpuset, sizeof(cpuset))) {
		doctor_say(finding, DOCTOR_OK,
			   "a cpuset isolates %s (mode = auto does not count "
			   "that, and does not spin)",
			   cpuset);
	} else {
		doctor_say(finding, doctor->plan.spin ? DOCTOR_PROBLEM : DOCTOR_ADVICE,
			   "%s%s: other programs run on core %d as well%s",
			   *list ? "isolated are " : "no core is isolated", list, doctor->cpu,
			   doctor->plan.spin ? ", and mode = spin starves them" : "");
		mend_command_line(doctor, finding);
	}
}

static void judge_tick(const struct doctor *doctor, struct doctor_finding *finding)
{
	char list[256];

	if (!probe_text(doctor->root, list, sizeof(list), CORE "/nohz_full")) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   CORE "/nohz_full cannot be read (a kernel "
				"without CONFIG_NO_HZ_FULL has none)");
	} else if (probe_list_has(list, doctor->cpu)) {
		doctor_say(finding, DOCTOR_OK, "without a tick are %s", list);
	} else {
		doctor_say(finding, DOCTOR_ADVICE, "the scheduler's tick interrupts core %d",
			   doctor->cpu);
		mend_command_line(doctor, finding);
	}
}

/*
 * nohz_full= implies it. Without a list it takes no core's callbacks away, it only lets
 * somebody do so later.
 */
static void judge_callbacks(const struct doctor *doctor, struct doctor_finding *finding)
{
	char line[64], list[256];
	bool has;

	if (!probe_text(doctor->root, line, sizeof(line), "/proc/cmdline")) {
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/cmdline cannot be read");
		return;
	}
	has = probe_command_line(doctor->root, "rcu_nocbs", list, sizeof(list)) &&
	      (!strcmp(list, "all") || probe_list_has(list, doctor->cpu));
	has = has || (probe_text(doctor->root, list, sizeof(list), CORE "/nohz_full") &&
		      probe_list_has(list, doctor->cpu));
	if (has) {
		doctor_say(finding, DOCTOR_OK, "RCU callbacks run on other cores");
		return;
	}
	doctor_say(finding, DOCTOR_ADVICE, "RCU callbacks run on core %d", doctor->cpu);
	mend_command_line(doctor, finding);
}

/* Core 0 cannot be switched off, and nosmt leaves the first of the siblings. */
static void mend_sibling(const struct doctor *doctor, struct doctor_finding *finding, int sibling)
{
	char path[64];

	snprintf(path, sizeof(path), CORE "/cpu%d/online", sibling);
	if (sibling)
		doctor_keep(finding, DOCTOR_TMPFILES, path, "0");
	if (!sibling)
		doctor_mend(finding, "another cpu in pokeysd.conf: core 0 cannot be switched off");
	else if (sibling < doctor->cpu)
		doctor_mend(finding, "echo 0 > %s", path);
	else
		doctor_mend(finding, "echo 0 > %s, or nosmt on the kernel command line", path);
}

static void judge_sibling(const struct doctor *doctor, struct doctor_finding *finding)
{
	char list[128], isolated[256];
	int sibling;

	if (!probe_text(doctor->root, list, sizeof(list),
			CORE "/cpu%d/topology/thread_siblings_list", doctor->cpu)) {
		doctor_say(finding, DOCTOR_UNKNOWN, "the siblings of core %d cannot be read",
			   doctor->cpu);
		return;
	}
	sibling = probe_list_other(list, doctor->cpu);
	probe_text(doctor->root, isolated, sizeof(isolated), CORE "/isolated");
	if (sibling < 0) {
		doctor_say(finding, DOCTOR_OK, "it shares its execution units with no other");
	} else if (probe_list_has(isolated, sibling)) {
		doctor_say(finding, DOCTOR_OK,
			   "its sibling %d is isolated as well: leave that "
			   "one empty",
			   sibling);
	} else {
		doctor_say(finding, DOCTOR_ADVICE,
			   "its sibling %d runs other programs on the same "
			   "execution units",
			   sibling);
		mend_sibling(doctor, finding, sibling);
	}
}

static const struct doctor_check checks[] = {
	{ "core", DOCTOR_MACHINE, judge_core },
	{ "isolcpus", DOCTOR_CORE, judge_isolated },
	{ "nohz-full", DOCTOR_CORE, judge_tick },
	{ "rcu-nocbs", DOCTOR_CORE, judge_callbacks },
	{ "smt-sibling", DOCTOR_CORE, judge_sibling },
};
const struct doctor_checks doctor_core_checks = { checks, sizeof(checks) / sizeof(checks[0]) };
