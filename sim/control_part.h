/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_CONTROL_PART_H
#define SIM_CONTROL_PART_H

/* What the files of the control language share. */

#include "sim/bench.h"
#include "sim/control.h"
#include "sim/parse.h"

/* One command being executed: words after its name, NULL beyond the last. */
struct sim_order {
	struct sim_control *control;
	struct sim_rig *rig;
	struct sim_device *dev;
	char *word[SIM_CONTROL_WORDS + 1];
	struct sim_text *out; /* lines of the reply */
	struct sim_text *why; /* the reason, when refused */
};

struct sim_command {
	const char *name;
	const char *arguments;
	const char *help;
	bool (*run)(struct sim_order *order);
};

/* Tables of the files, each ended by a row without a name. */
extern const struct sim_command sim_commands_io[];
extern const struct sim_command sim_commands_motion[];
extern const struct sim_command sim_commands_bus[];
extern const struct sim_command sim_commands_system[];
extern const struct sim_command sim_commands_field[];

/* Word i as a number; adds the reason to order->why. */
bool sim_order_integer(struct sim_order *order, int i, const char *what, int64_t low, int64_t high,
		       int64_t *value);
bool sim_order_choice(struct sim_order *order, int i, const char *what, const char *choices,
		      unsigned int *value);

/* Refuses words beyond number `most`. */
bool sim_order_no_more(struct sim_order *order, int most);

/* control_stat.c: everything worth knowing, one key=value a line. */
bool sim_control_stat(struct sim_order *order);

#endif
