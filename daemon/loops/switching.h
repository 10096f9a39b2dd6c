/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A power between nothing and everything by an output that can only be on or off, such as a relay:
 * it stays on or off for a least time, and what is too much or too little is made up for later.
 * Pure; realtime.
 */
#ifndef LOOPS_SWITCHING_H
#define LOOPS_SWITCHING_H

#include <stdbool.h>
#include <stdint.h>

struct switching {
	uint64_t least_ns; /* on, and off; at least a step */
	bool on;
	uint64_t since_ns; /* of the last change */
	uint64_t last_ns;  /* step; 0: none yet */
	double owed;       /* seconds of full power */
};

/*
 * The output from now on for a power of 0 to 1.
 * A power of 0 may well keep it on for its least time. With `stop` it is off at once, and owes
 * nothing: for a heater that is off or has a fault (heater_is_off()).
 */
bool switching_step(struct switching *output, double power, bool stop, uint64_t now_ns);

#endif
