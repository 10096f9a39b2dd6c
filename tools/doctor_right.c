// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the daemon is permitted, and who else is realtime. Limits are those of
 * the running daemon; without one only those of whoever asks can be seen, which
 * a systemd unit overrides, so they are advice at most.
 *
 * mlockall() passes under a small limit and a later allocation fails: so the
 * limit itself is looked at, not whether memory is locked.
 */
#include <stdlib.h>
#include <string.h>
#include "tools/doctor.h"

enum { CAP_LOCK = 14, CAP_NICE = 23, ENOUGH_LOCKED_MIB = 256 };

/* The limits, and the capabilities, of the daemon or of ourselves. */
struct rights {
	char locked[64], priority[64];
	unsigned long long capabilities;
};

static bool read_rights(const struct doctor *doctor, struct rights *rights)
{
	char limits[PROBE_TEXT], status[PROBE_TEXT], who[16] = "self", value[64];

	memset(rights, 0, sizeof(*rights));
	if (doctor->daemon > 0)
		snprintf(who, sizeof(who), "%d", doctor->daemon);
	if (!probe_text(doctor->root, limits, sizeof(limits), "/proc/%s/limits", who) ||
	    !probe_line(limits, "Max locked memory", rights->locked, sizeof(rights->locked)) ||
	    !probe_line(limits, "Max realtime priority", rights->priority,
			sizeof(rights->priority)))
		return false;
	if (probe_text(doctor->root, status, sizeof(status), "/proc/%s/status", who) &&
	    probe_line(status, "CapEff", value, sizeof(value)))
		rights->capabilities = strtoull(value, NULL, 16);
	return true;
}

static void refuse(const struct doctor *doctor, struct doctor_finding *finding, const char *limit,
		   const char *value, const char *unit)
{
	bool runs = doctor->daemon > 0;

	doctor_say(finding, runs ? DOCTOR_PROBLEM : DOCTOR_ADVICE, "%s is permitted %s%s",
		   runs ? "pokeysd" : "whoever asks here (pokeysd does not run)", value, limit);
	doctor_mend(finding, "in the unit (systemctl edit pokeysd): %s", unit);
}

static void judge_memory(const struct doctor *doctor, struct doctor_finding *finding)
{
	struct rights rights;

	if (!read_rights(doctor, &rights))
		doctor_say(finding, DOCTOR_UNKNOWN, "the limits cannot be read");
	else if (rights.capabilities >> CAP_LOCK & 1)
		doctor_say(finding, DOCTOR_OK, "CAP_IPC_LOCK: all memory may be locked");
	else if (!strncmp(rights.locked, "unlimited", 9))
		doctor_say(finding, DOCTOR_OK, "unlimited");
	else if (strtoull(rights.locked, NULL, 10) >> 20 >= ENOUGH_LOCKED_MIB)
		doctor_say(finding, DOCTOR_OK, "%llu MiB", strtoull(rights.locked, NULL, 10) >> 20);
	else {
		snprintf(rights.locked, sizeof(rights.locked), "%llu",
			 strtoull(rights.locked, NULL, 10) >> 10);
		refuse(doctor, finding, " KiB of locked memory", rights.locked,
		       "LimitMEMLOCK=infinity");
	}
}

static void judge_priority(const struct doctor *doctor, struct doctor_finding *finding)
{
	struct rights rights;
	char wanted[48];

	snprintf(wanted, sizeof(wanted), " at most, not priority = %d", doctor->plan.priority);
	if (!read_rights(doctor, &rights)) {
		doctor_say(finding, DOCTOR_UNKNOWN, "the limits cannot be read");
	} else if (rights.capabilities >> CAP_NICE & 1) {
		doctor_say(finding, DOCTOR_OK, "CAP_SYS_NICE: any priority");
	} else if (atoi(rights.priority) >= doctor->plan.priority) {
		doctor_say(finding, DOCTOR_OK, "up to %d", atoi(rights.priority));
	} else if (atoi(rights.priority) > 0) {
		rights.priority[strcspn(rights.priority, " ")] = '\0'; /* soft and hard */
		refuse(doctor, finding, wanted, rights.priority, "LimitRTPRIO=98");
	} else {
		refuse(doctor, finding, "no realtime priority", "",
		       "LimitRTPRIO=98 and AmbientCapabilities=CAP_SYS_NICE");
	}
}

static void judge_thread(const struct doctor *doctor, struct doctor_finding *finding)
{
	struct probe_thread thread;

	if (doctor->daemon <= 0)
		doctor_say(finding, DOCTOR_UNKNOWN, "no pokeysd is seen in /proc");
	else if (!probe_realtime_thread(doctor->root, doctor->daemon, &thread))
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/%d/task cannot be read", doctor->daemon);
	else if (!thread.priority)
		doctor_say(finding, DOCTOR_PROBLEM, "pokeysd (%d) has no realtime thread",
			   doctor->daemon);
	else if (doctor->plan.cpu >= 0 && (!probe_list_has(thread.cores, doctor->plan.cpu) ||
					   probe_list_other(thread.cores, doctor->plan.cpu) >= 0))
		doctor_say(finding, DOCTOR_PROBLEM,
			   "priority %d on core %s, but pokeysd.conf says "
			   "cpu = %d",
			   thread.priority, thread.cores, doctor->plan.cpu);
	else
		doctor_say(finding, DOCTOR_OK, "priority %d on core %s", thread.priority,
			   thread.cores);
	if (finding->verdict == DOCTOR_PROBLEM)
		doctor_mend(finding, "systemctl restart pokeysd, then journalctl -u pokeysd");
}

static void judge_hal(const struct doctor *doctor, struct doctor_finding *finding)
{
	struct probe_thread thread;

	if (doctor->hal <= 0) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "LinuxCNC does not run (there is no "
			   "rtapi_app)");
	} else if (!probe_realtime_thread(doctor->root, doctor->hal, &thread)) {
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/%d/task cannot be read", doctor->hal);
	} else if (!thread.priority) {
		doctor_say(finding, DOCTOR_PROBLEM, "LinuxCNC runs without realtime threads");
		doctor_mend(finding, "boot a PREEMPT_RT kernel; rtapi_app has to be setuid root");
	} else if (doctor->cpu < 0) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "core %s, priority %d; none is chosen for "
			   "pokeysd",
			   thread.cores, thread.priority);
	} else if (probe_list_has(thread.cores, doctor->cpu)) {
		doctor_say(finding, doctor->plan.spin ? DOCTOR_PROBLEM : DOCTOR_ADVICE,
			   "the servo thread (priority %d) runs on core %s as well and comes "
			   "first",
			   thread.priority, thread.cores);
		doctor_mend(finding, "another cpu in pokeysd.conf; LinuxCNC takes the isolated "
				     "core of the highest number");
	} else {
		doctor_say(finding, DOCTOR_OK, "the servo thread has core %s, priority %d",
			   thread.cores, thread.priority);
	}
}

static const struct doctor_check checks[] = {
	{ "memory-lock", DOCTOR_MACHINE, judge_memory },
	{ "priority", DOCTOR_MACHINE, judge_priority },
	{ "daemon-thread", DOCTOR_MACHINE, judge_thread },
	{ "linuxcnc-core", DOCTOR_MACHINE, judge_hal },
};
const struct doctor_checks doctor_right_checks = { checks, sizeof(checks) / sizeof(checks[0]) };
