/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A file of moves, for pokeysctl moves. Cold, main thread. */
#ifndef TOOLS_MOVES_FILE_H
#define TOOLS_MOVES_FILE_H

#include <stddef.h>
#include <stdint.h>
#include "tools/loop_run.h"

enum { MOVES_VALUES = 8 }; /* motors and axes of one move */

struct move {
	/* of its motors, then of its axes, in their order: counts or pulses, and 256ths of one */
	int32_t counts[MOVES_VALUES];
	uint8_t fraction[MOVES_VALUES];
	double speed; /* units/s */
	unsigned int line;
	uint8_t motors, axes; /* one bit each */
};

struct program {
	const char *name;  /* of the file, as messages have it */
	struct move *move; /* the caller frees it */
	size_t count, room;
	unsigned int line;
	double speed;         /* of the moves that follow; 0: not given */
	uint8_t motors, axes; /* of all moves */
};

/* One line about the program's present line. Returns false. */
bool moves_wrong(const struct program *program, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

/* The whole file as text ("-": standard input), to be freed. NULL after an error message. */
char *moves_read(struct program *program, const char *name);

/* What it says, for the device of `run`. False after an error message. */
bool moves_take(struct program *program, const struct loop_run *run, char *text);

#endif
