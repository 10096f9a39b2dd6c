/* SPDX-License-Identifier: GPL-2.0-or-later */
/* pokeysctl(1): the tables of its commands and options. Cold, main thread. */
#ifndef TOOLS_TABLE_H
#define TOOLS_TABLE_H

#include <getopt.h>
#include <stdbool.h>
#include "tools/pokeysctl.h"

/* What a command takes besides what all of them take. */
enum {
	TAKES_RUNTIME = 1,
	TAKES_TIMEOUT = 2,
	TAKES_ADDRESS = 4,
	TAKES_INTERFACE = 8,
	TAKES_COUNT = 16,
	TAKES_INTERVAL = 32,
	TAKES_NAMES = 64,
	TAKES_CPU = 128,
	TAKES_CONFIG = 256,
	TAKES_ROOT = 512,
	TAKES_MEASURE = 1024,
	TAKES_SECONDS = 2048,
	TAKES_TRACE = 4096,
	TAKES_DURATION = 8192,
	TAKES_SPEED = 16384,
	TAKES_FOLLOW = 32768,
	TAKES_CSV = 65536,
	TAKES_DRAFT = 131072,
	TAKES_WRITE = 262144,
	TAKES_FIX = 524288,
};

struct command {
	const char *name, *arguments, *help;
	unsigned int takes;
	int (*run)(const struct options *options);
};

struct option_row {
	const char *name;
	char letter;        /* as usage_option() returns it */
	const char *value;  /* what stands for it in the help, NULL = it takes none */
	unsigned int takes; /* a command that takes it has this bit, 0 = all do */
	const char *help;
};

/* The letters that may be written with one dash, for usage_option(). */
#define TABLE_LETTERS ":r:jfh"

enum { TABLE_OPTIONS_MAX = 40 };

/* Each ends with a row without a name. */
extern const struct command table_commands[];
extern const struct option_row table_options[];

/*
 * The options for getopt_long(3). If two options have the same name, it is the one that a
 * command with these bits accepts, otherwise the first.
 */
void table_long_options(unsigned int takes, struct option options[TABLE_OPTIONS_MAX]);

/* The bit of this letter's option, 0 = all commands take it. */
unsigned int table_takes(int letter);

/* May it be written with one dash? */
bool table_short(const struct option_row *row);

#endif
