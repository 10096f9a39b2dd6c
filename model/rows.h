/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Macros that make rows, for the files row_*.c alone.
 *
 * The compiler takes type and size of a row from its member in the image, so they cannot
 * differ. The last arguments of each macro are the unit ("" = none) and, optionally, HELP(),
 * FACTOR(), WORDS() and TERMINAL().
 */
#ifndef MODEL_ROWS_H
#define MODEL_ROWS_H

#include <pokeys/names.h>
#include "model/model.h"

struct model_group {
	const struct model_row *rows;
	size_t count;
};

#define STATE_MEMBER(member_)	(((struct pokeys_state *)0)->member_)
#define ITEMS(array_)	(sizeof(STATE_MEMBER(array_)) / sizeof(STATE_MEMBER(array_)[0]))

#define NUMBER_TYPE(expression_) _Generic((expression_),				\
	uint8_t: MODEL_UNSIGNED, uint16_t: MODEL_UNSIGNED, uint32_t: MODEL_UNSIGNED,	\
	uint64_t: MODEL_UNSIGNED, int16_t: MODEL_SIGNED, int32_t: MODEL_SIGNED,		\
	int64_t: MODEL_SIGNED, float: MODEL_FLOAT, double: MODEL_FLOAT)

#define PLACE(name_, type_, member_)							\
	.name = name_, .image = MODEL_STATE, .type = type_,				\
	.offset = offsetof(struct pokeys_state, member_), .size = sizeof(STATE_MEMBER(member_))

/* One name. */
#define ONE(name_, type_, member_, ...)	\
	{ PLACE(name_, type_, member_), .count = 1, .unit = __VA_ARGS__ }
#define NUMBER(name_, member_, ...)	\
	ONE(name_, NUMBER_TYPE(STATE_MEMBER(member_)), member_, __VA_ARGS__)
#define FLAG(name_, member_, ...)	ONE(name_, MODEL_FLAG, member_, __VA_ARGS__)
#define AGE(name_, member_, ...)	ONE(name_, MODEL_AGE, member_, __VA_ARGS__)

/* A name for each of the first `count_` elements of an array of values. */
#define LIST(name_, type_, array_, count_, ...) {					\
	PLACE(name_, type_, array_[0]), .stride = sizeof(STATE_MEMBER(array_)[0]),	\
	.count = (count_), .unit = __VA_ARGS__ }
#define NUMBERS(name_, array_, count_, ...)	\
	LIST(name_, NUMBER_TYPE(STATE_MEMBER(array_)[0]), array_, count_, __VA_ARGS__)
#define AGES(name_, array_, count_, ...)	\
	LIST(name_, MODEL_AGE, array_, count_, __VA_ARGS__)

/* A name for each element of an array of structs. */
#define EACH(name_, type_, array_, member_, ...) {					\
	PLACE(name_, type_, array_[0].member_), .stride = sizeof(STATE_MEMBER(array_)[0]),	\
	.count = ITEMS(array_), .unit = __VA_ARGS__ }
#define EACH_NUMBER(name_, array_, member_, ...)	\
	EACH(name_, NUMBER_TYPE(STATE_MEMBER(array_)[0].member_), array_, member_, __VA_ARGS__)
#define EACH_FLAG(name_, array_, member_, ...)	\
	EACH(name_, MODEL_FLAG, array_, member_, __VA_ARGS__)
#define EACH_AGE(name_, array_, member_, ...)	\
	EACH(name_, MODEL_AGE, array_, member_, __VA_ARGS__)

/* A name for each of the first `count_` bits of a member; one of its bits. */
#define BITS(name_, member_, count_, ...) {						\
	PLACE(name_, MODEL_BIT, member_), .stride = 1, .count = (count_), .unit = __VA_ARGS__ }
#define BIT(name_, member_, mask_, ...) {						\
	PLACE(name_, MODEL_BIT, member_), .first_bit = __builtin_ctz(mask_), .count = 1,	\
	.unit = __VA_ARGS__ }

#define HELP(text_)	.help = (text_)
#define FACTOR(factor_)	.factor = (factor_)
#define WORDS(name_)	.word = (name_)
#define TERMINAL(kind_)	.terminal = MODEL_##kind_

/* For a member in nanoseconds: shown in microseconds or milliseconds. */
#define US	"us", FACTOR(1e-3)
#define MS	"ms", FACTOR(1e-6)

#define MODEL_GROUP(name_, rows_)							\
	const struct model_group name_ = {						\
		.rows = rows_, .count = sizeof(rows_) / sizeof(rows_[0]),		\
	}

extern const struct model_group model_link, model_io, model_motion, model_drive, model_device,
	model_bus, model_latency, model_heater, model_servo, model_command;

#endif
