// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The changes that pokeysctl doctor --fix can make, each with what it needs. A row makes no change
 * where a person has chosen something else, or where it cannot be done by a file of its own.
 */
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include "tools/doctor_fix.h"

#define CORE "/sys/devices/system/cpu"

enum { LIST = 256, LATE_US = 10, IDLE_STATES = 16 };

/* False, and what to tell. */
__attribute__((format(printf, 2, 3)))
static bool cannot(char why_not[FIX_LINE], const char *format, ...)
{
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(why_not, FIX_LINE, format, arguments);
	va_end(arguments);
	return false;
}

/* A file of the kernel with its content before; false if there is none, or no room. */
__attribute__((format(printf, 4, 5)))
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
	if (!probe_text(doctor->root, next->before, sizeof(next->before), "%s", next->path))
		return false;
	change->values++;
	return true;
}

/* Why there is none for the daemon alone. */
static const char *no_core(const struct doctor *doctor)
{
	return doctor->cpu ? "there is no core to spare" :
	       "core 0 does the kernel's own work and cannot be freed from it; choose another cpu";
}

static bool build_core(const struct fix_plan *plan, struct fix_change *change,
		       char why_not[FIX_LINE])
{
	const struct doctor *doctor = plan->doctor;

	if (doctor->cpu == doctor->plan.cpu && doctor->cpu >= 0)
		return false;
	if (doctor->cpu <= 0)
		return cannot(why_not, "%s", no_core(doctor));
	if (!doctor->plan.read)
		return cannot(why_not, "there is no %s yet", doctor->plan.path);
	snprintf(change->line, sizeof(change->line), "cpu = %d", doctor->cpu);
	return true;
}

/* Of two interfaces in one network: the one that the devices answer at. */
static bool build_interface(const struct fix_plan *plan, struct fix_change *change,
			    char why_not[FIX_LINE])
{
	const struct doctor *doctor = plan->doctor;
	const char *nic = NULL;
	bool is_aside = false;

	for (size_t i = 0; i < doctor->devices; i++) {
		const struct doctor_device *device = &doctor->device[i];

		is_aside = is_aside || *device->aside;
		if (nic && strcmp(nic, device->nic) != 0)
			return is_aside ? cannot(why_not, "the devices are at several interfaces") :
			       false;
		nic = device->nic;
	}
	if (!is_aside || *doctor->plan.interface)
		return false;
	if (!doctor->plan.read)
		return cannot(why_not, "there is no %s yet", doctor->plan.path);
	snprintf(change->line, sizeof(change->line), "interface = %s", nic);
	return true;
}

/* A line of /etc/default/grub that is no comment has the parameter. */
static bool grub_has(const char *root, const char *parameter)
{
	char text[PROBE_TEXT * 4];

	if (!probe_text(root, text, sizeof(text), FIX_GRUB))
		return false;
	for (char *rest = text, *line; (line = strsep(&rest, "\n"));)
		if (*line != '#' && strstr(line, parameter))
			return true;
	return false;
}

/* True: the kernel's parameters can be set by a file, and nobody has set these elsewhere. */
static bool may_set(const struct fix_plan *plan, const struct fix_change *change,
		    const char *const names[], char why_not[FIX_LINE])
{
	const char *root = plan->doctor->root;
	char value[LIST], parameter[32];

	if (!probe_exists(root, FIX_GRUB) || !probe_exists(root, FIX_UPDATE_GRUB))
		return cannot(why_not, "there is no GRUB here: add it to the kernel command "
			      "line of your boot loader: %s", change->line);
	for (; *names; names++) {
		snprintf(parameter, sizeof(parameter), "%s=", *names);
		if (grub_has(root, parameter))
			return cannot(why_not, FIX_GRUB " has %s already; change it there: %s",
				      parameter, change->line);
		if (!fix_is_ours(plan->doctor, change->row) &&
		    probe_command_line(root, *names, value, sizeof(value)))
			return cannot(why_not, "the kernel command line has %s%s already; change "
				      "it where it is set: %s", parameter, value, change->line);
	}
	return true;
}

static bool build_isolation(const struct fix_plan *plan, struct fix_change *change,
			    char why_not[FIX_LINE])
{
	static const char *const names[] = { "isolcpus", "nohz_full", "rcu_nocbs", NULL };
	char list[LIST / 4], others[LIST];

	if (!fix_is_wanted(plan->report, "isolcpus") && !fix_is_wanted(plan->report, "nohz-full") &&
	    !fix_is_wanted(plan->report, "rcu-nocbs"))
		return false;
	if (!doctor_isolate(plan->doctor, list, others, sizeof(list)))
		return cannot(why_not, "%s", no_core(plan->doctor));
	snprintf(change->line, sizeof(change->line),
		 "isolcpus=managed_irq,domain,%s nohz_full=%s rcu_nocbs=%s", list, list, list);
	return may_set(plan, change, names, why_not);
}

/* With the isolation also where no interrupt goes there now: after a boot it may. */
static bool build_interrupts(const struct fix_plan *plan, struct fix_change *change,
			     char why_not[FIX_LINE])
{
	static const char *const names[] = { "irqaffinity", NULL };
	const struct doctor *doctor = plan->doctor;
	char list[LIST / 4], others[LIST / 4];
	int irq[FIX_VALUES];
	size_t count;

	if (!fix_is_wanted(plan->report, "interrupts") &&
	    !fix_is_wanted(plan->report, "nic-interrupts") && !fix_mends(plan, "isolcpus"))
		return false;
	if (!doctor_isolate(doctor, list, others, sizeof(list)))
		return cannot(why_not, "%s", no_core(doctor));
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
	long latency, disabled;

	(void)why_not;
	if (!fix_is_wanted(plan->report, "idle-states"))
		return false;
	for (int i = 0; i < IDLE_STATES; i++) {
		disabled = 0;
		probe_number(doctor->root, &disabled, CORE "/cpu%d/cpuidle/state%d/disable",
			     doctor->cpu, i);
		if (probe_number(doctor->root, &latency, CORE "/cpu%d/cpuidle/state%d/latency",
				 doctor->cpu, i) && latency > LATE_US && !disabled)
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
	if (sibling <= 0)
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

/* Only where realtime threads get no time at all: how much they may take is a choice. */
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
	{ "doctor-cpu.conf", FIX_CONF, { "core" },
	  "The realtime thread stays on one core, so nothing it has in a cache is elsewhere.",
	  build_core },
	{ "doctor-interface.conf", FIX_CONF, { "route" },
	  "Two interfaces are in the device's network; it is at this one.", build_interface },
	{ "/etc/default/grub.d/pokeysd-isolation.cfg", FIX_KERNEL,
	  { "isolcpus", "nohz-full", "rcu-nocbs" },
	  "No other program, no tick and no RCU callbacks on the cores of pokeysd and LinuxCNC.",
	  build_isolation },
	{ "/etc/default/grub.d/pokeysd-interrupts.cfg", FIX_KERNEL,
	  { "interrupts", "nic-interrupts" },
	  "Interrupts go to the other cores, also those that the next boot gives other numbers.",
	  build_interrupts },
	{ "/etc/tmpfiles.d/pokeysd-idle-states.conf", FIX_TMPFILES, { "idle-states" },
	  "The daemon's core does not sleep so deeply that it takes long to wake up.",
	  build_idle },
	{ "/etc/tmpfiles.d/pokeysd-governor.conf", FIX_TMPFILES, { "governor" },
	  "The daemon's core does not become slow between two cycles.", build_governor },
	{ "/etc/tmpfiles.d/pokeysd-sibling.conf", FIX_TMPFILES, { "smt-sibling" },
	  "Nothing else runs on the execution units of the daemon's core.", build_sibling },
	{ "/etc/sysctl.d/90-pokeysd-timers.conf", FIX_SYSCTL, { "timer-migration" },
	  "Timers fire on the core that waits for them.", build_timers },
	{ "/etc/sysctl.d/90-pokeysd-throttling.conf", FIX_SYSCTL, { "throttling" },
	  "Realtime threads get the time that the kernel gives them by default.",
	  build_throttling },
};
const size_t fix_row_count = sizeof(fix_rows) / sizeof(fix_rows[0]);

_Static_assert(sizeof(fix_rows) / sizeof(fix_rows[0]) <= FIX_CHANGES, "a plan holds them all");
