// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl heater: heat to a temperature, find the gains, or clear a fault, without LinuxCNC.
 *
 * The daemon controls and watches the heater. This program only commands a target, and is the
 * lease for it: if it is killed or hangs, the daemon switches the heater off after the loss of its
 * commander. All other heaters of the device are off meanwhile.
 */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <pokeys/names.h>
#include "tools/argument.h"
#include "tools/commander.h"
#include "tools/pokeysctl.h"
#include "tools/print.h"

enum { FOLLOW_MS = 3000, LOST_MS = 1000, REDRAW_MS = 500, LINE_MS = 10000 };

enum verb { HEAT, TUNE, RESET };

struct order {
	enum verb verb;
	double celsius;
	double seconds;			/* HEAT: 0 = until a signal */
};

struct run {
	const char *device;
	const char *written;		/* the heater, as the command line names it */
	char name[32];			/* of its section in pokeysd.conf */
	unsigned int index;
	pokeys_client *client;
	struct pokeys_state state;	/* read last */
	struct pokeys_command command;
	uint64_t fresh_ms;		/* when `state` was read */
	uint64_t shown_ms;		/* when the last line was printed */
	bool fresh;			/* by the last look() */
	bool terminal;			/* the line can be overwritten */
	bool drawn;			/* the cursor is in such a line */
	bool was_there;			/* it was at its temperature */
	bool told;			/* an error was printed */
};

static const struct pokeys_heater *heater_of(const struct run *run)
{
	return &run->state.heater[run->index];
}

static void end_line(struct run *run)
{
	if (run->drawn)
		putchar('\n');
	fflush(stdout);
	run->drawn = false;
}

/* Print the first error only: the others follow from it. */
__attribute__((format(printf, 2, 3)))
static bool fails(struct run *run, const char *format, ...)
{
	char text[240];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	end_line(run);
	if (!run->told)
		complain("%s: heater %s: %s", run->device, run->name, text);
	run->told = true;
	return false;
}

/* Renew the lease and read the state. False after an error message. */
static bool look(struct run *run)
{
	static const char lapsed[] = "this program was stopped, or pokeysd was away; the heater "
				     "was switched off";
	struct pokeys_state state;

	if (pokeys_client_renew(run->client))
		return fails(run, "%s", lapsed);
	commander_nap();
	run->fresh = commander_read(run->client, &state);
	if (run->fresh) {
		run->state = state;
		run->fresh_ms = commander_ms();
	} else if (commander_ms() - run->fresh_ms > LOST_MS) {
		if (pokeys_client_renew(run->client))
			return fails(run, "%s", lapsed);
		return fails(run, "the device or pokeysd does not answer any more; the daemon or "
			     "the device's failsafe switches the heater off");
	}
	return true;
}

/* Wait until it is so. */
static bool await(struct run *run, const char *what, bool (*is_so)(const struct run *run))
{
	const uint64_t end_ms = commander_ms() + FOLLOW_MS;

	do {
		if (commander_ms() > end_ms)
			return fails(run, "%s; \"pokeysctl events\" may say why", what);
		if (!look(run))
			return false;
	} while (!run->fresh || !is_so(run));
	return true;
}

static bool is_commanded(const struct run *run)
{
	return run->state.one_shot_session == run->command.session;
}

static bool is_answered(const struct run *run)
{
	return commander_outcome(&run->command, &run->state) != POKEYS_OUTCOME_NONE;
}

static bool is_off(const struct run *run)
{
	const struct pokeys_heater *heater = heater_of(run);

	return heater->state == POKEYS_HEATER_OFF || heater->state == POKEYS_HEATER_FAULT;
}

static bool is_at_work(const struct run *run)
{
	const struct pokeys_heater *heater = heater_of(run);

	return heater->state == POKEYS_HEATER_HEATING || heater->state == POKEYS_HEATER_TUNING;
}

static bool is_decided(const struct run *run)
{
	return is_at_work(run) || heater_of(run)->refused || heater_of(run)->fault;
}

static void want(struct run *run, double celsius)
{
	run->command.heater_mask = 1u << run->index;
	run->command.heater_target[run->index] = (float)celsius;
	pokeys_client_command(run->client, &run->command);
}

/* Give a one-shot and wait for its outcome. */
static enum pokeys_outcome ask(struct run *run, enum pokeys_one_shot_operation operation,
			       double parameter)
{
	commander_order(&run->command, (struct pokeys_one_shot){
		.operation = (uint8_t)operation, .index = (uint8_t)run->index,
		.parameter = { (float)parameter } });
	pokeys_client_command(run->client, &run->command);
	if (!await(run, "the daemon does not answer", is_answered))
		return POKEYS_OUTCOME_NONE;
	return commander_outcome(&run->command, &run->state);
}

/* Print how it is: on a terminal always the same line, elsewhere when there is something new. */
static void show(struct run *run)
{
	const bool there = heater_of(run)->at_temperature;
	const bool news = there != run->was_there || !run->shown_ms;
	const uint64_t passed_ms = commander_ms() - run->shown_ms;
	char text[PRINT_HEATER_MAX];

	if (!news && passed_ms < (run->terminal ? REDRAW_MS : LINE_MS))
		return;
	run->was_there = there;
	run->shown_ms = commander_ms();
	print_heater(heater_of(run), text);
	if (run->terminal)
		printf("\r\033[K%s", text);
	else
		puts(text);
	run->drawn = run->terminal;
	fflush(stdout);
}

/* Why it does not heat, when it should. */
static bool explain(struct run *run)
{
	const struct pokeys_heater *heater = heater_of(run);

	if (heater->fault)
		return fails(run, "off by a fault: %s; when its cause is gone: pokeysctl heater %s "
			     "%s reset", pokeys_heater_fault_name(heater->fault), run->device,
			     run->name);
	if (heater->refused == POKEYS_HEATER_NOT_READY || heater->condition)
		return fails(run, "not ready: %s",
			     pokeys_heater_fault_name(heater->condition));
	if (heater->refused)
		return fails(run, "%s", pokeys_heater_refusal_name(heater->refused));
	return fails(run, "it was switched off; \"pokeysctl events\" says why");
}

/* Can it heat? A reading may have been late. */
static bool is_ready(struct run *run)
{
	const uint64_t end_ms = commander_ms() + FOLLOW_MS;

	while (heater_of(run)->condition) {
		if (commander_ms() > end_ms)
			return explain(run);
		if (!look(run))
			return false;
	}
	return true;
}

/* Off, as the daemon asks for before it takes a target; and it may heat. */
static bool begin(struct run *run, double celsius)
{
	const struct pokeys_heater *heater = heater_of(run);

	if (celsius > (double)heater->target_maximum)
		return fails(run, "%g C is above its highest target, %g C; see max-target in "
			     "pokeysd.conf(5)", celsius, (double)heater->target_maximum);
	want(run, 0);
	if (!await(run, "the daemon does not take the command", is_commanded))
		return false;
	if (heater->fault)
		return explain(run);
	return is_ready(run);
}

static bool finish(struct run *run)
{
	end_line(run);
	want(run, 0);
	if (heater_of(run)->state == POKEYS_HEATER_TUNING)
		ask(run, POKEYS_ONE_SHOT_HEATER_TUNE, 0);
	return await(run, "it is not known whether it is off", is_off);
}

static bool heat(struct run *run, const struct order *order)
{
	const uint64_t begun_ms = commander_ms();
	const double most_ms = order->seconds > 0 ? order->seconds * 1000 : INFINITY;

	if (!begin(run, order->celsius))
		return false;
	if (order->celsius == 0)
		return finish(run);
	want(run, order->celsius);
	if (!await(run, "the daemon does not take the target", is_decided))
		return false;
	while (!commander_ended() && (double)(commander_ms() - begun_ms) < most_ms) {
		if (!is_at_work(run))
			return explain(run);
		show(run);
		if (!look(run))
			return false;
	}
	return finish(run);
}

static void print_gains(const struct run *run)
{
	const struct pokeys_heater *heater = heater_of(run);

	printf("%s: heater %s: gains found; write them into [heater %s] in pokeysd.conf, and "
	       "restart pokeysd:\npid-p = %.4g\npid-i = %.4g\npid-d = %.4g\n", run->device,
	       run->name, run->name, (double)heater->tuned_p, (double)heater->tuned_i,
	       (double)heater->tuned_d);
}

static bool tune(struct run *run, const struct order *order)
{
	if (!begin(run, order->celsius))
		return false;
	if (ask(run, POKEYS_ONE_SHOT_HEATER_TUNE, order->celsius) != POKEYS_OUTCOME_DONE)
		return explain(run);
	while (heater_of(run)->tuning == POKEYS_HEATER_TUNING_RUNS) {
		if (commander_ended()) {
			finish(run);
			return fails(run, "the search was ended; no gains found");
		}
		show(run);
		if (!look(run))
			return false;
	}
	end_line(run);
	if (heater_of(run)->fault)
		return explain(run);
	if (heater_of(run)->tuning != POKEYS_HEATER_TUNING_DONE)
		return fails(run, "no gains found; \"pokeysctl events\" may say why");
	print_gains(run);
	return true;
}

static bool reset(struct run *run)
{
	want(run, 0);
	if (!await(run, "the daemon does not take the command", is_commanded))
		return false;
	if (!heater_of(run)->fault) {
		printf("%s: heater %s: no fault\n", run->device, run->name);
		return true;
	}
	if (ask(run, POKEYS_ONE_SHOT_HEATER_RESET, 0) != POKEYS_OUTCOME_DONE)
		return fails(run, "the cause of its fault is still present: %s",
			     pokeys_heater_fault_name(heater_of(run)->condition ?
						      heater_of(run)->condition :
						      heater_of(run)->fault));
	printf("%s: heater %s: reset; it accepts targets again\n", run->device, run->name);
	return true;
}

static bool carry_out(struct run *run, const struct order *order)
{
	switch (order->verb) {
	case HEAT:
		return heat(run, order);
	case TUNE:
		return tune(run, order);
	case RESET:
		break;
	}
	return reset(run);
}

/* Find the heater by its name, or by its number. */
static bool find(struct run *run)
{
	char names[POKEYS_HEATERS * 34] = "", number[12];

	for (run->index = 0; run->index < POKEYS_HEATERS; run->index++) {
		if (!print_has_heater(&run->state, run->index))
			break;
		print_clean(heater_of(run)->name, sizeof(heater_of(run)->name), run->name);
		snprintf(number, sizeof(number), "%u", run->index);
		if (!strcmp(run->name, run->written) || !strcmp(number, run->written))
			return true;
		snprintf(names + strlen(names), sizeof(names) - strlen(names), "%s%s",
			 run->index ? ", " : "", run->name);
	}
	if (run->index)
		complain("%s: there is no heater \"%s\"; its heaters: %s", run->device,
			 run->written, names);
	else
		complain("%s: this device has no heaters; see [heater NAME] in pokeysd.conf(5)",
			 run->device);
	return false;
}

static bool take_celsius(const char *text, double *celsius)
{
	char *after;

	*celsius = strtod(text, &after);
	return after != text && !*after && *celsius >= 0 && *celsius <= 2000;
}

static bool take(const struct options *options, struct order *order)
{
	static const char *const verbs[] = { [HEAT] = "heat", [TUNE] = "tune", [RESET] = "reset" };
	char *const *names = options->names;
	size_t verb = 0;

	while (options->name_count >= 3 && verb <= RESET && strcmp(names[2], verbs[verb]))
		verb++;
	if (options->name_count < 3 || verb > RESET ||
	    options->name_count != (verb == RESET ? 3u : 4u)) {
		complain("heater needs a device, a heater, and what to do: pokeysctl heater "
			 "printer bed heat 60 (or tune 60, reset)");
		return false;
	}
	*order = (struct order){ .verb = (enum verb)verb, .seconds = options->duration_s };
	if (verb != RESET && !take_celsius(names[3], &order->celsius)) {
		complain("\"%s\": temperatures are numbers from 0 to 2000, in degrees C",
			 argument_written(names[3]));
		return false;
	}
	if (verb == TUNE && order->celsius == 0) {
		complain("tune needs the temperature at which the heater will be used");
		return false;
	}
	if (verb != HEAT && options->duration_s > 0) {
		complain("--for is for heat");
		return false;
	}
	return true;
}

int command_heater(const struct options *options)
{
	static struct run run;
	struct order order;
	bool well = false;
	int status;

	if (!take(options, &order))
		return STATUS_USAGE;
	run.device = options->names[0];
	run.written = options->names[1];
	run.terminal = isatty(STDOUT_FILENO);
	run.client = commander_open(options, run.device, &run.state, &status);
	if (!run.client)
		return status;
	run.command.session = commander_session();
	run.fresh_ms = commander_ms();
	if (find(&run))
		well = carry_out(&run, &order);
	pokeys_client_close(run.client);
	return well ? STATUS_OK : STATUS_FAILED;
}
