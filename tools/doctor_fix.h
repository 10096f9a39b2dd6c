/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysctl doctor --fix and --undo: files that make a computer better for the daemon. Each
 * change has its own file, which gives the reason. Its comments keep the kernel's previous values,
 * so --undo can restore them and remove the file. Cold, main thread.
 */
#ifndef TOOLS_DOCTOR_FIX_H
#define TOOLS_DOCTOR_FIX_H

#include "tools/doctor.h"
#include "tools/pokeysctl.h"

#define FIX_SYSCTLS "/proc/sys/kernel/"
#define FIX_GRUB_FOLDER "/etc/default/grub.d/"
#define FIX_GRUB "/etc/default/grub"
#define FIX_UPDATE_GRUB "/usr/sbin/update-grub"

enum {
	FIX_CHANGES = 16,
	FIX_VALUES = 128,
	FIX_LINE = 512,
	FIX_PATH = 320,
	FIX_CHECKS = 3,
	FIX_VALUE_PATH = 72,
	FIX_BEFORE = 160
};

/* What a file is for. */
enum fix_kind {
	FIX_CONF,     /* the daemon's configuration, at its next start */
	FIX_KERNEL,   /* the kernel's command line by GRUB, at the next boot */
	FIX_TMPFILES, /* files of the kernel, now and at each boot (tmpfiles.d(5)) */
	FIX_SYSCTL,   /* the same for the files in FIX_SYSCTLS (sysctl.d(5)) */
};

/* A file of the kernel that is written at once. */
struct fix_value {
	char path[FIX_VALUE_PATH], value[64];
	char before[FIX_BEFORE];
};

struct fix_change {
	const struct fix_row *row;
	char line[FIX_LINE]; /* FIX_CONF: a key; FIX_KERNEL: parameters */
	size_t values;
	struct fix_value value[FIX_VALUES];
	bool is_there;    /* the file says so already */
	bool differs;     /* a value is not in effect */
	bool made_folder; /* an earlier one says that its folder was made for it */
};

struct fix_plan {
	const struct doctor *doctor;
	const struct doctor_report *report;
	size_t changes;
	struct fix_change change[FIX_CHANGES];
	char left[FIX_CHANGES][FIX_LINE]; /* why a row makes no change; "" = it need not */
};

/* One file. */
struct fix_row {
	const char *path; /* FIX_CONF: only its name */
	enum fix_kind kind;
	const char *check[FIX_CHECKS]; /* the checks whose findings it corrects */
	const char *why;               /* a sentence for its first lines */
	/* Fill a change; false and why not, "" = there is nothing to do. */
	bool (*build)(const struct fix_plan *plan, struct fix_change *change,
		      char why_not[FIX_LINE]);
};

extern const struct fix_row fix_rows[];
extern const size_t fix_row_count;

/* There is something to mend. */
bool fix_is_bad(const struct doctor_finding *finding);

/* A check has found something to mend. */
bool fix_is_wanted(const struct doctor_report *report, const char *check);

/* Whether a change is planned that mends it. */
bool fix_mends(const struct fix_plan *plan, const char *check);

/* Fill `plan` from the findings. */
void fix_make_plan(struct fix_plan *plan);

/* The whole path of a row's file, with the root of the computer. */
void fix_path(const struct doctor *doctor, const struct fix_row *row, char path[FIX_PATH]);

/* Its lines that are no comments, each after `indent`. */
void fix_print_lines(const struct fix_change *change, const char *indent, FILE *to);

/* Set is_there and made_folder, and take over the previous values that an existing file records. */
void fix_compare(const struct doctor *doctor, struct fix_change *change);

/* Write the file and then its values. 0, or -errno and a complaint. */
int fix_write(const struct fix_plan *plan, const struct fix_change *change);

/* A file of a row is there and is ours. */
bool fix_is_ours(const struct doctor *doctor, const struct fix_row *row);

/* Remove the file, then restore the previous values. 0, or -errno and a complaint. */
int fix_take_back(const struct doctor *doctor, const struct fix_row *row);

/* The two commands. Each returns an exit status. */
int fix_run(struct doctor *doctor, const struct doctor_report *report,
	    const struct options *options);
int fix_undo(struct doctor *doctor, const struct options *options);

#endif
