// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl doctor --fix shows the files that it would write, asks, and writes them; --undo shows
 * which of them are there, asks, and removes them. Neither does anything while a machine, a motor
 * or a heater is on: what is written to the kernel takes effect at once.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <pokeys/names.h>
#include "tools/doctor_fix.h"

enum { CHECKS = 80 };

bool fix_is_bad(const struct doctor_finding *finding)
{
	return finding->verdict == DOCTOR_ADVICE || finding->verdict == DOCTOR_PROBLEM;
}

bool fix_is_wanted(const struct doctor_report *report, const char *check)
{
	for (size_t i = 0; i < report->count; i++)
		if (!strcmp(report->finding[i].check, check) && fix_is_bad(&report->finding[i]))
			return true;
	return false;
}

bool fix_mends(const struct fix_plan *plan, const char *check)
{
	for (size_t i = 0; i < plan->changes; i++)
		for (size_t c = 0; c < FIX_CHECKS && plan->change[i].row->check[c]; c++)
			if (!strcmp(plan->change[i].row->check[c], check))
				return true;
	return false;
}

/* A file of that name that somebody else has written stays as it is. */
static bool is_somebody_elses(const struct doctor *doctor, const struct fix_row *row,
			      char why_not[FIX_LINE])
{
	char path[FIX_PATH];

	fix_path(doctor, row, path);
	if (access(path, F_OK) || fix_is_ours(doctor, row))
		return false;
	snprintf(why_not, FIX_LINE, "%s is there, and was not written by this command", path);
	return true;
}

void fix_make_plan(struct fix_plan *plan)
{
	plan->changes = 0;
	for (size_t i = 0; i < fix_row_count; i++) {
		struct fix_change *change = &plan->change[plan->changes];

		memset(change, 0, sizeof(*change));
		plan->left[i][0] = '\0';
		change->row = &fix_rows[i];
		if (!fix_rows[i].build(plan, change, plan->left[i]) ||
		    is_somebody_elses(plan->doctor, change->row, plan->left[i]))
			continue;
		fix_compare(plan->doctor, change);
		plan->changes++;
	}
}

/* What would be stopped or held up, NULL if nothing is on. */
static const char *what_is_on(const struct doctor *doctor)
{
	const char *on = NULL;

	for (size_t i = 0; i < doctor->view.count && !on; i++)
		if (doctor->view.device[i].freshness == VIEW_FRESH)
			on = pokeys_what_is_on(&doctor->view.device[i].state);
	return on;
}

static bool is_all_off(struct doctor *doctor)
{
	const char *on;

	if (doctor->view.count)
		view_read(&doctor->view);
	on = what_is_on(doctor);
	if (on)
		complain("nothing was changed, with %s on; switch it off first, because a change "
			 "to the kernel may disturb it",
			 on);
	return !on;
}

/* True if the command may continue. Without a terminal, it continues only with --yes. */
static bool may_go_on(struct doctor *doctor, const struct options *options, const char *question)
{
	char answer[16] = "";

	if (!is_all_off(doctor))
		return false;
	if (options->yes)
		return true;
	if (!isatty(STDIN_FILENO)) {
		complain("nothing was changed: there is no terminal for the question; use --yes "
			 "to skip it");
		return false;
	}
	printf("%s [y/N] ", question);
	fflush(stdout);
	if (fgets(answer, sizeof(answer), stdin) && (*answer == 'y' || *answer == 'Y'))
		return is_all_off(doctor); /* the question may have waited for long */
	puts("nothing was changed");
	return false;
}

/*
 * Run a program; its output goes to the terminal. Its exit status, 127 if it cannot be executed,
 * 128 if a signal ended it, or -errno.
 */
static int run(const char *program)
{
	int status;
	pid_t child;

	printf("running %s\n", program);
	fflush(stdout);
	child = fork();
	if (!child) {
		execl(program, program, (char *)NULL);
		_exit(127);
	}
	if (child < 0 || waitpid(child, &status, 0) < 0)
		return -errno;
	return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

/* Run update-grub if the command line has changed, and print what the user has to do next. */
static bool conclude(const struct doctor *doctor, unsigned int kinds)
{
	bool good = true;

	if (kinds & 1u << FIX_KERNEL && *doctor->root) {
		puts("now run update-grub on that computer, and restart it");
	} else if (kinds & 1u << FIX_KERNEL) {
		good = run(FIX_UPDATE_GRUB) == 0;
		if (good)
			puts("restart the computer: the new kernel command line takes effect at "
			     "the next boot");
		else
			complain("update-grub failed, so the next boot has the old command line; "
				 "run it yourself when its fault is corrected");
	}
	if (kinds & 1u << FIX_CONF)
		puts("restart the daemon: systemctl restart pokeysd");
	return good;
}

/* "isolcpus, nohz-full, rcu-nocbs" */
static const char *checks_of(const struct fix_row *row, char checks[CHECKS])
{
	size_t at = 0;

	for (size_t i = 0; i < FIX_CHECKS && row->check[i] && at < CHECKS; i++)
		at += (size_t)snprintf(checks + at, CHECKS - at, "%s%s", i ? ", " : "",
				       row->check[i]);
	return checks;
}

/* The file is missing or says something else, or what it sets is not in effect. */
static bool is_to_do(const struct fix_change *change)
{
	return !change->is_there || change->differs;
}

static void show_change(const struct fix_plan *plan, const struct fix_change *change)
{
	char path[FIX_PATH], checks[CHECKS];

	fix_path(plan->doctor, change->row, path);
	printf("%s%s\n  %s: %s\n", path, change->is_there ? " (is there already)" : "",
	       checks_of(change->row, checks), change->row->why);
	fix_print_lines(change, "    ", stdout);
	for (size_t i = 0; i < change->values && is_to_do(change); i++)
		printf("  at once: %s changes to %s (before: %s)\n", change->value[i].path,
		       change->value[i].value, change->value[i].before);
	puts("");
}

static void show_one_left(unsigned int *shown, const char *check, const char *subject,
			  const char *text)
{
	printf("%s%s%s%s: %s\n", *shown ? "" : "Left to you:\n", check, *subject ? " " : "",
	       subject, text);
	++*shown;
}

/* The row for this check says why it makes no change. */
static bool is_explained(const struct fix_plan *plan, const char *check)
{
	for (size_t i = 0; i < fix_row_count; i++)
		for (size_t c = 0; *plan->left[i] && c < FIX_CHECKS && fix_rows[i].check[c]; c++)
			if (!strcmp(fix_rows[i].check[c], check))
				return true;
	return false;
}

/* What no change mends, with the command, as the doctor says it. */
static void show_left(const struct fix_plan *plan)
{
	unsigned int shown = 0;
	char checks[CHECKS];

	for (size_t i = 0; i < fix_row_count; i++)
		if (*plan->left[i])
			show_one_left(&shown, checks_of(&fix_rows[i], checks), "", plan->left[i]);
	for (size_t i = 0; i < plan->report->count; i++) {
		const struct doctor_finding *finding = &plan->report->finding[i];

		if (fix_is_bad(finding) && !fix_mends(plan, finding->check) &&
		    !is_explained(plan, finding->check))
			show_one_left(&shown, finding->check, finding->subject,
				      *finding->mend ? finding->mend : finding->why);
	}
	if (shown)
		puts("");
}

int fix_run(struct doctor *doctor, const struct doctor_report *report,
	    const struct options *options)
{
	static struct fix_plan plan;
	char question[64];
	unsigned int kinds = 0;
	size_t count = 0;
	bool good = true;

	plan.doctor = doctor;
	plan.report = report;
	fix_make_plan(&plan);
	for (size_t i = 0; i < plan.changes; i++) {
		count += is_to_do(&plan.change[i]);
		show_change(&plan, &plan.change[i]);
	}
	show_left(&plan);
	if (!count) {
		puts(plan.changes ? "every file exists already; run update-grub and restart the "
				    "computer if you have not done so since they were written" :
				    "there is nothing to write");
		return STATUS_OK;
	}
	if (!*doctor->root && geteuid()) {
		complain("nothing was changed: root privileges are needed; run: sudo pokeysctl "
			 "doctor --fix");
		return STATUS_FAILED;
	}
	snprintf(question, sizeof(question), "Make %zu change%s?", count, count == 1 ? "" : "s");
	if (!may_go_on(doctor, options, question))
		return STATUS_FAILED;
	for (size_t i = 0; i < plan.changes; i++) {
		if (!is_to_do(&plan.change[i]))
			continue;
		good = !fix_write(&plan, &plan.change[i]) && good;
		if (!plan.change[i].is_there)
			kinds |= 1u << plan.change[i].row->kind;
	}
	return conclude(doctor, kinds) && good ? STATUS_OK : STATUS_FAILED;
}

int fix_undo(struct doctor *doctor, const struct options *options)
{
	char path[FIX_PATH];
	unsigned int kinds = 0;
	size_t count = 0;
	bool good = true;

	for (size_t i = 0; i < fix_row_count; i++) {
		if (!fix_is_ours(doctor, &fix_rows[i]))
			continue;
		fix_path(doctor, &fix_rows[i], path);
		puts(path);
		count++;
	}
	if (!count) {
		puts("there is nothing to undo: no file written by pokeysctl doctor --fix exists");
		return STATUS_OK;
	}
	if (!*doctor->root && geteuid()) {
		complain("nothing was changed: root privileges are needed; run: sudo pokeysctl "
			 "doctor --undo");
		return STATUS_FAILED;
	}
	if (!may_go_on(doctor, options,
		       "Remove these files and restore the kernel's "
		       "previous settings?"))
		return STATUS_FAILED;
	/* in reverse order, so the file that notes that its folder was made for it comes last */
	for (size_t i = fix_row_count; i-- > 0;) {
		if (!fix_is_ours(doctor, &fix_rows[i]))
			continue;
		good = !fix_take_back(doctor, &fix_rows[i]) && good;
		kinds |= 1u << fix_rows[i].kind;
	}
	return conclude(doctor, kinds) && good ? STATUS_OK : STATUS_FAILED;
}
