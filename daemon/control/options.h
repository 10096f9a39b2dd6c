/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The command line of pokeysd. */
#ifndef CONTROL_OPTIONS_H
#define CONTROL_OPTIONS_H

#include <stdbool.h>

/* Exit statuses, as pokeysd(8) lists them (sysexits.h where it has one). */
enum {
	STATUS_OK = 0,
	STATUS_FAILED = 1, /* while running, or a system call that has to work */
	STATUS_USAGE = 64,
	STATUS_BUSY = 75,     /* another daemon holds the runtime folder */
	STATUS_NO_RIGHT = 77, /* realtime priority or locked memory refused */
	STATUS_CONFIG = 78,
};

struct options {
	const char *config;
	const char *runtime_directory; /* NULL = the configuration's */
	bool check_config;
	bool clear;
	bool no_realtime;
};

/*
 * Take the command line apart. Returns true to go on; false if all is said
 * and done (--help, a mistake), and then *status is how to exit.
 */
bool options_parse(struct options *options, int argc, char **argv, int *status);

#endif
