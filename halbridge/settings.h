/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Module parameters, checked.
 */
#ifndef HALBRIDGE_SETTINGS_H
#define HALBRIDGE_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <pokeys/shm.h>
#include "halbridge/table.h"

struct settings {
	size_t count;                                    /* of devices, at least 1 */
	char device[TABLE_DEVICES][POKEYS_SHM_NAME_MAX]; /* [0] empty: the daemon's only one */
	const char *runtime;                             /* NULL = default */
	unsigned int schemes[TABLE_DEVICES];             /* of names, enum table_scheme */
};

/*
 * From the words given to loadrt; each may be NULL or empty (not given). `older`: the
 * machine is one of the older component (ini=). 0, or -EINVAL with one line in `why`:
 * what, where, what to do. Cold.
 */
int settings_read(struct settings *settings, const char *devices, const char *names, bool older,
		  const char *runtime, char *why, size_t size);

#endif
