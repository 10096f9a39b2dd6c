/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the userspace component is told on its command line.
 */
#ifndef HALBRIDGE_POKEYS_OPTIONS_H
#define HALBRIDGE_POKEYS_OPTIONS_H

#include <stddef.h>
#include "halbridge/instance.h"
#include "halbridge/table.h"

struct pokeys_options {
	size_t count;                                /* of instances, at least 1 */
	char prefix[TABLE_DEVICES][INSTANCE_PREFIX]; /* of their names */
	const char *runtime;                         /* of the daemon; NULL = default */
	unsigned int schemes;                        /* that the first one has besides */
};

/* count=N or names=A,B, runtime=FOLDER, loops=WORD. 0, or -EINVAL with a line in `why`. Cold. */
int pokeys_options_read(struct pokeys_options *options, int argc, char **argv, char *why,
			size_t size);

#endif
