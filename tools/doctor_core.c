// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The core that the realtime thread is for. Isolation is three settings of the
 * kernel's command line that are easily set for three different cores, or for
 * another one than pokeysd.conf names, so each is held against the same core.
 *
 * Spinning on a core that is not isolated starves whatever else the scheduler
 * put there: a problem. Sleeping on it is only worse than it could be.
 */
#include <string.h>
#include "tools/doctor.h"

#define CORE "/sys/devices/system/cpu"

static void judge_core(const struct doctor *doctor, struct doctor_finding *finding)
{
	char online[256];

	if (doctor->cpu < 0) {
		doctor_say(finding, DOCTOR_ADVICE, "no core is chosen for the realtime thread "
			   "(%s), so the scheduler moves it",
			   doctor->plan.read ? "cpu = any" : "pokeysd.conf was not read");
		doctor_mend(finding, "cpu = N under [daemon] in pokeysd.conf, or here --cpu N");
	} else if (!probe_text(doctor->root, online, sizeof(online), CORE "/online")) {
		doctor_say(finding, DOCTOR_UNKNOWN, CORE "/online cannot be read");
	} else if (!probe_list_has(online, doctor->cpu)) {
		doctor_say(finding, DOCTOR_PROBLEM, "core %d is not there; online are %s",
			   doctor->cpu, online);
		doctor_mend(finding, "another cpu in pokeysd.conf, or echo 1 > " CORE
			    "/cpu%d/online", doctor->cpu);
	} else {
		doctor_say(finding, DOCTOR_OK, "core %d of %s", doctor->cpu, online);
	}
}

/* The mending of all three is one line of the boot loader's. */
static void mend_command_line(const struct doctor *doctor, struct doctor_finding *finding)
{
	doctor_mend(finding, "kernel command line (GRUB_CMDLINE_LINUX in /etc/default/grub, then "
		    "update-grub): isolcpus=managed_irq,domain,%d nohz_full=%d rcu_nocbs=%d",
		    doctor->cpu, doctor->cpu, doctor->cpu);
}

static void judge_isolated(const struct doctor *doctor, struct doctor_finding *finding)
{
	char list[256];

	if (!probe_text(doctor->root, list, sizeof(list), CORE "/isolated")) {
		doctor_say(finding, DOCTOR_UNKNOWN, CORE "/isolated cannot be read");
	} else if (probe_list_has(list, doctor->cpu)) {
		doctor_say(finding, DOCTOR_OK, "isolated are %s", list);
	} else {
		doctor_say(finding, doctor->plan.spin ? DOCTOR_PROBLEM : DOCTOR_ADVICE,
			   "isolated %s%s: other programs run on core %d as well%s",
			   *list ? "are " : "is no core", list, doctor->cpu,
			   doctor->plan.spin ? ", and mode = spin starves them" : "");
		mend_command_line(doctor, finding);
	}
}

static void judge_tick(const struct doctor *doctor, struct doctor_finding *finding)
{
	char list[256];

	if (!probe_text(doctor->root, list, sizeof(list), CORE "/nohz_full")) {
		doctor_say(finding, DOCTOR_UNKNOWN, CORE "/nohz_full cannot be read (a kernel "
			   "without CONFIG_NO_HZ_FULL has none)");
	} else if (probe_list_has(list, doctor->cpu)) {
		doctor_say(finding, DOCTOR_OK, "without a tick are %s", list);
	} else {
		doctor_say(finding, DOCTOR_ADVICE, "the scheduler's tick interrupts core %d",
			   doctor->cpu);
		mend_command_line(doctor, finding);
	}
}

/* nohz_full= implies it, and without a list it means every core. */
static void judge_callbacks(const struct doctor *doctor, struct doctor_finding *finding)
{
	char line[64], list[256];
	bool has;

	if (!probe_text(doctor->root, line, sizeof(line), "/proc/cmdline")) {
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/cmdline cannot be read");
		return;
	}
	has = probe_command_line(doctor->root, "rcu_nocbs", list, sizeof(list)) &&
	      (!*list || !strcmp(list, "all") || probe_list_has(list, doctor->cpu));
	has = has || (probe_text(doctor->root, list, sizeof(list), CORE "/nohz_full") &&
		      probe_list_has(list, doctor->cpu));
	if (has) {
		doctor_say(finding, DOCTOR_OK, "RCU callbacks run on other cores");
		return;
	}
	doctor_say(finding, DOCTOR_ADVICE, "RCU callbacks run on core %d", doctor->cpu);
	mend_command_line(doctor, finding);
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
		doctor_say(finding, DOCTOR_OK, "its sibling %d is isolated as well: leave that "
			   "one empty", sibling);
	} else {
		doctor_say(finding, DOCTOR_ADVICE, "its sibling %d runs other programs on the same "
			   "execution units", sibling);
		doctor_mend(finding, "echo 0 > " CORE "/cpu%d/online, or nosmt on the kernel "
			    "command line", sibling);
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
