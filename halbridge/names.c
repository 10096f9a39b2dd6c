/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Questions about the table: names, counts, initial values.
 *
 * A name is built here and nowhere else, so the export, the man page and the
 * tests cannot disagree. HAL cuts nothing: a name longer than 47 characters
 * is refused here, before HAL refuses it in the middle of an export.
 */
#include <errno.h>
#include <stdio.h>
#include "halbridge/table.h"
#include "halbridge/values.h"

size_t table_pin_count(unsigned int schemes)
{
	size_t count = 0;

	for (struct table_cursor name = table_walk(schemes); table_next(&name);)
		count += name.row->kind == TABLE_PIN;
	return count;
}

size_t table_name_count(unsigned int schemes)
{
	size_t count = 0;

	for (struct table_cursor name = table_walk(schemes); table_next(&name);)
		count++;
	return count;
}

int table_full_name(const struct table_row *row, const char *prefix, unsigned int index,
		    char name[TABLE_NAME_MAX + 1])
{
	const size_t size = TABLE_NAME_MAX + 1;
	unsigned int inner = row->inner ? row->inner : 1;
	int length = snprintf(name, size, "%s.", prefix);
	int rest;

	if (length > TABLE_NAME_MAX)
		return -ENAMETOOLONG;
	/* A row with fewer indices has fewer conversions and leaves the rest unused. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
	rest = snprintf(name + length, size - (size_t)length, row->name, index / inner + row->first,
			index % inner + row->inner_first);
#pragma GCC diagnostic pop
	return length + rest > TABLE_NAME_MAX ? -ENAMETOOLONG : length + rest;
}

int table_name(const struct table_row *row, unsigned int device, unsigned int index,
	       char name[TABLE_NAME_MAX + 1])
{
	char prefix[sizeof("pokeys.") + 10];

	snprintf(prefix, sizeof(prefix), "pokeys.%u", device);
	return table_full_name(row, prefix, index, name);
}

size_t table_type_size(unsigned int type)
{
	static const size_t sizes[] = { sizeof(bool), sizeof(double), 4, 4 };

	return sizes[type];
}

const char *table_type_name(unsigned int type)
{
	static const char *const names[] = { "bit", "float", "s32", "u32" };

	return names[type];
}

const char *table_direction_name(unsigned int direction)
{
	static const char *const names[] = { "IN", "OUT", "I/O", "RO", "RW" };

	return names[direction];
}

double table_get(const struct table_row *row, const void *at)
{
	switch ((enum table_type)row->type) {
	case TABLE_BIT:
		return *(const volatile uint8_t *)at;
	case TABLE_FLOAT:
		return *(const param_float *)at;
	case TABLE_S32:
		return *(const param_s32 *)at;
	case TABLE_U32:
		/* the older component had signed numbers in unsigned parameters */
		return row->low < 0 ? (double)(int32_t)*(const param_u32 *)at :
				      (double)*(const param_u32 *)at;
	case TABLE_TYPES:
		break;
	}
	return 0;
}

void table_put(const struct table_row *row, void *at, double value)
{
	switch ((enum table_type)row->type) {
	case TABLE_BIT:
		*(volatile uint8_t *)at = (uint8_t)value;
		break;
	case TABLE_FLOAT:
		*(param_float *)at = value;
		break;
	case TABLE_S32:
		*(param_s32 *)at = (int32_t)(int64_t)value;
		break;
	case TABLE_U32:
		*(param_u32 *)at = (uint32_t)(int64_t)value;
		break;
	case TABLE_TYPES:
		break;
	}
}

void table_set_parameters(void *values)
{
	for (struct table_cursor row = table_walk(TABLE_ALL | TABLE_LOOPS); table_next_row(&row);) {
		for (unsigned int k = 0; k < table_row_names(row.row); k++) {
			if (row.row->kind == TABLE_PARAM)
				table_put(row.row,
					  (unsigned char *)values + table_offset(row.row, k),
					  row.row->initial);
		}
	}
}
