/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_PARSE_H
#define SIM_PARSE_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/link.h"
#include "sim/text.h"

/*
 * Words from the command line, the control socket and scripts into values.
 * All return false on bad input, having added to `why` what was wrong and what
 * is allowed, as "pin: '77' is not 1..55". A word may be NULL: "pin: missing,
 * want 1..55". Output is untouched on failure.
 */

/* Decimal, or 0x hexadecimal. */
bool sim_parse_integer(struct sim_text *why, const char *what, const char *word, int64_t low,
		       int64_t high, int64_t *value);

/* A probability or another plain number. */
bool sim_parse_number(struct sim_text *why, const char *what, const char *word, double low,
		      double high, double *value);

/* One of a list, as "off|on"; gives its place in the list. */
bool sim_parse_choice(struct sim_text *why, const char *what, const char *word, const char *choices,
		      unsigned int *value);

/*
 * A distribution of microseconds: "200", "100-300" evenly, or
 * "heavy:LOW:HIGH[:ALPHA]" with a heavy tail cut at HIGH.
 */
bool sim_parse_delay(struct sim_text *why, const char *what, const char *word,
		     struct sim_delay *delay);

/* A dotted IPv4 address. */
bool sim_parse_address(struct sim_text *why, const char *what, const char *word,
		       uint8_t address[4]);

/* Writes a delay the way sim_parse_delay() reads it. */
void sim_print_delay(struct sim_text *text, const struct sim_delay *delay);

/*
 * Splits a line into at most `most` words in place; returns their number, or
 * -1 when there are more. '#' begins a comment. A word in double quotes may
 * hold blanks.
 */
int sim_parse_words(char *line, char **words, int most);

#endif
