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

size_t table_pin_count(void)
{
	size_t count = 0;

	for (size_t i = 0; i < table_row_count; i++)
		count += table_rows[i].kind == TABLE_PIN ? table_rows[i].count : 0;
	return count;
}

size_t table_name_count(void)
{
	size_t count = 0;

	for (size_t i = 0; i < table_row_count; i++)
		count += table_rows[i].count;
	return count;
}

int table_name(const struct table_row *row, unsigned int device, unsigned int index,
	       char name[TABLE_NAME_MAX + 1])
{
	const size_t size = TABLE_NAME_MAX + 1;
	int prefix = snprintf(name, size, "pokeys.%u.", device);
	int rest;

	/* A row without index has no conversion and leaves the argument unused. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
	rest = snprintf(name + prefix, size - (size_t)prefix, row->name, index);
#pragma GCC diagnostic pop
	return prefix + rest > TABLE_NAME_MAX ? -ENAMETOOLONG : prefix + rest;
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

static void set_parameter(const struct table_row *row, void *at)
{
	switch ((enum table_type)row->type) {
	case TABLE_BIT:
		*(volatile bool *)at = row->initial != 0;
		break;
	case TABLE_FLOAT:
		*(param_float *)at = row->initial;
		break;
	case TABLE_S32:
		*(param_s32 *)at = (int32_t)row->initial;
		break;
	case TABLE_U32:
		*(param_u32 *)at = (uint32_t)row->initial;
		break;
	case TABLE_TYPES:
		break;
	}
}

void table_set_parameters(void *values)
{
	for (size_t i = 0; i < table_row_count; i++) {
		const struct table_row *row = &table_rows[i];

		for (size_t k = 0; row->kind == TABLE_PARAM && k < row->count; k++)
			set_parameter(row, (unsigned char *)values + row->offset + k * row->stride);
	}
}
