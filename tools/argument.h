/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Arguments of options into values. False: it has been said what is wrong. */
#ifndef TOOLS_ARGUMENT_H
#define TOOLS_ARGUMENT_H

#include <stdbool.h>
#include "tools/pokeysctl.h"

/* A number from minimum to maximum into *out, of an option of that name; a whole one. */
bool argument_number(const char *name, const char *text, double minimum, double maximum,
		     double *out);
bool argument_whole(const char *name, const char *text, double minimum, double maximum,
		    double *out);

/* IPv4 addresses with commas between them, behind those that options->address has. */
bool argument_addresses(struct options *options, const char *text);

/* A name as the user wrote it: pokeysctl.c puts a space before a number's sign. */
const char *argument_written(const char *text);

#endif
