// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The table of all checks, walked: what is of the machine once, what is of a
 * network interface once for each that leads to a device, what is of a device
 * for each. A check that has nothing to look at still says so: a line that is
 * missing would be read as "in order".
 */
#include <stdarg.h>
#include <string.h>
#include "tools/doctor.h"
#include "usage/printable.h"

static const struct doctor_checks *const tables[] = {
	&doctor_kernel_checks,    &doctor_core_checks, &doctor_power_checks,
	&doctor_interrupt_checks, &doctor_nic_checks,  &doctor_right_checks,
	&doctor_daemon_checks,
};

enum { TABLES = sizeof(tables) / sizeof(tables[0]) };

void doctor_say(struct doctor_finding *finding, enum doctor_verdict verdict, const char *why, ...)
{
	va_list arguments;

	finding->verdict = verdict;
	va_start(arguments, why);
	vsnprintf(finding->why, sizeof(finding->why), why, arguments);
	va_end(arguments);
	usage_printable(finding->why);
}

void doctor_mend(struct doctor_finding *finding, const char *mend, ...)
{
	va_list arguments;

	va_start(arguments, mend);
	vsnprintf(finding->mend, sizeof(finding->mend), mend, arguments);
	va_end(arguments);
	usage_printable(finding->mend);
}

void doctor_keep(struct doctor_finding *finding, const char *keep, ...)
{
	va_list arguments;

	va_start(arguments, keep);
	vsnprintf(finding->keep, sizeof(finding->keep), keep, arguments);
	va_end(arguments);
	usage_printable(finding->keep);
}

const char *doctor_verdict_name(enum doctor_verdict verdict)
{
	static const char *const names[] = { "ok", "advice", "problem", "unknown" };

	return names[verdict];
}

unsigned int doctor_count(const struct doctor_report *report, enum doctor_verdict verdict)
{
	unsigned int count = 0;

	for (size_t i = 0; i < report->count; i++)
		count += report->finding[i].verdict == verdict;
	return count;
}

/* The next finding, empty; NULL when there is room for no more. */
static struct doctor_finding *next(struct doctor_report *report, const struct doctor_check *check,
				   const char *subject)
{
	struct doctor_finding *finding;

	if (report->count == DOCTOR_FINDINGS)
		return NULL;
	finding = &report->finding[report->count++];
	memset(finding, 0, sizeof(*finding));
	finding->check = check->name;
	snprintf(finding->subject, sizeof(finding->subject), "%s", subject);
	return finding;
}

static void judge_core(const struct doctor *doctor, const struct doctor_check *check,
		       struct doctor_report *report)
{
	char subject[16] = "";
	struct doctor_finding *finding;

	if (doctor->cpu >= 0)
		snprintf(subject, sizeof(subject), "core %d", doctor->cpu);
	finding = next(report, check, subject);
	if (!finding)
		return;
	if (doctor->cpu < 0)
		doctor_say(finding, DOCTOR_UNKNOWN, "no core is chosen, see the check core");
	else if (doctor_core_is_absent(doctor))
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "this core does not exist or is offline, see the check core");
	else
		check->judge(doctor, finding);
}

static bool earlier_has(const struct doctor *doctor, size_t index)
{
	for (size_t i = 0; i < index; i++)
		if (!strcmp(doctor->device[i].nic, doctor->device[index].nic))
			return true;
	return false;
}

static void judge_nics(const struct doctor *doctor, const struct doctor_check *check,
		       struct doctor_report *report)
{
	struct doctor_finding *finding;
	unsigned int count = 0;
	struct nic nic;

	for (size_t i = 0; i < doctor->devices; i++) {
		if (!*doctor->device[i].nic || earlier_has(doctor, i))
			continue;
		count++;
		finding = next(report, check, doctor->device[i].nic);
		if (!finding)
			return;
		nic_read(doctor->root, doctor->device[i].nic, &nic);
		finding->nic = &nic;
		check->judge(doctor, finding);
		finding->nic = NULL;
	}
	finding = count ? NULL : next(report, check, "");
	if (finding)
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "no interface is known to lead to a device, "
			   "see the check route");
}

static void judge_devices(const struct doctor *doctor, const struct doctor_check *check,
			  struct doctor_report *report)
{
	struct doctor_finding *finding;

	for (size_t i = 0; i < doctor->devices; i++) {
		finding = next(report, check, doctor->device[i].name);
		if (!finding)
			return;
		finding->device = &doctor->device[i];
		check->judge(doctor, finding);
	}
	finding = doctor->devices ? NULL : next(report, check, "");
	if (finding)
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "no device is known (%s, and no daemon was "
			   "seen)",
			   doctor->plan.read ? "none is configured" : "pokeysd.conf was not read");
}

static void judge_daemon(const struct doctor *doctor, const struct doctor_check *check,
			 struct doctor_report *report)
{
	struct doctor_finding *finding;

	for (size_t i = 0; i < doctor->view.count; i++) {
		finding = next(report, check, doctor->view.device[i].name);
		if (!finding)
			return;
		finding->seen = &doctor->view.device[i];
		check->judge(doctor, finding);
	}
	finding = doctor->view.count ? NULL : next(report, check, "");
	if (finding)
		check->judge(doctor, finding);
}

static void judge_machine(const struct doctor *doctor, const struct doctor_check *check,
			  struct doctor_report *report)
{
	struct doctor_finding *finding = next(report, check, "");

	if (finding)
		check->judge(doctor, finding);
}

void doctor_judge(const struct doctor *doctor, struct doctor_report *report)
{
	static void (*const walk[])(const struct doctor *, const struct doctor_check *,
				    struct doctor_report *) = {
		[DOCTOR_MACHINE] = judge_machine, [DOCTOR_CORE] = judge_core,
		[DOCTOR_NIC] = judge_nics,        [DOCTOR_DEVICE] = judge_devices,
		[DOCTOR_DAEMON] = judge_daemon,
	};

	report->count = 0;
	for (size_t t = 0; t < TABLES; t++)
		for (size_t i = 0; i < tables[t]->count; i++)
			walk[tables[t]->check[i].scope](doctor, &tables[t]->check[i], report);
}
