/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The list of groups, and the walk over all names.
 *
 * Everybody who deals with names walks here, for two reasons. The export, the
 * binding and the tests count pins, and must count the same. And the two
 * schemes meet: one pads its indices to two digits, the other does not, so
 * that from 10 on `encoder.10.count` is a name of both. HAL has it once: the
 * row that stands first in this list makes it, the other row begins to differ
 * only below 10 (so the canonical groups stand first).
 */
#include "halbridge/table.h"
#include <string.h>
#include "halbridge/table_rows.h"

const struct table_group *const table_groups[] = {
	&table_link,          &table_engine,       &table_info,          &table_io,
	&table_analog,        &table_encoder,      &table_joint,         &table_axis,
	&table_task,          &table_bus,          &table_keys,          &table_failsafe,
	&table_drive,         &table_heater,       &table_servo,         &table_threading,
	&table_diagnostics,   &table_legacy_io,    &table_legacy_engine, &table_legacy_axis,
	&table_legacy_choice, &table_legacy_ponet, &table_legacy_former,
};

const size_t table_group_count = sizeof(table_groups) / sizeof(table_groups[0]);

static unsigned int schemes_of(const struct table_row *row)
{
	return row->scheme ? row->scheme : TABLE_CORE;
}

size_t table_row_names(const struct table_row *row)
{
	return row->inner ? (size_t)row->count * row->inner : row->count;
}

size_t table_offset(const struct table_row *row, unsigned int index)
{
	unsigned int inner = row->inner ? row->inner : 1;

	return (size_t)(row->offset + (int)(index / inner) * row->stride +
			(int)(index % inner) * row->inner_stride);
}

struct table_cursor table_walk(unsigned int schemes)
{
	return (struct table_cursor){ .schemes = schemes };
}

bool table_next_row(struct table_cursor *cursor)
{
	while (cursor->group < table_group_count) {
		const struct table_group *group = table_groups[cursor->group];

		if (cursor->next_row == group->count) {
			cursor->group++;
			cursor->next_row = 0;
			continue;
		}
		cursor->row = &group->rows[cursor->next_row++];
		if (schemes_of(cursor->row) & cursor->schemes)
			return true;
	}
	return false;
}

/* The next place where two patterns differ, but for the padding of an index. */
static bool same_but_padding(const char *a, const char *b)
{
	while (*a && *a == *b) {
		a++;
		b++;
	}
	if (a[0] == '0' && a[1] == '2')
		a += 2;
	else if (b[0] == '0' && b[1] == '2')
		b += 2;
	return a[0] == 'u' && !strcmp(a, b);
}

/* Does a row before this one make the same names from index 10 on? */
static bool has_twin(const struct table_cursor *at)
{
	struct table_cursor before = table_walk(at->schemes);

	if (at->row->count <= 10 || at->row->inner)
		return false;
	while (table_next_row(&before) && before.row != at->row) {
		if (same_but_padding(before.row->name, at->row->name))
			return true;
	}
	return false;
}

bool table_next(struct table_cursor *cursor)
{
	if (cursor->left) {
		cursor->left--;
		cursor->index++;
	} else if (table_next_row(cursor)) {
		cursor->index = 0;
		cursor->left = (has_twin(cursor) ? 10u - cursor->row->first :
						   table_row_names(cursor->row)) -
			       1;
	} else {
		return false;
	}
	cursor->offset = table_offset(cursor->row, cursor->index);
	return true;
}
