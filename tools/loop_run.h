/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What pokeysctl heater and pokeysctl servo have in common. Cold, main thread. */
#ifndef TOOLS_LOOP_RUN_H
#define TOOLS_LOOP_RUN_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include "tools/commander.h"

/* What keeps a loop off, in words; NULL = nothing. */
struct loop_trouble {
	const char *fault, *condition, *refusal;
	uint8_t obstacle; /* enum pokeys_obstacle, of the condition */
};

/* What can be done with it, and how many names the command line has then. */
struct loop_verb {
	const char *word;
	size_t names;
};

/* A gain that is to be changed. */
struct loop_gain {
	enum pokeys_gain which;
	double value; /* in the units of pokeysd.conf(5) */
};

/* One kind of loops, by its index in the state. */
struct loop_kind {
	const char *word;            /* "heater", also of its section in pokeysd.conf */
	const char *lapsed, *silent; /* what becomes of it without this program, and us */
	unsigned int most;
	unsigned int turn_ms; /* from one loop_look() to the next */
	unsigned int gains;   /* the first ones of enum pokeys_gain */
	double gain_most;
	bool (*is_there)(const struct pokeys_state *state, unsigned int index);
	const char *(*name)(const struct pokeys_state *state, unsigned int index);
	struct loop_trouble (*trouble)(const struct pokeys_state *state, unsigned int index);
	const char *csv_head; /* the columns after time_s */
	void (*csv_line)(FILE *to, const struct pokeys_state *state, unsigned int index);
};

struct loop_run {
	const struct loop_kind *kind;
	const char *device;
	const char *written; /* the loop, as the command line names it */
	char name[32];       /* of its section in pokeysd.conf */
	unsigned int index;
	pokeys_client *client;
	struct pokeys_state state; /* read last */
	struct pokeys_command command;
	uint64_t fresh_ms; /* when `state` was read */
	uint64_t shown_ms; /* when the last line was printed */
	bool fresh;        /* by the last loop_look() */
	bool terminal;     /* the line can be overwritten */
	bool drawn;        /* the cursor is in such a line */
	bool mark;         /* of the last line */
	bool told;         /* an error was printed */
	const char *csv_name;
	FILE *csv;                     /* what happens to the loop; NULL = nowhere */
	uint64_t csv_begin_ns, csv_ns; /* cycles of the first and of the last line */
};

/*
 * Become the commander of the device that the command line names; loop_open() also finds the loop
 * that it names, and begins the file of --csv. False after an error message; then *status is what
 * to exit with. loop_close() in any case.
 */
bool loop_open_device(struct loop_run *run, const struct loop_kind *kind,
		      const struct options *options, int *status);
bool loop_open(struct loop_run *run, const struct loop_kind *kind, const struct options *options,
	       int *status);
void loop_close(struct loop_run *run);

/* What follows is about this loop, which is there. */
void loop_choose(struct loop_run *run, unsigned int index);

/* Print the first error only, as the others follow from it. Returns false. */
bool loop_fails(struct loop_run *run, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

/* Renew the lease and read the state. False after an error message. */
bool loop_look(struct loop_run *run);

/* Look until it is so, for three seconds. False after an error message. */
bool loop_await(struct loop_run *run, const char *what, bool (*is_so)(const struct loop_run *run));

/* Give a one-shot, or one for this loop, and wait for its outcome; NONE after an error message. */
enum pokeys_outcome loop_give(struct loop_run *run, struct pokeys_one_shot shot);
enum pokeys_outcome loop_order(struct loop_run *run, struct pokeys_one_shot shot);
enum pokeys_outcome loop_ask(struct loop_run *run, enum pokeys_one_shot_operation operation,
			     double parameter);

/* Say why it is off, when it should be on. Returns false. */
bool loop_explain(struct loop_run *run);

/* The command is taken, and nothing keeps the loop off. False after an error message. */
bool loop_is_ready(struct loop_run *run);

/* Clear its fault, and print that, with what it can do then. False after an error message. */
bool loop_reset(struct loop_run *run, enum pokeys_one_shot_operation operation, const char *then);

/* Which of these verbs the command line has; `count` after an error message, which is `usage`. */
size_t loop_take_verb(const struct options *options, const struct loop_verb *verbs, size_t count,
		      const char *usage);

/*
 * Which gain the two last of a command's words are, such as pid-p 0.35. False after an error
 * message.
 */
bool loop_take_gain(const struct loop_kind *kind, char *const words[2], struct loop_gain *gain);

/* Change it until the daemon ends, and print that. False after an error message. */
bool loop_regain(struct loop_run *run, enum pokeys_one_shot_operation operation,
		 const struct loop_gain *gain);

/*
 * Print a line about it: on a terminal always in the same place, twice a second, and elsewhere
 * every ten seconds; at once if its mark has changed.
 */
void loop_show(struct loop_run *run, const char *text, bool mark);
/* What is printed next begins a line. */
void loop_end_line(struct loop_run *run);

#endif
