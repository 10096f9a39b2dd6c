/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * HAL lets a parameter be set to anything its type can hold, and says nothing
 * to whose it is. So the parameters of the older scheme are looked at ten times
 * a second, before anything is made of them: a value that cannot be is told
 * once and put back, so that what stands there is what counts.
 *
 * Whoever reads a parameter in the servo thread does not rely on this; it
 * comes up to a tenth of a second later.
 */
#include "halbridge/legacy_range.h"
#include <errno.h>
#include <math.h>

/* Bits can be anything they can hold. */
static bool concerned(const struct table_row *row)
{
	return row->kind == TABLE_PARAM && row->direction == TABLE_RW &&
	       row->scheme == TABLE_LEGACY && row->type != TABLE_BIT &&
	       (row->low < row->high || row->type == TABLE_FLOAT);
}

static bool can_be(const struct table_row *row, double value)
{
	return isfinite(value) &&
	       (row->low == row->high || (value >= row->low && value <= row->high));
}

int legacy_range_init(struct legacy_range *range, const struct values *values)
{
	range->count = 0;
	for (struct table_cursor at = table_walk(TABLE_LEGACY); table_next_row(&at);) {
		for (unsigned int i = 0; concerned(at.row) && i < table_row_names(at.row); i++) {
			const char *value = (const char *)values + table_offset(at.row, i);

			if (range->count == LEGACY_RANGES)
				return -ENOSPC;
			range->item[range->count++] = (struct legacy_range_item){
				.row = at.row,
				.index = i,
				.good = table_get(at.row, value),
			};
		}
	}
	return 0;
}

void legacy_range_look(struct legacy_range *range, struct values *values, legacy_refuse refuse,
		       void *argument)
{
	for (size_t i = 0; i < range->count; i++) {
		struct legacy_range_item *item = &range->item[i];
		char *at = (char *)values + table_offset(item->row, item->index);
		double value = table_get(item->row, at);

		if (can_be(item->row, value)) {
			item->good = value;
			continue;
		}
		table_put(item->row, at, item->good);
		refuse(argument, item, value);
	}
}
