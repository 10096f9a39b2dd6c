/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_SCRIPT_H
#define SIM_SCRIPT_H

/*
 * A file of control commands which run by themselves, in time with the device:
 *
 *	pin 9 0			at once
 *	wait 500		half a second after the command before
 *	emergency pressed
 *	at 3000 exit		three seconds after the start
 *
 * Times count from the start of the script and may not go back.
 */

#include "sim/control.h"

#define SIM_SCRIPT_LINES 2048

struct sim_script_line {
	uint64_t at_ns;      /* since the start */
	unsigned int number; /* line of the file */
	char *command;
};

struct sim_script {
	char *text; /* the file; the lines point into it */
	unsigned int count;
	unsigned int next;
	struct sim_script_line line[SIM_SCRIPT_LINES];
};

/*
 * Takes a text apart; it is changed, and used until the script is done. False
 * with "line N: ..." in `why` when a time is bad. Commands are checked when
 * they run.
 */
bool sim_script_parse(struct sim_script *script, char *text, struct sim_text *why);

/* Nanoseconds since the start at which the next command is due; UINT64_MAX at the end. */
uint64_t sim_script_next(const struct sim_script *script);

/*
 * Runs what is due `since_ns` after the start, which is now_ns. Stops at a
 * command which is refused and returns false with "line N: ..." in `why`.
 */
bool sim_script_run(struct sim_script *script, struct sim_control *control, uint64_t since_ns,
		    uint64_t now_ns, struct sim_text *why);

#endif
