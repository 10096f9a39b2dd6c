// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the kernel is and how it treats realtime threads and timers, the same on
 * every core.
 *
 * A kernel without PREEMPT_RT is a problem and no advice: on an idle machine it
 * looks as good as the other, and then a driver holds a spindle's data up for
 * milliseconds. Throttling is judged by what the daemon wants to do: a thread
 * that sleeps between packets is never near the limit, one that spins may be.
 */
#include <string.h>
#include "tools/doctor.h"

/* less a rounding error: 0.95 - 0.05 is not quite 0.9 */
#define RESERVE 0.0499999

static void judge_kernel(const struct doctor *doctor, struct doctor_finding *finding)
{
	char version[512], release[64] = "?";
	long realtime = 0;

	if (!probe_text(doctor->root, version, sizeof(version), "/proc/version")) {
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/version cannot be read");
		return;
	}
	sscanf(version, "Linux version %63s", release);
	probe_number(doctor->root, &realtime, "/sys/kernel/realtime");
	if (realtime == 1 || strstr(version, "PREEMPT_RT") || strstr(version, "PREEMPT RT")) {
		doctor_say(finding, DOCTOR_OK, "%s is PREEMPT_RT", release);
		return;
	}
	doctor_say(finding, DOCTOR_PROBLEM,
		   "%s is not PREEMPT_RT: any driver may hold a realtime "
		   "thread up for milliseconds",
		   release);
	doctor_mend(finding, "apt install linux-image-rt-amd64, then boot it");
}

static void judge_virtual(const struct doctor *doctor, struct doctor_finding *finding)
{
	int is_virtual = probe_virtual(doctor->root);

	if (is_virtual < 0) {
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/cpuinfo cannot be read");
	} else if (is_virtual) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "a virtual machine: its host takes cores away "
			   "whenever it likes; not for a machine that moves");
		doctor_mend(finding, "run on the hardware itself");
	} else {
		doctor_say(finding, DOCTOR_OK, "no sign of a virtual machine");
	}
}

/* pokeysd leaves the kernel 5 % of a period more than it has to. */
static void judge_spinning(const struct doctor *doctor, struct doctor_finding *finding, double part)
{
	if (doctor->plan.duty <= part - RESERVE) {
		doctor_say(finding, DOCTOR_OK,
			   "realtime threads get %.0f %% of the time, duty = "
			   "%g fits in",
			   part * 100, doctor->plan.duty);
		return;
	}
	doctor_say(finding, DOCTOR_ADVICE,
		   "realtime threads get %.0f %% of the time, so pokeysd "
		   "spins less than duty = %g",
		   part * 100, doctor->plan.duty);
	doctor_mend(finding, "sysctl -w kernel.sched_rt_runtime_us=-1 (only with an isolated "
			     "core), or a lower duty");
	doctor_keep(finding, DOCTOR_SYSCTL, "kernel.sched_rt_runtime_us=-1");
}

static void judge_throttling(const struct doctor *doctor, struct doctor_finding *finding)
{
	long runtime, period;

	if (!probe_number(doctor->root, &runtime, "/proc/sys/kernel/sched_rt_runtime_us") ||
	    !probe_number(doctor->root, &period, "/proc/sys/kernel/sched_rt_period_us") ||
	    period <= 0) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "/proc/sys/kernel/sched_rt_runtime_us cannot "
			   "be read");
	} else if (runtime == 0) {
		doctor_say(finding, DOCTOR_PROBLEM,
			   "realtime threads get no time at all "
			   "(kernel.sched_rt_runtime_us = 0)");
		doctor_mend(finding, "sysctl -w kernel.sched_rt_runtime_us=950000");
		doctor_keep(finding, DOCTOR_SYSCTL, "kernel.sched_rt_runtime_us=950000");
	} else if (runtime < 0) {
		doctor_say(finding, DOCTOR_OK,
			   "off: a realtime thread that never sleeps is not "
			   "stopped, and can lock up its core");
	} else if (doctor->plan.spin) {
		judge_spinning(doctor, finding, (double)runtime / (double)period);
	} else {
		doctor_say(finding, DOCTOR_OK, "%ld of %ld us; in mode sleep pokeysd is far below",
			   runtime, period);
	}
}

static void judge_timers(const struct doctor *doctor, struct doctor_finding *finding)
{
	long on;

	if (!probe_number(doctor->root, &on, "/proc/sys/kernel/timer_migration")) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "/proc/sys/kernel/timer_migration cannot be "
			   "read");
	} else if (on) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "timers of idle cores go to others, which has "
			   "made wake-ups of a nohz_full core hundreds of microseconds late");
		doctor_mend(finding, "sysctl -w kernel.timer_migration=0");
		doctor_keep(finding, DOCTOR_SYSCTL, "kernel.timer_migration=0");
	} else {
		doctor_say(finding, DOCTOR_OK, "timers stay on their core");
	}
}

static void judge_balancer(const struct doctor *doctor, struct doctor_finding *finding)
{
	char isolated[256] = "", tickless[256] = "";

	probe_text(doctor->root, isolated, sizeof(isolated), "/sys/devices/system/cpu/isolated");
	probe_text(doctor->root, tickless, sizeof(tickless), "/sys/devices/system/cpu/nohz_full");
	if (doctor->balancer < 0) {
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc cannot be read");
	} else if (doctor->balancer && doctor->cpu >= 0 &&
		   (probe_list_has(isolated, doctor->cpu) ||
		    probe_list_has(tickless, doctor->cpu))) {
		doctor_say(finding, DOCTOR_OK,
			   "irqbalance runs, and leaves isolated cores alone "
			   "unless /etc/default/irqbalance says otherwise");
	} else if (doctor->balancer) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "irqbalance runs and moves interrupts, also "
			   "those that you have pinned");
		doctor_mend(finding, "systemctl disable --now irqbalance, or ban the core in "
				     "/etc/default/irqbalance");
	} else {
		doctor_say(finding, DOCTOR_OK, "no irqbalance runs");
	}
}

static const struct doctor_check checks[] = {
	{ "kernel", DOCTOR_MACHINE, judge_kernel },
	{ "virtual", DOCTOR_MACHINE, judge_virtual },
	{ "throttling", DOCTOR_MACHINE, judge_throttling },
	{ "timer-migration", DOCTOR_MACHINE, judge_timers },
	{ "irqbalance", DOCTOR_MACHINE, judge_balancer },
};
const struct doctor_checks doctor_kernel_checks = { checks, sizeof(checks) / sizeof(checks[0]) };
