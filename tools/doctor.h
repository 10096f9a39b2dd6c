/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysctl doctor: what is known of the machine, and what is thought of it.
 * First everything that checks share is gathered (struct doctor), then each row
 * of the table of checks judges one thing.
 */
#ifndef TOOLS_DOCTOR_H
#define TOOLS_DOCTOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include "tools/nic.h"
#include "tools/probe.h"
#include "tools/view.h"

enum { DOCTOR_DEVICES = VIEW_DEVICES, DOCTOR_NAME = 48 };
enum { DOCTOR_FINDINGS = 64 + 16 * DOCTOR_DEVICES };

#define DOCTOR_PLAN_PATH "/etc/pokeysd/pokeysd.conf"

enum doctor_verdict {
	DOCTOR_OK,
	DOCTOR_ADVICE,  /* works, and could be better */
	DOCTOR_PROBLEM, /* will be late, or does not work */
	DOCTOR_UNKNOWN, /* could not be seen; the text says why */
};

/* Where the packets to one device go. */
struct doctor_device {
	char name[DOCTOR_NAME];
	uint32_t address; /* host byte order, 0 = not known */
	char nic[16];     /* empty = no route */
	bool through_router;
	char aside[16]; /* answers at nic, though its route leads here */
};

/* The daemon's configuration, as far as it matters here. */
struct doctor_plan {
	bool read;
	const char *unread; /* why not, NULL = nothing is wrong, or there is none */
	char path[256];
	char cpu_from[320]; /* the file whose cpu = counts */
	char interface[16]; /* empty = as the routes say */
	char runtime[256];  /* empty = not set */
	int cpu;            /* -1 = any */
	bool spin, chosen;  /* chosen: by mode, not left to auto */
	double duty;
	int priority;
};

struct doctor {
	const char *root;   /* "" or the folder of a copied machine */
	const char *config; /* that was named, NULL = the usual one */
	struct doctor_plan plan;
	int cpu;                   /* the core that is judged, -1 = none */
	bool hidden;               /* the runtime folder is there, but not for us */
	int daemon, hal, balancer; /* process, 0 = does not run, -1 = not to be seen */
	bool routes_read;
	size_t devices;
	struct doctor_device device[DOCTOR_DEVICES];
	struct view view; /* count = 0: no daemon was seen */
};

struct doctor_finding {
	const char *check;
	char subject[DOCTOR_NAME]; /* core, network interface, device; empty = the machine */
	enum doctor_verdict verdict;
	char why[320];
	char mend[512]; /* empty = nothing to do */
	char keep[160]; /* it lasts until the next boot; how it lasts; or empty */
	/* What the check is to look at, by its scope. */
	const struct doctor_device *device;
	const struct view_device *seen;
	const struct nic *nic;
};

struct doctor_report {
	size_t count;
	struct doctor_finding finding[DOCTOR_FINDINGS];
};

enum doctor_scope { DOCTOR_MACHINE, DOCTOR_CORE, DOCTOR_NIC, DOCTOR_DEVICE, DOCTOR_DAEMON };

/* One row: its name (as the guide calls it), what it is done for each of, how. */
struct doctor_check {
	const char *name;
	enum doctor_scope scope;
	void (*judge)(const struct doctor *doctor, struct doctor_finding *finding);
};

struct doctor_checks {
	const struct doctor_check *check;
	size_t count;
};
extern const struct doctor_checks doctor_kernel_checks, doctor_core_checks, doctor_power_checks,
	doctor_interrupt_checks, doctor_nic_checks, doctor_right_checks, doctor_daemon_checks;

/* The verdict with one line of reason, and how to mend it. */
void doctor_say(struct doctor_finding *finding, enum doctor_verdict verdict, const char *why, ...)
	__attribute__((format(printf, 3, 4)));
void doctor_mend(struct doctor_finding *finding, const char *mend, ...)
	__attribute__((format(printf, 2, 3)));

/* The command lasts until the next boot only: what to write where so that it stays. */
void doctor_keep(struct doctor_finding *finding, const char *keep, ...)
	__attribute__((format(printf, 2, 3)));

#define DOCTOR_SYSCTL "%s in /etc/sysctl.d/90-pokeysd.conf"
#define DOCTOR_TMPFILES "w %s - - - - %s in /etc/tmpfiles.d/90-pokeysd.conf"
#define DOCTOR_UP "up COMMAND, below iface %s in /etc/network/interfaces"

/* Read pokeysd.conf at root + path: core, mode, devices' addresses. */
void doctor_read_plan(struct doctor *doctor, const char *path);

/* The core to give the daemon where nobody has chosen one; -1 = there is none to spare. */
int doctor_propose_core(const struct doctor *doctor);

/*
 * The cores to isolate for the daemon and LinuxCNC, and those for everything else, as lists of
 * `size` bytes. NULL, or why there are none (a static text).
 */
const char *doctor_isolate(const struct doctor *doctor, char *list, char *others, size_t size);

/* The interrupts that go to the doctor's core: at most `most` numbers. */
size_t doctor_irqs_on_core(const struct doctor *doctor, int number[], size_t most);

/* The core to judge: the one asked for, or where that is -1 the plan's; what auto does there. */
void doctor_choose_core(struct doctor *doctor, int asked);

/* The chosen core is not among those that are online. */
bool doctor_core_is_absent(const struct doctor *doctor);

/*
 * Fill nic, through_router and aside of every device: the interface of the plan, else that of
 * the routing table, unless only another one has an ARP entry for it.
 */
void doctor_find_routes(struct doctor *doctor);

/* Every check of the tables in order. */
void doctor_judge(const struct doctor *doctor, struct doctor_report *report);

const char *doctor_verdict_name(enum doctor_verdict verdict);
unsigned int doctor_count(const struct doctor_report *report, enum doctor_verdict verdict);
void doctor_print(const struct doctor_report *report, FILE *to);
void doctor_print_json(const struct doctor_report *report, FILE *to);

#endif
