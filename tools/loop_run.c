// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A program as the commander of one heater or motor: attached, the lease renewed, the state read,
 * a line on the terminal. If it is killed or hangs, the daemon ends what it commanded.
 */
#include "tools/loop_run.h"
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <pokeys/names.h>
#include "tools/argument.h"
#include "tools/print.h"

enum { FOLLOW_MS = 3000, LOST_MS = 1000, REDRAW_MS = 500, LINE_MS = 10000 };

void loop_end_line(struct loop_run *run)
{
	if (run->drawn)
		putchar('\n');
	fflush(stdout);
	run->drawn = false;
}

bool loop_fails(struct loop_run *run, const char *format, ...)
{
	char text[240];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	loop_end_line(run);
	if (!run->told && *run->name)
		complain("%s: %s %s: %s", run->device, run->kind->word, run->name, text);
	else if (!run->told)
		complain("%s: %s", run->device, text);
	run->told = true;
	return false;
}

static void write_csv(struct loop_run *run)
{
	const uint64_t now_ns = run->state.t_cycle_ns;

	if (!run->csv || now_ns == run->csv_ns)
		return;
	run->csv_begin_ns = run->csv_begin_ns ? run->csv_begin_ns : now_ns;
	run->csv_ns = now_ns;
	fprintf(run->csv, "%.6f,", (double)(now_ns - run->csv_begin_ns) / 1e9);
	run->kind->csv_line(run->csv, &run->state, run->index);
}

bool loop_look(struct loop_run *run)
{
	struct pokeys_state state;

	if (pokeys_client_renew(run->client))
		return loop_fails(run, "%s", run->kind->lapsed);
	commander_nap(run->kind->turn_ms);
	run->fresh = commander_read(run->client, &state);
	if (run->fresh) {
		run->state = state;
		run->fresh_ms = commander_ms();
		write_csv(run);
	} else if (commander_ms() - run->fresh_ms > LOST_MS) {
		if (pokeys_client_renew(run->client))
			return loop_fails(run, "%s", run->kind->lapsed);
		return loop_fails(run, "%s", run->kind->silent);
	}
	return true;
}

bool loop_await(struct loop_run *run, const char *what, bool (*is_so)(const struct loop_run *run))
{
	const uint64_t end_ms = commander_ms() + FOLLOW_MS;

	do {
		if (commander_ms() > end_ms)
			return loop_fails(run, "%s; \"pokeysctl events\" may say why", what);
		if (!loop_look(run))
			return false;
	} while (!run->fresh || !is_so(run));
	return true;
}

static bool is_commanded(const struct loop_run *run)
{
	return run->state.one_shot_session == run->command.session;
}

static bool is_answered(const struct loop_run *run)
{
	return commander_outcome(&run->command, &run->state) != POKEYS_OUTCOME_NONE;
}

enum pokeys_outcome loop_give(struct loop_run *run, struct pokeys_one_shot shot)
{
	commander_order(&run->command, shot);
	pokeys_client_command(run->client, &run->command);
	if (!loop_await(run, "the daemon does not answer", is_answered))
		return POKEYS_OUTCOME_NONE;
	return commander_outcome(&run->command, &run->state);
}

enum pokeys_outcome loop_order(struct loop_run *run, struct pokeys_one_shot shot)
{
	shot.index = (uint8_t)run->index;
	return loop_give(run, shot);
}

enum pokeys_outcome loop_ask(struct loop_run *run, enum pokeys_one_shot_operation operation,
			     double parameter)
{
	return loop_order(run, (struct pokeys_one_shot){ .operation = (uint8_t)operation,
							 .parameter = { (float)parameter } });
}

static struct loop_trouble trouble_of(const struct loop_run *run)
{
	return run->kind->trouble(&run->state, run->index);
}

bool loop_explain(struct loop_run *run)
{
	const struct loop_trouble trouble = trouble_of(run);
	char why[PRINT_OBSTACLE_MAX];

	if (trouble.fault)
		return loop_fails(run,
				  "off by a fault: %s; when its cause is gone: pokeysctl %s "
				  "%s %s reset",
				  trouble.fault, run->kind->word, run->device, run->name);
	if (trouble.condition)
		return loop_fails(run, "not ready: %s%s", trouble.condition,
				  print_obstacle(trouble.obstacle, why));
	if (trouble.refusal)
		return loop_fails(run, "%s", trouble.refusal);
	return loop_fails(run, "it was switched off; \"pokeysctl events\" says why");
}

/* A reading may have been late. */
bool loop_is_ready(struct loop_run *run)
{
	const uint64_t end_ms = commander_ms() + FOLLOW_MS;

	if (!loop_await(run, "the daemon does not take the command", is_commanded))
		return false;
	while (trouble_of(run).condition && !trouble_of(run).fault && commander_ms() < end_ms)
		if (!loop_look(run))
			return false;
	return (!trouble_of(run).condition && !trouble_of(run).fault) || loop_explain(run);
}

bool loop_reset(struct loop_run *run, enum pokeys_one_shot_operation operation, const char *then)
{
	struct loop_trouble trouble;
	char why[PRINT_OBSTACLE_MAX];

	if (!loop_await(run, "the daemon does not take the command", is_commanded))
		return false;
	if (!trouble_of(run).fault) {
		printf("%s: %s %s: no fault\n", run->device, run->kind->word, run->name);
		return true;
	}
	if (loop_ask(run, operation, 0) != POKEYS_OUTCOME_DONE) {
		trouble = trouble_of(run);
		return loop_fails(run, "the cause of its fault is still present: %s%s",
				  trouble.condition ? trouble.condition : trouble.fault,
				  print_obstacle(trouble.obstacle, why));
	}
	printf("%s: %s %s: reset; %s\n", run->device, run->kind->word, run->name, then);
	return true;
}

size_t loop_take_verb(const struct options *options, const struct loop_verb *verbs, size_t count,
		      const char *usage)
{
	for (size_t i = 0; options->name_count >= 3 && i < count; i++)
		if (!strcmp(options->names[2], verbs[i].word) &&
		    options->name_count == verbs[i].names)
			return i;
	complain("%s", usage);
	return count;
}

bool loop_take_gain(const struct loop_kind *kind, char *const words[2], struct loop_gain *gain)
{
	char names[120] = "", *after;
	unsigned int which = 0;

	while (which < kind->gains && strcmp(words[0], pokeys_gain_name((uint8_t)which)))
		which++;
	if (which == kind->gains) {
		for (unsigned int i = 0; i < kind->gains; i++)
			snprintf(names + strlen(names), sizeof(names) - strlen(names), "%s%s",
				 i ? ", " : "", pokeys_gain_name((uint8_t)i));
		complain("\"%s\": a %s has the gains %s", argument_written(words[0]), kind->word,
			 names);
		return false;
	}
	gain->which = (enum pokeys_gain)which;
	gain->value = strtod(words[1], &after);
	if (after != words[1] && !*after && gain->value >= 0 && gain->value <= kind->gain_most)
		return true;
	complain("\"%s\": %s is a number from 0 to %.0f", argument_written(words[1]), words[0],
		 kind->gain_most);
	return false;
}

bool loop_regain(struct loop_run *run, enum pokeys_one_shot_operation operation,
		 const struct loop_gain *gain)
{
	const char *name = pokeys_gain_name((uint8_t)gain->which);
	const struct pokeys_one_shot shot = {
		.operation = (uint8_t)operation,
		.mask = (uint8_t)gain->which,
		.parameter = { (float)gain->value },
	};
	enum pokeys_outcome outcome;

	if (!loop_await(run, "the daemon does not take the command", is_commanded))
		return false;
	outcome = loop_order(run, shot);
	if (outcome == POKEYS_OUTCOME_NONE)
		return false;
	if (outcome != POKEYS_OUTCOME_DONE)
		return loop_fails(run, "%s = %g is refused: pid-p and pid-i must not both be 0",
				  name, gain->value);
	printf("%s: %s %s: %s = %g until pokeysd ends; write it into [%s %s] in pokeysd.conf to "
	       "keep it\n",
	       run->device, run->kind->word, run->name, name, gain->value, run->kind->word,
	       run->name);
	return true;
}

void loop_show(struct loop_run *run, const char *text, bool mark)
{
	const uint64_t passed_ms = commander_ms() - run->shown_ms;
	const bool news = mark != run->mark || !run->shown_ms;

	if (!news && passed_ms < (run->terminal ? REDRAW_MS : LINE_MS))
		return;
	run->mark = mark;
	run->shown_ms = commander_ms();
	if (run->terminal)
		printf("\r\033[K%s", text);
	else
		puts(text);
	run->drawn = run->terminal;
	fflush(stdout);
}

void loop_choose(struct loop_run *run, unsigned int index)
{
	run->index = index;
	print_clean(run->kind->name(&run->state, index), sizeof(run->name), run->name);
}

/* By its name, or by its number. */
static bool find(struct loop_run *run)
{
	const struct loop_kind *kind = run->kind;
	char names[256] = "", number[12];

	for (run->index = 0; run->index < kind->most; run->index++) {
		if (!kind->is_there(&run->state, run->index))
			break;
		loop_choose(run, run->index);
		snprintf(number, sizeof(number), "%u", run->index);
		if (!strcmp(run->name, run->written) || !strcmp(number, run->written))
			return true;
		snprintf(names + strlen(names), sizeof(names) - strlen(names), "%s%s",
			 run->index ? ", " : "", run->name);
	}
	if (run->index)
		complain("%s: there is no %s \"%s\"; its %ss: %s", run->device, kind->word,
			 run->written, kind->word, names);
	else
		complain("%s: this device has no %ss; see [%s NAME] in pokeysd.conf(5)",
			 run->device, kind->word, kind->word);
	return false;
}

bool loop_open_device(struct loop_run *run, const struct loop_kind *kind,
		      const struct options *options, int *status)
{
	run->kind = kind;
	run->device = options->names[0];
	run->terminal = isatty(STDOUT_FILENO);
	run->client = commander_open(options, run->device, &run->state, status);
	if (!run->client)
		return false;
	run->command.session = commander_session();
	run->fresh_ms = commander_ms();
	return true;
}

static bool begin_csv(struct loop_run *run, const char *name)
{
	if (!name)
		return true;
	run->csv_name = name;
	run->csv = fopen(name, "w");
	if (!run->csv) {
		complain("--csv: %s: %s", name, strerror(errno));
		return false;
	}
	fprintf(run->csv, "time_s,%s\n", run->kind->csv_head);
	return true;
}

bool loop_open(struct loop_run *run, const struct loop_kind *kind, const struct options *options,
	       int *status)
{
	run->written = options->names[1];
	return loop_open_device(run, kind, options, status) && find(run) &&
	       begin_csv(run, options->csv);
}

void loop_close(struct loop_run *run)
{
	if (run->csv && (ferror(run->csv) | fclose(run->csv)))
		complain("--csv: %s: %s; the file is not whole", run->csv_name, strerror(errno));
	if (run->client)
		pokeys_client_close(run->client);
}
