// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl heater: heat to a temperature, find or change the gains, or clear a fault, without
 * LinuxCNC.
 *
 * The daemon controls and watches the heater. This program only commands a target, and is the
 * lease for it: if it is killed or hangs, the daemon switches the heater off after the loss of its
 * commander. All other heaters of the device are off meanwhile.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/names.h>
#include "tools/argument.h"
#include "tools/loop_run.h"
#include "tools/pokeysctl.h"
#include "tools/print.h"

enum verb { HEAT, TUNE, GAIN, RESET, VERBS };

struct order {
	enum verb verb;
	double celsius;
	double seconds; /* HEAT: 0 = until a signal */
	struct loop_gain gain;
};

static const struct pokeys_heater *heater_of(const struct loop_run *run)
{
	return &run->state.heater[run->index];
}

static bool is_off(const struct loop_run *run)
{
	const struct pokeys_heater *heater = heater_of(run);

	return heater->state == POKEYS_HEATER_OFF || heater->state == POKEYS_HEATER_FAULT;
}

static bool is_at_work(const struct loop_run *run)
{
	const struct pokeys_heater *heater = heater_of(run);

	return heater->state == POKEYS_HEATER_HEATING || heater->state == POKEYS_HEATER_TUNING;
}

static bool is_decided(const struct loop_run *run)
{
	return is_at_work(run) || heater_of(run)->refused || heater_of(run)->fault;
}

static void want(struct loop_run *run, double celsius)
{
	run->command.heater_mask = 1u << run->index;
	run->command.heater_target[run->index] = (float)celsius;
	pokeys_client_command(run->client, &run->command);
}

static void show(struct loop_run *run)
{
	char text[PRINT_HEATER_MAX];

	loop_show(run, print_heater(heater_of(run), text), heater_of(run)->at_temperature);
}

/* Off, as the daemon asks for before it takes a target; and it may heat. */
static bool begin(struct loop_run *run, double celsius)
{
	const struct pokeys_heater *heater = heater_of(run);

	if (celsius > (double)heater->target_maximum)
		return loop_fails(run,
				  "%g C is above its highest target, %g C; see max-target in "
				  "pokeysd.conf(5)",
				  celsius, (double)heater->target_maximum);
	want(run, 0);
	return loop_is_ready(run);
}

static bool finish(struct loop_run *run)
{
	loop_end_line(run);
	want(run, 0);
	if (heater_of(run)->state == POKEYS_HEATER_TUNING)
		loop_ask(run, POKEYS_ONE_SHOT_HEATER_TUNE, 0);
	return loop_await(run, "the daemon does not confirm that it is off", is_off);
}

static bool heat(struct loop_run *run, const struct order *order)
{
	const uint64_t begun_ms = commander_ms();
	const double most_ms = order->seconds > 0 ? order->seconds * 1000 : INFINITY;

	if (!begin(run, order->celsius))
		return false;
	if (order->celsius == 0)
		return finish(run);
	want(run, order->celsius);
	if (!loop_await(run, "the daemon does not take the target", is_decided))
		return false;
	while (!commander_ended() && (double)(commander_ms() - begun_ms) < most_ms) {
		if (!is_at_work(run))
			return loop_explain(run);
		show(run);
		if (!loop_look(run))
			return false;
	}
	return finish(run);
}

static void print_gains(const struct loop_run *run)
{
	const struct pokeys_heater *heater = heater_of(run);

	printf("%s: heater %s: gains found; write them into [heater %s] in pokeysd.conf, and "
	       "restart pokeysd:\npid-p = %.4g\npid-i = %.4g\npid-d = %.4g\n",
	       run->device, run->name, run->name, (double)heater->tuned_p, (double)heater->tuned_i,
	       (double)heater->tuned_d);
}

static bool tune(struct loop_run *run, const struct order *order)
{
	if (!begin(run, order->celsius))
		return false;
	if (loop_ask(run, POKEYS_ONE_SHOT_HEATER_TUNE, order->celsius) != POKEYS_OUTCOME_DONE)
		return loop_explain(run);
	while (heater_of(run)->tuning == POKEYS_HEATER_TUNING_RUNS) {
		if (commander_ended()) {
			finish(run);
			return loop_fails(run, "the search was ended; no gains found");
		}
		show(run);
		if (!loop_look(run))
			return false;
	}
	loop_end_line(run);
	if (heater_of(run)->fault)
		return loop_explain(run);
	if (heater_of(run)->tuning != POKEYS_HEATER_TUNING_DONE)
		return loop_fails(run, "no gains found; \"pokeysctl events\" may say why");
	print_gains(run);
	return true;
}

static bool reset(struct loop_run *run)
{
	want(run, 0);
	return loop_reset(run, POKEYS_ONE_SHOT_HEATER_RESET, "it accepts targets again");
}

static bool regain(struct loop_run *run, const struct order *order)
{
	want(run, 0);
	return loop_regain(run, POKEYS_ONE_SHOT_HEATER_GAIN, &order->gain);
}

static bool carry_out(struct loop_run *run, const struct order *order)
{
	switch (order->verb) {
	case HEAT:
		return heat(run, order);
	case TUNE:
		return tune(run, order);
	case GAIN:
		return regain(run, order);
	case RESET:
	case VERBS:
		break;
	}
	return reset(run);
}

static bool take_celsius(const char *text, double *celsius)
{
	char *after;

	*celsius = strtod(text, &after);
	return after != text && !*after && *celsius >= 0 && *celsius <= 2000;
}

static struct loop_trouble trouble(const struct pokeys_state *state, unsigned int index)
{
	const struct pokeys_heater *heater = &state->heater[index];

	return (struct loop_trouble){
		.fault = heater->fault ? pokeys_heater_fault_name(heater->fault) : NULL,
		.condition = heater->condition ? pokeys_heater_fault_name(heater->condition) : NULL,
		.obstacle = heater->obstacle,
		.refusal = heater->refused ? pokeys_heater_refusal_name(heater->refused) : NULL,
	};
}

static const char *name(const struct pokeys_state *state, unsigned int index)
{
	return state->heater[index].name;
}

static void csv_line(FILE *to, const struct pokeys_state *state, unsigned int index)
{
	const struct pokeys_heater *heater = &state->heater[index];

	fprintf(to, "%.2f,%.2f,%.4f\n", (double)heater->temperature, (double)heater->target,
		(double)heater->power);
}

static const struct loop_kind kind = {
	.word = "heater",
	.most = POKEYS_HEATERS,
	.turn_ms = COMMANDER_TURN_MS,
	.gains = POKEYS_GAIN_D + 1,
	.gain_most = 100000,
	.lapsed = "this program was suspended, or pokeysd was away; the heater was switched off",
	.silent = "the device or pokeysd does not answer any more; the daemon or the device's "
		  "failsafe switches the heater off",
	.is_there = print_has_heater,
	.name = name,
	.trouble = trouble,
	.csv_head = "temperature,target,power",
	.csv_line = csv_line,
};

static bool take(const struct options *options, struct order *order)
{
	static const struct loop_verb verbs[VERBS] = {
		[HEAT] = { "heat", 4 },
		[TUNE] = { "tune", 4 },
		[GAIN] = { "gain", 5 },
		[RESET] = { "reset", 3 },
	};
	char *const *names = options->names;
	const size_t verb = loop_take_verb(
		options, verbs, VERBS,
		"heater needs a device, a heater, and what to do: pokeysctl heater printer bed "
		"heat 60 (or tune 60, gain pid-p 30, reset)");

	if (verb == VERBS)
		return false;
	*order = (struct order){ .verb = (enum verb)verb, .seconds = options->duration_s };
	if (verb != HEAT && options->duration_s > 0) {
		complain("--for is for heat");
		return false;
	}
	if (verb == GAIN)
		return loop_take_gain(&kind, &names[3], &order->gain);
	if (verb != RESET && !take_celsius(names[3], &order->celsius)) {
		complain("\"%s\": temperatures are numbers from 0 to 2000, in degrees C",
			 argument_written(names[3]));
		return false;
	}
	if (verb == TUNE && order->celsius == 0) {
		complain("tune needs the temperature at which the heater will be used");
		return false;
	}
	return true;
}

int command_heater(const struct options *options)
{
	static struct loop_run run;
	struct order order;
	bool well = false;
	int status = STATUS_FAILED;

	if (!take(options, &order))
		return STATUS_USAGE;
	if (loop_open(&run, &kind, options, &status))
		well = carry_out(&run, &order);
	loop_close(&run);
	return well ? STATUS_OK : status;
}
