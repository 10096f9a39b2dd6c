/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_CONTROL_H
#define SIM_CONTROL_H

/*
 * Commands in plain words for the bench, the link and the device itself; the
 * control socket and scripts speak them. One line in; out come any number of
 * lines "key=value" and then one line "ok" or "error: reason". Pins count from
 * 1 here, as printed on the board; axes and encoders from 0, as on the wire.
 */

#include <stdbool.h>
#include <stdint.h>

#include "sim/rig.h"
#include "sim/text.h"

#define SIM_CONTROL_WORDS 12
#define SIM_CONTROL_LINE 512	/* longest command */
#define SIM_CONTROL_REPLY 16384	/* room a reply may need */

struct sim_control {
	struct sim_rig *rig;
	uint64_t now_ns;
	bool exit; /* "exit" was asked for */
};

/*
 * Runs one line at now_ns (the line is taken apart in place). Returns whether
 * it was good. An empty line and a comment are good and do nothing.
 */
bool sim_control_run(struct sim_control *control, uint64_t now_ns, char *line,
		     struct sim_text *out);

#endif
