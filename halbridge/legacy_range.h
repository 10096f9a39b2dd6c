/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Parameters of the older scheme that were set to what they cannot be.
 */
#ifndef HALBRIDGE_LEGACY_RANGE_H
#define HALBRIDGE_LEGACY_RANGE_H

#include <stddef.h>
#include "halbridge/table.h"
#include "halbridge/values.h"

enum { LEGACY_RANGES = 1280 }; /* parameters, at most */

struct legacy_range_item {
	const struct table_row *row;
	unsigned int index;
	double good; /* the last value that could be */
};

struct legacy_range {
	size_t count;
	struct legacy_range_item item[LEGACY_RANGES];
};

/* Begin, with what the parameters are now. 0, or -ENOSPC. Cold. */
int legacy_range_init(struct legacy_range *range, const struct values *values);

/*
 * Look at all: one that is no number or out of its row's range gets its last
 * good value back, and `refuse` is called with the other. Cold, one thread.
 */
typedef void (*legacy_refuse)(void *argument, const struct legacy_range_item *item, double value);
void legacy_range_look(struct legacy_range *range, struct values *values, legacy_refuse refuse,
		       void *argument);

#endif
