// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl latency: what the machine can do (a thread that only sleeps, as
 * cyclictest has it) beside what the daemon gets of it in the same seconds. If
 * the first is bad it is the machine's fault, and doctor says which; if only
 * the second is, it is the daemon's or its settings'.
 *
 * The daemon's part is the difference of two readings of its histogram; all
 * the rest is measured here. Both have the daemon's period and core.
 */
#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <unistd.h>
#include "tools/doctor.h"
#include "tools/latency.h"
#include "tools/order.h"
#include "tools/pokeysctl.h"
#include "tools/print.h"

enum { DEFAULT_PERIOD_NS = 1000000 };

/* Highest core that this process may run on, -1 if only `than` itself is lower. */
static int permitted_core(int than, bool highest)
{
	cpu_set_t set;
	int found = -1;

	if (sched_getaffinity(0, sizeof(set), &set) < 0)
		return -1;
	for (int cpu = 0; cpu < CPU_SETSIZE; cpu++)
		if (CPU_ISSET((size_t)cpu, &set) && cpu != than && (highest || found < 0))
			found = cpu;
	return found;
}

/* The one core that the daemon's realtime thread may run on, -1 = several, or not to be seen. */
static int daemon_core(const struct options *options)
{
	struct probe_thread thread;
	int daemon = order_daemon(options->runtime_directory);

	if (daemon > 0 && probe_realtime_thread("", daemon, &thread) && thread.priority &&
	    probe_list_other(thread.cores, atoi(thread.cores)) < 0)
		return atoi(thread.cores);
	return -1;
}

/* The core that was asked for, else the daemon's, else the last one. */
static int choose_core(const struct options *options, bool *spins)
{
	static struct doctor doctor = { .root = "" };
	int cpu = daemon_core(options);

	doctor_read_plan(&doctor, options->config ? options->config : DOCTOR_PLAN_PATH);
	doctor_choose_core(&doctor, -1);
	*spins = doctor.plan.spin;
	if (options->cpu >= 0)
		return options->cpu;
	if (cpu >= 0)
		return cpu;
	return doctor.plan.cpu >= 0 ? doctor.plan.cpu : permitted_core(-1, true);
}

static void prepare(struct latency_run *run, const struct options *options,
		    const struct view_device *daemon)
{
	struct utsname name;
	bool spins;
	int cpu = choose_core(options, &spins), other = permitted_core(cpu, false);

	uname(&name);
	snprintf(run->kernel, sizeof(run->kernel), "%s", name.release);
	run->is_virtual = probe_virtual("");
	run->priority = options->no_realtime ? 0 : options->priority;
	run->seconds = options->seconds;
	run->period_ns = daemon ? daemon->state.period_ns : DEFAULT_PERIOD_NS;
	run->phase_ns = daemon ? (daemon->state.t_cycle_ns + run->period_ns / 2) % run->period_ns :
				 0;
	run->series[0].cpu = cpu;
	snprintf(run->series[0].title, sizeof(run->series[0].title), "sleeper, core %d", cpu);
	run->count = 1;
	if (other >= 0) {
		run->series[1].cpu = other;
		snprintf(run->series[1].title, sizeof(run->series[1].title), "sleeper, core %d",
			 other);
		run->count = 2;
	}
	if (daemon && spins)
		snprintf(run->note, sizeof(run->note),
			 "the daemon spins and keeps its core, so a "
			 "sleeper beside it measures the daemon");
}

/* All of its histograms, so that one can see behind a late wake-up what came of it. */
static void take_parts(struct latency_run *run, const struct pokeys_diag *before,
		       const struct pokeys_diag *after)
{
	for (size_t i = 0; i < print_histogram_count && run->parts < LATENCY_PARTS; i++) {
		struct latency_part *part = &run->part[run->parts++];

		part->key = print_histograms[i].key;
		part->title = print_histograms[i].title;
		latency_since(print_histogram_of(before, i), print_histogram_of(after, i),
			      &part->histogram);
	}
}

static void take_daemon(struct latency_run *run, struct view *view, int cpu,
			const struct pokeys_diag *before)
{
	char core[24] = "", why[224];
	const struct view_device *device = latency_daemon(view, view->runtime_directory, why,
							  sizeof(why));
	static const struct pokeys_diag nothing;
	struct latency_series *series = &run->series[run->count];

	if (!device) {
		snprintf(run->note, sizeof(run->note),
			 "the daemon was there, but not at the end: %s", why);
		return;
	}
	if (device->diag.epoch != before->epoch) {
		before = &nothing;
		snprintf(run->note, sizeof(run->note),
			 "the daemon was restarted in between; its figures count from then");
	}
	if (cpu >= 0)
		snprintf(core, sizeof(core), ", core %d", cpu);
	series->cpu = cpu;
	snprintf(series->title, sizeof(series->title), "pokeysd%s%s", core,
		 device->state.flags & POKEYS_STATE_REALTIME ? "" : ", no RT");
	latency_since(&before->wakeup, &device->diag.wakeup, &series->histogram);
	run->count++;
	take_parts(run, before, &device->diag);
}

static int no_picture(const char *path)
{
	complain("--svg: %s: %s", path, strerror(errno));
	return STATUS_FAILED;
}

/*
 * Not after ten minutes of measuring. A picture that is there stays until there is another:
 * it is emptied only then.
 */
static FILE *open_picture(const char *path, bool *made)
{
	int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
	FILE *to;

	*made = fd >= 0;
	if (fd < 0 && errno == EEXIST)
		fd = open(path, O_WRONLY | O_CLOEXEC);
	to = fd < 0 ? NULL : fdopen(fd, "w");
	if (!to)
		no_picture(path);
	return to;
}

static void leave_picture(FILE *to, const char *path, bool made)
{
	fclose(to);
	if (made)
		unlink(path);
}

static int plot(const struct latency_run *run, FILE *to, const char *path)
{
	struct stat status;
	bool failed = !fstat(fileno(to), &status) && S_ISREG(status.st_mode) &&
		      ftruncate(fileno(to), 0);

	latency_plot(run, to);
	failed = ferror(to) || failed;
	return fclose(to) || failed ? no_picture(path) : STATUS_OK;
}

int command_latency(const struct options *options)
{
	static struct latency_run run;
	struct view *view = view_only();
	static struct pokeys_diag before;
	const struct view_device *daemon;
	FILE *picture = NULL;
	bool made = false;
	char why[224] = "";

	if (options->svg && !(picture = open_picture(options->svg, &made)))
		return STATUS_FAILED;
	daemon = latency_daemon(view, options->runtime_directory, why, sizeof(why));
	if (!daemon)
		snprintf(run.note, sizeof(run.note), "%s: the sleepers alone", why);
	prepare(&run, options, daemon);
	if (daemon)
		before = daemon->diag;
	if (latency_measure(&run, run.count, why, sizeof(why))) {
		complain("%s", why);
		view_close(view);
		if (picture)
			leave_picture(picture, options->svg, made);
		return STATUS_FAILED;
	}
	if (daemon)
		take_daemon(&run, view, daemon_core(options), &before);
	view_close(view);
	if (options->json)
		latency_print_json(&run, stdout);
	else
		latency_print(&run, stdout);
	return picture ? plot(&run, picture, options->svg) : STATUS_OK;
}
