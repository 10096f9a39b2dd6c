/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_OPTIONS_H
#define SIM_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "sim/rig.h"
#include "sim/text.h"

/* What pokeys-sim is asked to do. Strings point into argv. */
struct sim_options {
	struct sim_rig_options rig;
	uint16_t port;
	const char *preset;
	const char *script;
	const char *control; /* path of the control socket */
	int ready_fd;        /* -1 none */
	int cpu;             /* -1 any */
	bool tcp;
	bool discovery;
	bool spin;
	bool quiet;
	bool help;
	bool version;
};

/*
 * Reads the command line. False with one line in `why` when something is
 * wrong: the option, its value, what is allowed.
 */
bool sim_options_parse(struct sim_options *options, int argc, char **argv, struct sim_text *why);

/* Prints all options. */
void sim_options_help(FILE *to);

#endif
