/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The values that a command line names, by name or with wildcards. Cold, main thread. */
#ifndef TOOLS_CHOOSE_H
#define TOOLS_CHOOSE_H

#include <stdbool.h>
#include <stddef.h>
#include "model/model.h"

/* No pattern chooses everything. */
struct choice {
	char *const *patterns; /* as fnmatch(3) has them */
	size_t count;
	bool readable; /* not what is only commanded */
};

bool choose(const struct choice *choice, const char *name);

/* Every name that is chosen, in the table's order. */
typedef void choose_function(void *argument, const struct model_row *row, unsigned int index,
			     const char *name);
void choose_each(const struct choice *choice, choose_function *each, void *argument);

/* The only name that can be meant, or NULL. */
const char *choose_only(const struct choice *choice);

/* STATUS_OK, or STATUS_USAGE after an error message if a pattern matches no name. */
int choose_check(const struct choice *choice, const char *command);

#endif
