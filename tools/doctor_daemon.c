// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the running daemon says of itself in shared memory. Everything before
 * it is a cause; these are the effects, and the ones that count: a machine with
 * ten pieces of advice and no cycle skipped is a good machine.
 *
 * Counters run since the daemon began. Faults and skipped cycles of its first
 * moments are among them, so a few are advice and not a problem.
 */
#include <string.h>
#include "tools/doctor.h"
#include "tools/print.h"

/* One in so many cycles skipped is a problem. */
enum { SKIPPED_IN = 10000 };

static bool unseen(struct doctor_finding *finding, bool wants_diag)
{
	const struct view_device *seen = finding->seen;

	if (!seen)
		doctor_say(finding, DOCTOR_UNKNOWN, "no shared memory of a daemon was seen");
	else if (seen->freshness == VIEW_NONE)
		doctor_say(finding, DOCTOR_UNKNOWN, "%s", seen->why);
	else if (wants_diag && !seen->has_diag)
		doctor_say(finding, DOCTOR_UNKNOWN, "it has no diagnostic image");
	else
		return false;
	return true;
}

static void judge_publishing(const struct doctor *doctor, struct doctor_finding *finding)
{
	if (!finding->seen && doctor->hidden) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "this user may not read its data: it is not "
			   "judged how it does");
		doctor_mend(finding, "sudo pokeysctl doctor, or sudo adduser YOU pokeys-monitor "
				     "and log in again");
	} else if (!finding->seen) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "no daemon was seen: it is not judged how it "
			   "does");
		doctor_mend(finding, "systemctl start pokeysd, or --runtime-directory");
	} else if (finding->seen->freshness == VIEW_FRESH) {
		doctor_say(finding, DOCTOR_OK, "publishes, the device's data is fresh");
	} else if (finding->seen->freshness == VIEW_NONE) {
		doctor_say(finding, DOCTOR_UNKNOWN, "%s", finding->seen->why);
	} else {
		doctor_say(finding, DOCTOR_PROBLEM, "%s", finding->seen->why);
		doctor_mend(finding,
			    finding->seen->freshness == VIEW_DEAD ? "systemctl start pokeysd" :
								    "pokeysctl status %s",
			    finding->seen->name);
	}
}

static void judge_realtime(const struct doctor *doctor, struct doctor_finding *finding)
{
	(void)doctor;
	if (unseen(finding, false))
		return;
	if (finding->seen->state.flags & POKEYS_STATE_REALTIME) {
		doctor_say(finding, DOCTOR_OK, "SCHED_FIFO and locked memory");
		return;
	}
	doctor_say(finding, DOCTOR_PROBLEM, "runs without realtime priority or locked memory");
	doctor_mend(finding, "journalctl -u pokeysd says what was refused; see the checks "
			     "memory-lock and priority");
}

static void judge_transport(const struct doctor *doctor, struct doctor_finding *finding)
{
	char name[32];
	long disabled;

	if (unseen(finding, true))
		return;
	print_clean(finding->seen->diag.transport, sizeof(finding->seen->diag.transport), name);
	if (!(finding->seen->state.flags & POKEYS_STATE_FALLBACK)) {
		doctor_say(finding, DOCTOR_OK, "%s", name);
		return;
	}
	if (!strcmp(name, "io_uring")) {
		doctor_say(finding, DOCTOR_ADVICE, "io_uring instead of AF_XDP");
		doctor_mend(finding,
			    "journalctl -u pokeysd says why; pokeys-guard has to run first. A card "
			    "that has no XDP: transport = auto");
		return;
	}
	if (!probe_number(doctor->root, &disabled, "/proc/sys/kernel/io_uring_disabled"))
		disabled = -1;
	doctor_say(finding, DOCTOR_ADVICE, "%s instead of io_uring: more system calls a cycle%s",
		   name, disabled > 0 ? " (kernel.io_uring_disabled is set)" : "");
	doctor_mend(finding, disabled > 0 ? "sysctl -w kernel.io_uring_disabled=0" :
					    "a kernel from 6.1 on; journalctl -u pokeysd says why");
	if (disabled > 0)
		doctor_keep(finding, DOCTOR_SYSCTL, "kernel.io_uring_disabled=0");
}

static void judge_faults(const struct doctor *doctor, struct doctor_finding *finding)
{
	const struct pokeys_diag *diag;

	(void)doctor;
	if (unseen(finding, true))
		return;
	diag = &finding->seen->diag;
	if (!diag->major_faults && !diag->minor_faults) {
		doctor_say(finding, DOCTOR_OK, "none in the realtime thread");
		return;
	}
	doctor_say(finding, diag->major_faults ? DOCTOR_PROBLEM : DOCTOR_ADVICE,
		   "%llu major and %llu minor ones in the realtime thread",
		   (unsigned long long)diag->major_faults, (unsigned long long)diag->minor_faults);
	doctor_mend(finding, "lock its memory: see the check memory-lock");
}

static void judge_cycles(const struct doctor *doctor, struct doctor_finding *finding)
{
	unsigned long long skipped, cycles;

	(void)doctor;
	if (unseen(finding, true))
		return;
	skipped = finding->seen->diag.cycles_skipped;
	cycles = finding->seen->diag.cycle;
	if (!skipped) {
		doctor_say(finding, DOCTOR_OK, "none of %llu skipped", cycles);
		return;
	}
	doctor_say(finding, skipped >= cycles / SKIPPED_IN + 1 ? DOCTOR_PROBLEM : DOCTOR_ADVICE,
		   "%llu skipped, %llu done", skipped, cycles);
	doctor_mend(finding, "what else is said here; then pokeysctl latency");
}

static const struct doctor_check checks[] = {
	{ "daemon", DOCTOR_DAEMON, judge_publishing },
	{ "daemon-realtime", DOCTOR_DAEMON, judge_realtime },
	{ "daemon-transport", DOCTOR_DAEMON, judge_transport },
	{ "daemon-faults", DOCTOR_DAEMON, judge_faults },
	{ "daemon-cycles", DOCTOR_DAEMON, judge_cycles },
};
const struct doctor_checks doctor_daemon_checks = { checks, sizeof(checks) / sizeof(checks[0]) };
