// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The changes that pokeysctl doctor --fix can make, each with what it needs. A row makes no change
 * where a person has chosen something else, or where it cannot be done by a file of its own.
 */
#include <dirent.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include "tools/doctor_fix.h"

#define CORE "/sys/devices/system/cpu"

enum { LIST = 256, LATE_US = 10, IDLE_STATES = 16 };

/* Write the reason into why_not and return false. */
static bool cannot(char why_not[FIX_LINE], const char *format, ...)
	__attribute__((format(printf, 2, 3)));

static bool cannot(char why_not[FIX_LINE], const char *format, ...)
{
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(why_not, FIX_LINE, format, arguments);
	va_end(arguments);
	return false;
}

/* A file of the kernel with its content before; false if that cannot be read whole, or no room. */
static bool add_value(const struct doctor *doctor, struct fix_change *change, const char *value,
		      const char *path, ...) __attribute__((format(printf, 4, 5)));

static bool add_value(const struct doctor *doctor, struct fix_change *change, const char *value,
		      const char *path, ...)
{
	struct fix_value *next = &change->value[change->values];
	va_list arguments;

	if (change->values == FIX_VALUES)
		return false;
	va_start(arguments, path);
	vsnprintf(next->path, sizeof(next->path), path, arguments);
	va_end(arguments);
	snprintf(next->value, sizeof(next->value), "%s", value);
	if (!probe_text(doctor->root, next->before, sizeof(next->before), "%s", next->path) ||
	    !*next->before || strlen(next->before) == sizeof(next->before) - 1)
		return false;
	if (strcmp(next->before, value) != 0)
		change->differs = true;
	change->values++;
	return true;
}

/* A file of pokeysd.conf.d can be written, and is read after those that set the same. */
static bool may_configure(const struct fix_plan *plan, char why_not[FIX_LINE])
{
	const struct doctor_plan *conf = &plan->doctor->plan;

	if (!conf->read)
		return cannot(why_not,
			      "%s does not exist yet; write it first, see "
			      "pokeysd.conf(5)",
			      conf->path);
	return !conf->unread || cannot(why_not, "%s", conf->unread);
}

static bool build_core(const struct fix_plan *plan, struct fix_change *change,
		       char why_not[FIX_LINE])
{
	const struct doctor *doctor = plan->doctor;
	char list[LIST], others[LIST], path[FIX_PATH];
	const char *why;

	if (doctor->cpu == doctor->plan.cpu && doctor->cpu >= 0)
		return false;
	why = doctor_isolate(doctor, list, others, sizeof(list));
	if (why)
		return cannot(why_not, "%s", why);
	if (!may_configure(plan, why_not))
		return false;
	fix_path(doctor, change->row, path);
	if (strcmp(doctor->plan.cpu_from, path) > 0)
		return cannot(why_not,
			      "%s sets cpu =, and is read after the file that would be "
			      "written; change it there",
			      doctor->plan.cpu_from);
	snprintf(change->line, sizeof(change->line), "cpu = %d", doctor->cpu);
	return true;
}

/* Of two interfaces in one network: the one that the devices answer at. */
static bool build_interface(const struct fix_plan *plan, struct fix_change *change,
			    char why_not[FIX_LINE])
{
	const struct doctor *doctor = plan->doctor;
	const char *nic = "";
	bool is_aside = false, is_one = true;

	for (size_t i = 0; i < doctor->devices; i++) {
		const struct doctor_device *device = &doctor->device[i];

		is_aside = is_aside || *device->aside;
		if (*nic && *device->nic && strcmp(nic, device->nic) != 0)
			is_one = false;
		if (*device->nic)
			nic = device->nic;
	}
	if (!is_aside || *doctor->plan.interface)
		return false;
	if (!is_one)
		return cannot(why_not, "the devices are at several interfaces");
	snprintf(change->line, sizeof(change->line), "interface = %s", nic);
	return may_configure(plan, why_not);
}

/* True if the file sets the parameter. Comments do not count. */
static bool file_has(const char *path, const char *parameter)
{
	enum { SIZE = 1 << 16 };
	char *text = malloc(SIZE), *rest = text, *line;
	bool has = false;

	if (text && probe_text("", text, SIZE, "%s", path))
		while (!has && (line = strsep(&rest, "\n")))
			has = line[strspn(line, " \t")] != '#' && strstr(line, parameter);
	free(text);
	return has;
}

/* GRUB's file that has the parameter already, but for ours. False: there is none. */
static bool find_in_grub(const struct doctor *doctor, const char *parameter, char path[FIX_PATH])
{
	char folder[FIX_PATH], *name;
	const struct dirent *entry;
	bool found;
	DIR *all;

	snprintf(path, FIX_PATH, "%s" FIX_GRUB, doctor->root);
	if (file_has(path, parameter))
		return true;
	snprintf(folder, sizeof(folder), "%s" FIX_GRUB_FOLDER, doctor->root);
	all = opendir(folder);
	found = false;
	while (all && !found && (entry = readdir(all))) {
		name = strrchr(entry->d_name, '.');
		if (!name || strcmp(name, ".cfg") != 0 || !strncmp(entry->d_name, "pokeysd-", 8))
			continue;
		if (snprintf(path, FIX_PATH, "%s%s", folder, entry->d_name) < FIX_PATH)
			found = file_has(path, parameter);
	}
	if (all)
		closedir(all);
	return found;
}

/* True: the kernel's parameters can be set by a file, and nobody has set these elsewhere. */
static bool may_set(const struct fix_plan *plan, const struct fix_change *change,
		    const char *const names[], char why_not[FIX_LINE])
{
	const char *root = plan->doctor->root;
	char value[LIST], parameter[32], path[FIX_PATH];

	if (!probe_exists(root, FIX_GRUB) || !probe_exists(root, FIX_UPDATE_GRUB))
		return cannot(why_not,
			      "GRUB is not installed; add these parameters to the kernel "
			      "command line in your boot loader: %s",
			      change->line);
	for (; *names; names++) {
		snprintf(parameter, sizeof(parameter), "%s=", *names);
		if (find_in_grub(plan->doctor, parameter, path))
			return cannot(why_not, "%s has %s already; change it there: %s", path,
				      parameter, change->line);
		if (!fix_is_ours(plan->doctor, change->row) &&
		    probe_command_line(root, *names, value, sizeof(value)))
			return cannot(why_not,
				      "the kernel command line has %s%s already; change "
				      "it where it is set: %s",
				      parameter, value, change->line);
	}
	return true;
}

static bool build_isolation(const struct fix_plan *plan, struct fix_change *change,
			    char why_not[FIX_LINE])
{
	static const char *const names[] = { "isolcpus", "nohz_full", "rcu_nocbs", NULL };
	char list[LIST / 4], others[LIST / 4];
	const char *why;

	if (!fix_is_wanted(plan->report, "isolcpus") && !fix_is_wanted(plan->report, "nohz-full") &&
	    !fix_is_wanted(plan->report, "rcu-nocbs"))
		return false;
	why = doctor_isolate(plan->doctor, list, others, sizeof(list));
	if (why)
		return cannot(why_not, "%s", why);
	snprintf(change->line, sizeof(change->line),
		 "isolcpus=managed_irq,domain,%s nohz_full=%s rcu_nocbs=%s", list, list, list);
	return may_set(plan, change, names, why_not);
}

/* Isolation also needs this if no interrupt goes to these cores now: after a boot, one may. */
static bool build_interrupts(const struct fix_plan *plan, struct fix_change *change,
			     char why_not[FIX_LINE])
{
	static const char *const names[] = { "irqaffinity", NULL };
	const struct doctor *doctor = plan->doctor;
	char list[LIST / 4], others[LIST / 4];
	int irq[FIX_VALUES];
	const char *why;
	size_t count;

	if (!fix_is_wanted(plan->report, "interrupts") &&
	    !fix_is_wanted(plan->report, "nic-interrupts") && !fix_mends(plan, "isolcpus"))
		return false;
	why = doctor_isolate(doctor, list, others, sizeof(list));
	if (why)
		return cannot(why_not, "%s", why);
	snprintf(change->line, sizeof(change->line), "irqaffinity=%s", others);
	count = doctor_irqs_on_core(doctor, irq, FIX_VALUES);
	for (size_t i = 0; i < count; i++)
		add_value(doctor, change, others, "/proc/irq/%d/smp_affinity_list", irq[i]);
	return may_set(plan, change, names, why_not);
}

static bool build_idle(const struct fix_plan *plan, struct fix_change *change,
		       char why_not[FIX_LINE])
{
	const struct doctor *doctor = plan->doctor;
	long latency;

	(void)why_not;
	if (!fix_is_wanted(plan->report, "idle-states"))
		return false;
	for (int i = 0; i < IDLE_STATES; i++) {
		if (probe_number(doctor->root, &latency, CORE "/cpu%d/cpuidle/state%d/latency",
				 doctor->cpu, i) &&
		    latency > LATE_US)
			add_value(doctor, change, "1", CORE "/cpu%d/cpuidle/state%d/disable",
				  doctor->cpu, i);
	}
	return change->values > 0;
}

static bool build_governor(const struct fix_plan *plan, struct fix_change *change,
			   char why_not[FIX_LINE])
{
	const int cpu = plan->doctor->cpu;
	char governors[LIST];

	if (!fix_is_wanted(plan->report, "governor"))
		return false;
	if (probe_text(plan->doctor->root, governors, sizeof(governors),
		       CORE "/cpu%d/cpufreq/scaling_available_governors", cpu) &&
	    !strstr(governors, "performance"))
		return cannot(why_not, "this kernel has no governor performance, only %s",
			      governors);
	return add_value(plan->doctor, change, "performance",
			 CORE "/cpu%d/cpufreq/scaling_governor", cpu);
}

static bool build_sibling(const struct fix_plan *plan, struct fix_change *change,
			  char why_not[FIX_LINE])
{
	const struct doctor *doctor = plan->doctor;
	char list[LIST];
	int sibling;

	if (!fix_is_wanted(plan->report, "smt-sibling") ||
	    !probe_text(doctor->root, list, sizeof(list),
			CORE "/cpu%d/topology/thread_siblings_list", doctor->cpu))
		return false;
	sibling = probe_list_other(list, doctor->cpu);
	if (sibling < 0)
		return false;
	if (!sibling)
		return cannot(why_not, "core 0 cannot be switched off");
	return add_value(doctor, change, "0", CORE "/cpu%d/online", sibling);
}

static bool build_timers(const struct fix_plan *plan, struct fix_change *change,
			 char why_not[FIX_LINE])
{
	(void)why_not;
	return fix_is_wanted(plan->report, "timer-migration") &&
	       add_value(plan->doctor, change, "0", FIX_SYSCTLS "timer_migration");
}

/* Only where realtime threads get no time at all: any other limit is the user's choice. */
static bool build_throttling(const struct fix_plan *plan, struct fix_change *change,
			     char why_not[FIX_LINE])
{
	long runtime;

	(void)why_not;
	return probe_number(plan->doctor->root, &runtime, FIX_SYSCTLS "sched_rt_runtime_us") &&
	       runtime == 0 &&
	       add_value(plan->doctor, change, "950000", FIX_SYSCTLS "sched_rt_runtime_us");
}

const struct fix_row fix_rows[] = {
	{ "90-doctor-cpu.conf",
	  FIX_CONF,
	  { "core" },
	  "The realtime thread stays on one core, so its data stays in the caches of that core.",
	  build_core },
	{ "90-doctor-interface.conf",
	  FIX_CONF,
	  { "route" },
	  "Two interfaces are in the device's network; the device answers on this one.",
	  build_interface },
	{ FIX_GRUB_FOLDER "pokeysd-isolation.cfg",
	  FIX_KERNEL,
	  { "isolcpus", "nohz-full", "rcu-nocbs" },
	  "No other program, timer tick or RCU callback runs on the cores of pokeysd and LinuxCNC.",
	  build_isolation },
	{ FIX_GRUB_FOLDER "pokeysd-interrupts.cfg",
	  FIX_KERNEL,
	  { "interrupts", "nic-interrupts" },
	  "Interrupts go to the other cores, even if their numbers change at the next boot.",
	  build_interrupts },
	{ "/etc/tmpfiles.d/pokeysd-idle-states.conf",
	  FIX_TMPFILES,
	  { "idle-states" },
	  "The daemon's core does not sleep so deeply that it takes long to wake up.",
	  build_idle },
	{ "/etc/tmpfiles.d/pokeysd-governor.conf",
	  FIX_TMPFILES,
	  { "governor" },
	  "The daemon's core keeps its full clock speed between two cycles.",
	  build_governor },
	{ "/etc/tmpfiles.d/pokeysd-sibling.conf",
	  FIX_TMPFILES,
	  { "smt-sibling" },
	  "Nothing else runs on the execution units of the daemon's core.",
	  build_sibling },
	{ "/etc/sysctl.d/90-pokeysd-timers.conf",
	  FIX_SYSCTL,
	  { "timer-migration" },
	  "Timers fire on the core that waits for them.",
	  build_timers },
	{ "/etc/sysctl.d/90-pokeysd-throttling.conf",
	  FIX_SYSCTL,
	  { "throttling" },
	  "Realtime threads get the time that the kernel gives them by default.",
	  build_throttling },
};
const size_t fix_row_count = sizeof(fix_rows) / sizeof(fix_rows[0]);

_Static_assert(sizeof(fix_rows) / sizeof(fix_rows[0]) <= FIX_CHANGES, "a plan holds them all");
