/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's own settings as a person writes them: name, range and text of
 * every member of struct pokeys_settings.
 *
 * Pure: no file, no line, no allocation. Any thread.
 */
#ifndef SETTINGS_KEY_H
#define SETTINGS_KEY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <pokeys/settings.h>

enum settings_type {
	SETTINGS_NUMBER,       /* integer: words, or minimum..maximum */
	SETTINGS_REAL,         /* float */
	SETTINGS_PIN_FUNCTION, /* terminals that have the function `bits` */
	SETTINGS_PIN_FLAG,     /* terminals that have it besides another function */
	SETTINGS_PIN_PAIR,     /* two terminals, one after the other in memory, 0-based */
	SETTINGS_PIN_ROW,      /* terminals in order, 0-based; `counted` is their number */
	SETTINGS_PIN_BITS,     /* bit array of terminals */
	SETTINGS_BYTES,        /* numbers minimum..maximum; what is not given is 0 */
	SETTINGS_TEXT,         /* characters, NUL terminated */
};

struct settings_word {
	const char *name;
	int64_t value; /* as in the field (within `bits`) */
};

struct settings_key {
	const char *name; /* '#' stands for an index */
	enum settings_type type;
	size_t offset, size;         /* of the field of index 0 */
	size_t set_offset, set_size; /* of the word that says whether it is meant */
	uint32_t set_bits;
	uint32_t bits;          /* the part of the field that is this key; 0 = all */
	size_t counted;         /* SETTINGS_PIN_ROW: offset of the number of terminals */
	uint32_t count, stride; /* indices 0..count-1 (0 = no index), bytes between them */
	bool is_signed;
	double minimum, maximum; /* as written; maximum < minimum: words only */
	double scale;            /* written = (field - bias) * scale; 0 = 1 */
	int32_t bias;
	const struct settings_word *words; /* ends with a NULL name; may be NULL */
	const char *unit;                  /* NULL = none */
	const char *help;
};

extern const struct settings_key settings_keys[];
extern const size_t settings_key_count;

enum { SETTINGS_NAME_MAX = 48, SETTINGS_VALUE_MAX = 256 };

/* The key's name with the index in it. Returns `out`. */
const char *settings_name(const struct settings_key *key, uint32_t index,
			  char out[SETTINGS_NAME_MAX]);

/*
 * Store what a person wrote. "leave" stores nothing. NULL, or what is wrong (a
 * static text to stand behind what was given); *settings is untouched then.
 */
const char *settings_store(const struct settings_key *key, uint32_t index, const char *text,
			   struct pokeys_settings *settings);

/* What may be written, for a person: "leave | 1..8". Returns its length. */
size_t settings_allowed(const struct settings_key *key, char *text, size_t size);

/* Whether the settings say anything about it. */
bool settings_given(const struct settings_key *key, uint32_t index,
		    const struct pokeys_settings *settings);

/*
 * As settings_store() takes it. False if it cannot be said: it is not given
 * (*text is "" then), or it has no word or is outside of what may be written
 * (*text is printable all the same, a raw number if it is one).
 */
bool settings_print(const struct settings_key *key, uint32_t index,
		    const struct pokeys_settings *settings, char text[SETTINGS_VALUE_MAX]);

/* The value is a plain number (and not a word): into *out. */
bool settings_number(const struct settings_key *key, uint32_t index,
		     const struct pokeys_settings *settings, double *out);

/*
 * Whether `wanted` says something that `device` has not. Not for functions of
 * pins, which are looked at one by one.
 */
bool settings_differ(const struct settings_key *key, uint32_t index,
		     const struct pokeys_settings *wanted, const struct pokeys_settings *device);

/* A function of a pin in words: "digital output, inverted". */
const char *settings_pin_text(uint8_t function, char text[SETTINGS_VALUE_MAX]);

#endif
