/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One table of names: every value of a device, with its name, type, unit and meaning, its
 * position in an image, and the terminal it belongs to.
 *
 * A value that HAL also shows has HAL's canonical name, and its help text comes from HAL's
 * table. A pin that depends on something only LinuxCNC knows (a scale, a reset) cannot be read
 * from the images, so it has no row; the device's own number has a row under another name
 * (joint.00.counts, compared with HAL's joint.00.pos-fb). Each group of rows is an array in
 * its own file (row_*.c, made with the macros of rows.h).
 *
 * Everything here is pure and cold. The tables are constant.
 */
#ifndef MODEL_MODEL_H
#define MODEL_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <pokeys/state.h>

enum { MODEL_NAME_MAX = 47, MODEL_TEXT_MAX = 32 };

/* The image that a row's value is in. */
enum model_image {
	MODEL_STATE,
	MODEL_DIAG,
	MODEL_JUDGEMENT,
	MODEL_COMMAND, /* written and not read: by one commander */
	MODEL_IMAGES,
};

enum model_type {
	MODEL_BIT,  /* one bit, little-endian from offset on */
	MODEL_FLAG, /* a byte, true if it is not 0 */
	MODEL_UNSIGNED,
	MODEL_SIGNED,
	MODEL_FLOAT,    /* of `size` bytes */
	MODEL_TEXT,     /* `size` bytes, NUL terminated if shorter */
	MODEL_ADDRESS,  /* IPv4, host byte order */
	MODEL_AGE,      /* a time stamp, CLOCK_MONOTONIC ns; shown as time since then */
	MODEL_QUANTILE, /* a struct pokeys_histogram; the duration at `quantile` */
	MODEL_TYPES,
};

/* How the number in a name relates to a terminal of the board. */
enum model_terminal {
	MODEL_NO_TERMINAL,
	MODEL_PIN,    /* terminal = index + 1 */
	MODEL_ANALOG, /* terminal = index + 41 */
	MODEL_PWM,    /* depends on the board */
	MODEL_OUTPUT, /* an output without a terminal number, but with a label */
};

struct model_row {
	const char *name;                   /* after "pokeys.N."; "%02u", "%u" for an index */
	const char *help;                   /* NULL: HAL's */
	const char *unit;                   /* "" = none */
	const char *(*word)(uint8_t value); /* NULL = its numbers have no words */
	double factor;                      /* shown = number * factor; 0 = as it is */
	double quantile;                    /* 0..1 */
	uint16_t offset;                    /* of the first one, bytes */
	uint16_t stride, inner_stride;      /* bytes, of MODEL_BIT bits */
	uint16_t count;                     /* of the first index */
	uint8_t inner;                      /* of the second index, from 0; 0 = there is none */
	uint8_t first_bit;                  /* of MODEL_BIT */
	uint8_t size;
	uint16_t whole; /* shown = number / the uint32_t at this offset; 0 = not */
	uint8_t image, type, terminal;
	/* of what is commanded */
	double low, high; /* as shown; low == high: whatever its type takes */
	uint16_t mask;    /* byte of the bit that says that it is commanded; 0 = none */
	uint8_t mask_bit, mask_stride; /* the first such bit; from one first index to the next */
};

/* Computed by the reader from the time stamps and its own clock; treated as an image. */
struct model_judgement {
	double age_us; /* of the fast data; infinite if there are none */
	uint8_t connected, stale, daemon_alive;
};

struct model_images {
	const void *image[MODEL_IMAGES]; /* NULL = not there */
	uint64_t now_ns;
};

enum model_kind {
	MODEL_UNKNOWN, /* the image says that it is not known */
	MODEL_BOOLEAN,
	MODEL_NATURAL,
	MODEL_INTEGER,
	MODEL_REAL,
	MODEL_STRING,
};

struct model_value {
	enum model_kind kind;
	union {
		bool boolean;
		uint64_t natural;
		int64_t integer;
		double real;
		char string[MODEL_TEXT_MAX];
	};
	const char *word; /* what the number stands for; NULL = no word */
};

/* Row `number`, from 0; NULL after the last one. */
const struct model_row *model_row(size_t number);

/* Names that a row makes. */
unsigned int model_names(const struct model_row *row);

/* The name of one of them, without "pokeys.N.". */
void model_name(const struct model_row *row, unsigned int index, char name[MODEL_NAME_MAX + 1]);

/* "pin.%02u.in" is written "pin.NN.in", a second index N. */
void model_pattern(const struct model_row *row, char name[MODEL_NAME_MAX + 1]);

/* The row that HAL's table has under this name, or NULL. */
struct table_row;
const struct table_row *model_hal_row(const struct model_row *row);

/* The meaning in one line; never NULL. */
const char *model_help(const struct model_row *row);

/* The type of the shown value ("bit", "unsigned" …): with a factor, it is "float". */
const char *model_type_name(const struct model_row *row);

/* Find a name. False if there is none. */
bool model_find(const char *name, const struct model_row **row, unsigned int *index);

/* A pin of HAL that has no row. */
struct model_alone {
	const char *name;    /* as HAL's table has it */
	const char *instead; /* the pattern of what the device has; NULL = nothing like it */
};

/* Pin `number`, from 0; NULL after the last one. */
const struct model_alone *model_alone(size_t number);

/*
 * Is it a name of LinuxCNC's HAL, of any scheme, without "pokeys.N."? *instead is then the
 * pattern of what the device has, or NULL.
 */
bool model_is_hal_name(const char *name, const char **instead);

/* Read a value. It is MODEL_UNKNOWN if its image is missing. */
void model_read(const struct model_row *row, unsigned int index, const struct model_images *images,
		struct model_value *value);

/*
 * The terminal on the board with this hardware id, from 1; 0 = it has none, or the board is
 * not known. *label is what the board's maker calls it, or NULL.
 */
unsigned int model_board_terminal(const struct model_row *row, unsigned int index, uint8_t hardware,
				  const char **label);

#endif
