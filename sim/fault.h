/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_FAULT_H
#define SIM_FAULT_H

#include <stdbool.h>

#include "sim/link.h"
#include "sim/text.h"

/*
 * The faults of the link by name, one table for the command line, the control
 * socket, the help text and the manual.
 */
enum sim_fault_unit {
	SIM_FAULT_PROBABILITY,  /* 0..1 */
	SIM_FAULT_COUNT,        /* 0..1000 */
	SIM_FAULT_MICROSECONDS, /* plain number */
	SIM_FAULT_DELAY,        /* distribution */
};

struct sim_fault_row {
	const char *name;
	enum sim_fault_unit unit;
	size_t offset; /* of the field in struct sim_link_faults */
	const char *argument;
	const char *help;
};

extern const struct sim_fault_row sim_fault_rows[];
extern const unsigned int sim_fault_count;

/* Sets one by name; false with a line in `why` if the name or the value is bad. */
bool sim_fault_set(struct sim_link_faults *faults, const char *name, const char *value,
		   struct sim_text *why);

/* One line "PREFIXname=value" for each. */
void sim_fault_print(const struct sim_link_faults *faults, const char *prefix,
		     struct sim_text *text);

#endif
