/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The options of a command line, as all our programs take them.
 */
#ifndef USAGE_OPTION_H
#define USAGE_OPTION_H

#include <getopt.h>

/*
 * Take the next option, as getopt_long(3) does, of which `letters` begins with ':'. Long
 * options are to be spelled out. A mistake is told in one line to stderr, "PROGRAM: what is
 * wrong; PROGRAM --help lists them", and then the result is '?'; -1 = there are no more.
 * Every letter stands in the table as well. Cold, main thread.
 */
int usage_option(const char *program, int argc, char **argv, const char *letters,
		 const struct option *table);

#endif
