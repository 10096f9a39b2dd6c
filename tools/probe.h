/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the kernel says in /proc and /sys, below a root: "" is this machine,
 * another folder a copy of one. Cold; nothing here needs a privilege, and what
 * cannot be read is told apart from what is not so.
 */
#ifndef TOOLS_PROBE_H
#define TOOLS_PROBE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { PROBE_TEXT = 4096 };

/* A file whole (at most size - 1 bytes), without the newline at its end. */
bool probe_text(const char *root, char *text, size_t size, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

/* A file or folder, whatever may be in it. */
bool probe_exists(const char *root, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* A file that begins with a number. */
bool probe_number(const char *root, long *value, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Is core `cpu` in a list as "0-2,5"? */
bool probe_list_has(const char *list, int cpu);

/* Is a core of a higher number in it? */
bool probe_list_has_above(const char *list, int cpu);

/* The first core of `list` (-1 if none) that is not `cpu`. */
int probe_list_other(const char *list, int cpu);

/*
 * Bytes of the kernel's command line behind "name=", empty without that: false if it is not
 * there. Of several the last one, which is the one that the kernel goes by.
 */
bool probe_command_line(const char *root, const char *name, char *value, size_t size);

/* Value of a line "name<separator> value" in a text. */
bool probe_line(const char *text, const char *name, char *value, size_t size);

/*
 * The id of the first process that calls itself so, 0 if none; -1 if /proc
 * cannot be read.
 */
int probe_process(const char *root, const char *name);

/* The realtime thread of a process that has the highest priority. */
struct probe_thread {
	int priority;   /* 0: it has none */
	char cores[64]; /* that it may run on, as "0-2" */
};

/* False if the process cannot be looked at. */
bool probe_realtime_thread(const char *root, int process, struct probe_thread *thread);

/* Who has `path` open: "name (pid)", of those that we may look at. Returns how many. */
unsigned int probe_holders(const char *root, const char *path, char *text, size_t size);

/* A virtual machine? 1 yes, 0 no sign of one, -1 could not be seen. */
int probe_virtual(const char *root);

#endif
