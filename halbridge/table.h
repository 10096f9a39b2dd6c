/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The one list of the HAL interface: what is exported, bound, documented and
 * tested comes from here. A new name is a new row (and its member in
 * values.h). The rows stand in one array per group (table_*.c, made with the
 * macros of table_rows.h); everybody else walks over names with table_next().
 */
#ifndef HALBRIDGE_TABLE_H
#define HALBRIDGE_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
	TABLE_NAME_MAX = 47, /* HAL_NAME_LEN */
	TABLE_DEVICES = 8,   /* pokeys.0 .. pokeys.7 */
};

/* Naming schemes; a set of them. A name of both is one name, not two. */
enum table_scheme {
	TABLE_CORE = 1, /* the canonical ones, but for those set apart */
	TABLE_LEGACY = 2,
	TABLE_BOTH = 3,
	TABLE_PONET = 4, /* of the legacy ones, those of each PoNET module */
	TABLE_APART = 8, /* canonical ones for which names=both has no room */
	TABLE_CANONICAL = 9,
	TABLE_FORMER = 16,      /* of earlier versions, for machines of that time alone */
	TABLE_HEATER = 32,      /* of heaters; few machines have any */
	TABLE_HEATER_GAIN = 64, /* likewise, for which names=all has no room */
	TABLE_HEATERS = 105,    /* the canonical ones and these */
	TABLE_SERVO = 128,      /* of servo motors, likewise */
	TABLE_SERVO_GAIN = 256,
	TABLE_SERVOS = 393,
	TABLE_LOOPS = 489, /* the canonical ones, those of heaters and of motors */
	TABLE_ALL = 175,   /* all but the gains and those of earlier versions */
};
enum table_kind { TABLE_PIN, TABLE_PARAM };
enum table_type { TABLE_BIT, TABLE_FLOAT, TABLE_S32, TABLE_U32, TABLE_TYPES };
enum table_direction { TABLE_IN, TABLE_OUT, TABLE_IO, TABLE_RO, TABLE_RW };

/*
 * Which funct carries the pin: an IN pin is read at the start of that funct,
 * an OUT pin written at its end. I/O pins are read's, at its start and end.
 */
enum table_when { TABLE_AT_READ, TABLE_AT_WRITE, TABLE_WHENS };

/*
 * Several rows may stand on one member: OUT pins all get its value, of IN pins
 * the one that changed last counts, parameters share the storage.
 */
struct table_row {
	const char *name; /* after "pokeys.N."; "%u" where an index stands */
	const char *help;
	double initial;   /* of a parameter */
	double low, high; /* of a parameter, low == high: whatever its type takes */
	uint16_t offset;  /* of the first one in struct values, bytes */
	int16_t stride, inner_stride;
	uint16_t count;             /* of the (first) index */
	uint8_t inner;              /* of the second index; 0 = there is none */
	uint8_t first, inner_first; /* where the indices in the name begin */
	uint16_t scheme;            /* 0 = TABLE_CORE */
	uint8_t kind, type, direction, when;
};

struct table_group {
	const struct table_row *rows;
	size_t count;
};

extern const struct table_group *const table_groups[];
extern const size_t table_group_count;

/* A walk over the exported names, in the order in which all of us count them. */
struct table_cursor {
	const struct table_row *row; /* of the name it stands at */
	unsigned int index;          /* which of the row's names */
	size_t offset;               /* its member in struct values */
	unsigned int schemes;
	size_t group, next_row, left;
};

/* Begin before the first name of these schemes (a set of enum table_scheme). */
struct table_cursor table_walk(unsigned int schemes);

/* Go to the next name; false at the end. */
bool table_next(struct table_cursor *cursor);

/* The same for all rows of these schemes; only row is valid. */
bool table_next_row(struct table_cursor *cursor);

/* Names of one device in these schemes: pins, and pins and parameters together. */
size_t table_pin_count(unsigned int schemes);
size_t table_name_count(unsigned int schemes);

/* Names a row makes, and where the member of one of them stands. */
size_t table_row_names(const struct table_row *row);
size_t table_offset(const struct table_row *row, unsigned int index);

/*
 * The whole HAL name of one instance of a row. Returns its length, or
 * -ENAMETOOLONG if HAL would not take it.
 */
int table_name(const struct table_row *row, unsigned int device, unsigned int index,
	       char name[TABLE_NAME_MAX + 1]);

/* The same with another prefix than "pokeys.<device>". */
int table_full_name(const struct table_row *row, const char *prefix, unsigned int index,
		    char name[TABLE_NAME_MAX + 1]);

/* Bytes of a type. */
size_t table_type_size(unsigned int type);

/* As halcmd prints them: "bit", "IN" … */
const char *table_type_name(unsigned int type);
const char *table_direction_name(unsigned int direction);

/* The value of a member of a row's type, and setting it. A bit is the byte it is. */
double table_get(const struct table_row *row, const void *at);
void table_put(const struct table_row *row, void *at, double value);

/* Put every parameter to its initial value; `values` is a struct values. */
void table_set_parameters(void *values);

#endif
