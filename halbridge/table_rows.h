/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Macros that make rows, for the files table_*.c alone.
 *
 * The type of a row is taken from its member in struct values by the
 * compiler, so the two cannot differ.
 */
#ifndef HALBRIDGE_TABLE_ROWS_H
#define HALBRIDGE_TABLE_ROWS_H

#include <math.h>
#include "halbridge/table.h"
#include "halbridge/values.h"

#define ROW_MEMBER(member_)	(((struct values *)0)->member_)

#define ROW_TYPE(member_) _Generic(ROW_MEMBER(member_),				\
	bool: TABLE_BIT, double: TABLE_FLOAT, int32_t: TABLE_S32, uint32_t: TABLE_U32)

#define ROW_COUNT(array_) \
	(sizeof(ROW_MEMBER(array_)) / sizeof(ROW_MEMBER(array_)[0]))

/* What every row has. The macros below end in the help text and what else is to be said. */
#define ROW_COMMON(name_, kind_, direction_, when_, member_)				\
	.name = name_, .kind = TABLE_##kind_, .type = ROW_TYPE(member_),		\
	.direction = TABLE_##direction_, .when = TABLE_AT_##when_,			\
	.offset = offsetof(struct values, member_)

/* One name. */
#define ROW(name_, kind_, direction_, when_, member_, ...) {				\
	ROW_COMMON(name_, kind_, direction_, when_, member_), .count = 1,		\
	.help = __VA_ARGS__ }

/* A name for each element of an array of structs. */
#define ROWS(name_, kind_, direction_, when_, array_, member_, ...) {			\
	ROW_COMMON(name_, kind_, direction_, when_, array_[0].member_),			\
	.stride = sizeof(ROW_MEMBER(array_)[0]), .count = ROW_COUNT(array_),		\
	.help = __VA_ARGS__ }

/* A name for each of the first `count_` elements of an array of values. */
#define LIST(name_, kind_, direction_, when_, array_, count_, ...) {			\
	ROW_COMMON(name_, kind_, direction_, when_, array_[0]),				\
	.stride = sizeof(ROW_MEMBER(array_)[0]), .count = (count_),			\
	.help = __VA_ARGS__ }

#define BOTH_SCHEMES	.scheme = TABLE_BOTH
#define APART		.scheme = TABLE_APART
#define OF_HEATERS	.scheme = TABLE_HEATER
#define OF_SERVOS	.scheme = TABLE_SERVO
#define GAIN_OF_HEATERS	.scheme = TABLE_HEATER_GAIN
#define GAIN_OF_SERVOS	.scheme = TABLE_SERVO_GAIN

/* Initial value, least and most of a parameter. */
#define PARAMETER(initial_, low_, high_)	\
	.initial = (initial_), .low = (low_), .high = (high_)

/* The device's own settings: as it has them until somebody sets them. */
#define SETTING(low_, high_)	PARAMETER(-1, low_, high_)
#define SETTING_FLOAT(low_, high_)	PARAMETER((double)NAN, low_, high_)

#define TABLE_GROUP(name_, rows_)							\
	const struct table_group name_ = {						\
		.rows = rows_, .count = sizeof(rows_) / sizeof(rows_[0]),		\
	}

extern const struct table_group table_link, table_info, table_io, table_analog, table_encoder,
	table_joint, table_axis, table_task, table_engine, table_bus, table_keys, table_diagnostics,
	table_failsafe, table_drive, table_heater, table_servo, table_threading, table_legacy_io,
	table_legacy_axis, table_legacy_engine, table_legacy_choice, table_legacy_ponet,
	table_legacy_former;

#endif
