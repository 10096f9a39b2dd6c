/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Macros for the rows of the older scheme, for the files table_legacy_*.c alone.
 */
#ifndef HALBRIDGE_TABLE_LEGACY_H
#define HALBRIDGE_TABLE_LEGACY_H

#include "halbridge/table_rows.h"

#define LEGACY	.scheme = TABLE_LEGACY

/* One name; OUT pins are written at read, IN pins taken at write. */
#define L_OUT(name, member, help)	ROW(name, PIN, OUT, READ, member, help, LEGACY)
#define L_IN(name, member, help)	ROW(name, PIN, IN, WRITE, member, help, LEGACY)
#define L_IO(name, member, help)	ROW(name, PIN, IO, READ, member, help, LEGACY)
#define L_SET(name, member, help, ...)	ROW(name, PARAM, RW, READ, member, help, LEGACY,	\
					    __VA_ARGS__)

/* One for each element of an array of structs. */
#define L_OUTS(name, array, member, help)	\
	ROWS(name, PIN, OUT, READ, array, member, help, LEGACY)
#define L_INS(name, array, member, help)	\
	ROWS(name, PIN, IN, WRITE, array, member, help, LEGACY)
#define L_IOS(name, array, member, help)	\
	ROWS(name, PIN, IO, READ, array, member, help, LEGACY)
#define L_FACTS(name, array, member, help)	\
	ROWS(name, PARAM, RO, READ, array, member, help, LEGACY)
#define L_SETS(name, array, member, help, ...)	\
	ROWS(name, PARAM, RW, READ, array, member, help, LEGACY, __VA_ARGS__)

#define ANY_VALUE	PARAMETER(0, 0, 0)
#define ANY_BIT		PARAMETER(0, 0, 0)

#endif
