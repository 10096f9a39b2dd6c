// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What saves power and costs time: a core that sleeps deeply needs hundreds of
 * microseconds to be there again, one that was slowed down works slowly at
 * first.
 *
 * /dev/cpu_dma_latency holds both off while somebody keeps it open. Its value
 * is not for everybody to read, nor who has it open; without that right the
 * answer is "unknown" unless there is nothing to hold off.
 */
#include <string.h>
#include "tools/doctor.h"

#define CORE "/sys/devices/system/cpu"

enum { IDLE_STATES = 16, LATE_US = 10, NOBODY_US = 2000000000 };

/* Deepest state that is not switched off: its exit latency in us, -1 if there are no states. */
static long deepest(const char *root, int cpu, char *name, size_t size)
{
	long worst = -1;

	for (int i = 0; i < IDLE_STATES; i++) {
		long latency, disabled = 0;

		if (!probe_number(root, &latency, CORE "/cpu%d/cpuidle/state%d/latency", cpu, i))
			break;
		probe_number(root, &disabled, CORE "/cpu%d/cpuidle/state%d/disable", cpu, i);
		if (disabled || latency < worst)
			continue;
		worst = latency;
		probe_text(root, name, size, CORE "/cpu%d/cpuidle/state%d/name", cpu, i);
	}
	return worst;
}

/* The latency that somebody asked for, us; -1 if it cannot be seen. */
static long asked_latency(const struct doctor *doctor)
{
	char path[512];
	int32_t value;
	FILE *from;

	snprintf(path, sizeof(path), "%s/dev/cpu_dma_latency", doctor->root);
	from = fopen(path, "re");
	if (!from)
		return -1;
	if (fread(&value, sizeof(value), 1, from) != 1)
		value = -1;
	fclose(from);
	return value;
}

static void judge_latency(const struct doctor *doctor, struct doctor_finding *finding)
{
	char holders[128];
	unsigned int count = probe_holders(doctor->root, "/dev/cpu_dma_latency", holders,
					   sizeof(holders));
	long value = asked_latency(doctor);

	if (value >= 0 && value < NOBODY_US) {
		doctor_say(finding, value <= LATE_US ? DOCTOR_OK : DOCTOR_ADVICE,
			   "held at %ld us by %s", value, count ? holders : "somebody not shown");
	} else if (value < 0 && count) {
		doctor_say(finding, DOCTOR_OK, "held by %s (at how much may only root read)",
			   holders);
	} else if (value < 0) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "/dev/cpu_dma_latency and who has it open may "
			   "only root see");
		doctor_mend(finding, "sudo pokeysctl doctor");
		return;
	} else {
		doctor_say(finding, DOCTOR_ADVICE, "%s%s, so idle states are not held off",
			   count ? holders : "nobody holds it",
			   count ? " has it open and asks for nothing" : "");
	}
	if (finding->verdict == DOCTOR_ADVICE)
		doctor_mend(finding, "start pokeysd, which holds it; if it says that it may not: "
				     "install systemd/70-pokeysd.rules in /etc/udev/rules.d");
}

static void judge_idle(const struct doctor *doctor, struct doctor_finding *finding)
{
	char name[32] = "?", holders[128];
	long value, latency;

	if (!probe_text(doctor->root, holders, sizeof(holders), CORE "/online")) {
		doctor_say(finding, DOCTOR_UNKNOWN, CORE " cannot be read");
		return;
	}
	latency = deepest(doctor->root, doctor->cpu, name, sizeof(name));
	value = asked_latency(doctor);
	if (latency < 0)
		doctor_say(finding, DOCTOR_OK,
			   "this kernel manages no idle states on core %d "
			   "(a virtual machine, or idle=poll)",
			   doctor->cpu);
	else if (latency <= LATE_US)
		doctor_say(finding, DOCTOR_OK, "its deepest idle state %s wakes up in %ld us", name,
			   latency);
	/* who holds it counts only where it cannot be seen at how much: that may be too much */
	else if (value >= 0 ? value < latency :
			      probe_holders(doctor->root, "/dev/cpu_dma_latency", holders,
					    sizeof(holders)) > 0)
		doctor_say(finding, DOCTOR_OK, "%s (%ld us) is held off by /dev/cpu_dma_latency",
			   name, latency);
	else if (value < 0)
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "%s takes %ld us to wake up from; whether it "
			   "is held off may only root see",
			   name, latency);
	else
		doctor_say(finding, DOCTOR_ADVICE, "%s takes %ld us to wake up from", name,
			   latency);
	if (finding->verdict == DOCTOR_ADVICE)
		doctor_mend(finding,
			    "start pokeysd (it holds /dev/cpu_dma_latency), or "
			    "intel_idle.max_cstate=1 processor.max_cstate=1 on the kernel command "
			    "line");
}

static void judge_governor(const struct doctor *doctor, struct doctor_finding *finding)
{
	char governor[64], path[80];

	if (!probe_text(doctor->root, governor, sizeof(governor), CORE "/online")) {
		doctor_say(finding, DOCTOR_UNKNOWN, CORE " cannot be read");
	} else if (!probe_text(doctor->root, governor, sizeof(governor),
			       CORE "/cpu%d/cpufreq/scaling_governor", doctor->cpu)) {
		doctor_say(finding, DOCTOR_OK,
			   "this kernel does not change the frequency of core "
			   "%d",
			   doctor->cpu);
	} else if (!strcmp(governor, "performance")) {
		doctor_say(finding, DOCTOR_OK, "performance");
	} else {
		doctor_say(finding, DOCTOR_ADVICE, "%s lets core %d become slow between cycles",
			   governor, doctor->cpu);
		snprintf(path, sizeof(path), CORE "/cpu%d/cpufreq/scaling_governor", doctor->cpu);
		doctor_mend(finding, "echo performance > %s", path);
		doctor_keep(finding, DOCTOR_TMPFILES, path, "performance");
	}
}

static const struct doctor_check checks[] = {
	{ "dma-latency", DOCTOR_MACHINE, judge_latency },
	{ "idle-states", DOCTOR_CORE, judge_idle },
	{ "governor", DOCTOR_CORE, judge_governor },
};
const struct doctor_checks doctor_power_checks = { checks, sizeof(checks) / sizeof(checks[0]) };
