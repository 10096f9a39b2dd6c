// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl doctor: everything about this machine that makes packets late or
 * realtime threads wait, with the command that mends it.
 *
 * It only looks, unless --fix or --undo is given (doctor_fix.c). It needs neither a daemon nor
 * privilege, and what it could not see it calls unknown instead of leaving it out; so the exit
 * status says "no problem was found", and the number of unknowns how much that is worth.
 */
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include "tools/doctor.h"
#include "tools/doctor_fix.h"
#include "tools/json.h"
#include "tools/order.h"
#include "tools/pokeysctl.h"

/* The running daemon's devices, and their addresses where none is configured. */
static void look_at_daemon(struct doctor *doctor, const char *runtime_directory)
{
	char names[VIEW_DEVICES][POKEYS_SHM_NAME_MAX];
	int known = *doctor->root ? 0 : pokeys_shm_devices(runtime_directory, names, VIEW_DEVICES);

	doctor->hidden = known == -EACCES;
	if (known <= 0 || view_attach(&doctor->view, runtime_directory, names, (size_t)known))
		return;
	view_read(&doctor->view);
	for (size_t i = 0; i < doctor->view.count; i++) {
		const struct view_device *seen = &doctor->view.device[i];
		size_t at = 0;

		while (at < doctor->devices && strcmp(doctor->device[at].name, seen->name) != 0)
			at++;
		if (seen->freshness == VIEW_NONE || at == DOCTOR_DEVICES)
			continue;
		if (at == doctor->devices)
			snprintf(doctor->device[doctor->devices++].name, DOCTOR_NAME, "%s",
				 seen->name);
		if (seen->state.identity.address)
			doctor->device[at].address = seen->state.identity.address;
	}
}

/* That of the runtime folder, or where it may not be asked the first that calls itself so. */
static void find_processes(struct doctor *doctor, const char *runtime_directory)
{
	struct probe_thread thread;

	doctor->daemon = *doctor->root ? 0 : order_daemon(runtime_directory);
	if (!doctor->daemon)
		doctor->daemon = probe_process(doctor->root, "pokeysd");
	doctor->hal = probe_process(doctor->root, "rtapi_app");
	doctor->balancer = probe_process(doctor->root, "irqbalance");
	if (doctor->cpu < 0 && doctor->daemon > 0 &&
	    probe_realtime_thread(doctor->root, doctor->daemon, &thread) && thread.priority &&
	    probe_list_other(thread.cores, atoi(thread.cores)) < 0)
		doctor->cpu = atoi(thread.cores);
}

/* "/" is this computer, whose programs are also run. */
static const char *root_of(const struct options *options)
{
	char path[PATH_MAX];

	if (!options->root || (realpath(options->root, path) && !strcmp(path, "/")))
		return "";
	return options->root;
}

/* --runtime-directory, or else the folder of the daemon that the configuration is for. */
static const char *runtime_of(const struct doctor *doctor, const struct options *options)
{
	return *doctor->plan.runtime && !options->runtime_named ? doctor->plan.runtime :
								  options->runtime_directory;
}

static void gather(struct doctor *doctor, const struct options *options)
{
	doctor->root = root_of(options);
	doctor->config = options->config;
	doctor_read_plan(doctor, options->config ? options->config : DOCTOR_PLAN_PATH);
	doctor_choose_core(doctor, options->cpu);
	find_processes(doctor, runtime_of(doctor, options));
	look_at_daemon(doctor, runtime_of(doctor, options));
	doctor_find_routes(doctor);
}

void doctor_print(const struct doctor_report *report, FILE *to)
{
	for (size_t i = 0; i < report->count; i++) {
		const struct doctor_finding *finding = &report->finding[i];

		fprintf(to, "%-8s %-16s %s%s%s\n", doctor_verdict_name(finding->verdict),
			finding->check, finding->subject, *finding->subject ? ": " : "",
			finding->why);
		if (*finding->mend)
			fprintf(to, "%25s -> %s\n", "", finding->mend);
		if (*finding->keep)
			fprintf(to, "%25s    until the next boot; to keep it: %s\n", "",
				finding->keep);
	}
	fprintf(to, "%u problem%s, %u advice, %u unknown, %u ok\n",
		doctor_count(report, DOCTOR_PROBLEM),
		doctor_count(report, DOCTOR_PROBLEM) == 1 ? "" : "s",
		doctor_count(report, DOCTOR_ADVICE), doctor_count(report, DOCTOR_UNKNOWN),
		doctor_count(report, DOCTOR_OK));
}

void doctor_print_json(const struct doctor_report *report, FILE *to)
{
	struct json json;

	json_init(&json, to);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_unsigned(&json, "problems", doctor_count(report, DOCTOR_PROBLEM));
	json_unsigned(&json, "advice", doctor_count(report, DOCTOR_ADVICE));
	json_unsigned(&json, "unknown", doctor_count(report, DOCTOR_UNKNOWN));
	json_array(&json, "findings");
	for (size_t i = 0; i < report->count; i++) {
		const struct doctor_finding *finding = &report->finding[i];

		json_object(&json, NULL);
		json_text(&json, "check", finding->check);
		json_text(&json, "subject", finding->subject);
		json_text(&json, "verdict", doctor_verdict_name(finding->verdict));
		json_text(&json, "why", finding->why);
		json_text(&json, "mend", finding->mend);
		json_text(&json, "keep", finding->keep);
		json_end(&json);
	}
	json_end(&json);
	json_end(&json);
}

int command_doctor(const struct options *options)
{
	static struct doctor doctor;
	static struct doctor_report report;
	int status;

	if (options->json && (options->fix || options->undo)) {
		complain("--json does not go together with --fix and --undo");
		return STATUS_USAGE;
	}
	if (options->fix && options->undo) {
		complain("--fix and --undo do not go together");
		return STATUS_USAGE;
	}
	gather(&doctor, options);
	if (options->cpu >= 0 && doctor_core_is_absent(&doctor)) {
		complain("--cpu %d: this computer has no such core, or it is offline",
			 options->cpu);
		view_close(&doctor.view);
		return STATUS_FAILED;
	}
	if (options->fix && doctor.cpu < 0)
		doctor_choose_core(&doctor, doctor_propose_core(&doctor));
	doctor_judge(&doctor, &report);
	if (options->fix || options->undo) {
		status = options->fix ? fix_run(&doctor, &report, options) :
					fix_undo(&doctor, options);
		view_close(&doctor.view);
		return status;
	}
	if (options->json)
		doctor_print_json(&report, stdout);
	else
		doctor_print(&report, stdout);
	view_close(&doctor.view);
	return doctor_count(&report, DOCTOR_PROBLEM) ? STATUS_FAILED : STATUS_OK;
}
