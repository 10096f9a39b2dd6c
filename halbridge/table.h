/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The one list of the HAL interface: what is exported, bound, documented and
 * tested comes from here. A new name is a new row (and its member in
 * values.h).
 */
#ifndef HALBRIDGE_TABLE_H
#define HALBRIDGE_TABLE_H

#include <stddef.h>
#include <stdint.h>

enum {
	TABLE_NAME_MAX = 47,		/* HAL_NAME_LEN */
	TABLE_DEVICES = 8,		/* pokeys.0 .. pokeys.7 */
};

enum table_kind { TABLE_PIN, TABLE_PARAM };
enum table_type { TABLE_BIT, TABLE_FLOAT, TABLE_S32, TABLE_U32, TABLE_TYPES };
enum table_direction { TABLE_IN, TABLE_OUT, TABLE_IO, TABLE_RO, TABLE_RW };

/*
 * Which funct carries the pin: an IN pin is read at the start of that funct,
 * an OUT pin written at its end. I/O pins are carried by both.
 */
enum table_when { TABLE_AT_READ, TABLE_AT_WRITE, TABLE_WHENS };

struct table_row {
	const char *name;		/* after "pokeys.N."; "%02u" where the index stands */
	uint8_t kind, type, direction, when;
	uint16_t offset, stride;	/* in struct values, bytes */
	uint16_t count;			/* names the row makes; 1 without index */
	double initial;			/* of a parameter */
	const char *help;
};

extern const struct table_row table_rows[];
extern const size_t table_row_count;

/* Names of one device: pins, and pins and parameters together. */
size_t table_pin_count(void);
size_t table_name_count(void);

/*
 * The whole HAL name of one instance of a row. Returns its length, or
 * -ENAMETOOLONG if HAL would not take it.
 */
int table_name(const struct table_row *row, unsigned int device, unsigned int index,
	       char name[TABLE_NAME_MAX + 1]);

/* As halcmd prints them: "bit", "IN" … */
const char *table_type_name(unsigned int type);
const char *table_direction_name(unsigned int direction);

/* Put every parameter to its initial value; `values` is a struct values. */
void table_set_parameters(void *values);

#endif
