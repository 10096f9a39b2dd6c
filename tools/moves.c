// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl moves: servo motors and axes go along a path together, without LinuxCNC.
 *
 * The path is a file of straight moves, one in each line. The daemon plans the speeds over the
 * queued moves and computes the trajectory. This program only keeps the queue filled, so it has no
 * deadlines. If it is late, they slow down on the path, as they do at its end. The program checks
 * the whole file before anything moves.
 *
 * Motors and machine are off when the program ends. A signal slows them down on the path first. If
 * the program is killed or hangs, the daemon switches them off after the loss of its commander.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/names.h>
#include "tools/axis_run.h"
#include "tools/moves_file.h"
#include "tools/print.h"
#include "tools/servo_run.h"

enum { SETTLE_MS = 300, STOP_MS = 5000 };

static struct program program;
static double worst[POKEYS_SERVOS]; /* following errors, units */

static bool for_all(struct loop_run *run, bool (*does)(struct loop_run *run))
{
	bool well = true;

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++) {
		if (!(program.motors >> i & 1))
			continue;
		loop_choose(run, i);
		well = does(run) && well;
	}
	return well;
}

static bool begin(struct loop_run *run)
{
	return run->told ? false : servo_run_begin(run);
}

/* Axes first: nothing moves by that, and the machine may be refused. */
static bool begin_all(struct loop_run *run)
{
	return (!program.axes || axis_run_begin(run, program.axes)) && for_all(run, begin);
}

static bool switch_off(struct loop_run *run)
{
	servo_run_want(run, false, servo_run_of(run)->position, 0);
	return true;
}

/* Those that are enabled stay so. */
static bool keep_on(struct loop_run *run)
{
	servo_run_want(run, servo_run_is_enabled(run), servo_run_of(run)->commanded, 0);
	return true;
}

/* Command the position that the daemon commands: where the path ends, it is the same. */
static bool follow(struct loop_run *run)
{
	const struct pokeys_servo *servo = servo_run_of(run);

	worst[run->index] = fmax(worst[run->index], fabs((double)servo->error));
	if (run->told || !servo_run_is_enabled(run))
		return run->told || loop_explain(run);
	servo_run_want(run, true, servo->commanded, 0);
	return true;
}

/* Also what is commanded of axes, if there is no motor. */
static void send(struct loop_run *run)
{
	run->command.t_thread_ns = run->fresh_ms * 1000000;
	pokeys_client_command(run->client, &run->command);
}

/* Look, and see that all of them are enabled. False after an error message. */
static bool turn(struct loop_run *run)
{
	char text[PRINT_SERVO_MAX];

	if (!loop_look(run) || !axis_run_check(run, program.axes))
		return false;
	if (program.axes)
		axis_run_keep(run, program.axes);
	if (!for_all(run, follow))
		return false;
	send(run);
	loop_show(run, print_moves(&run->state.moves, text), false);
	return true;
}

static enum pokeys_outcome control(struct loop_run *run, enum pokeys_moves_control which)
{
	return loop_give(run, (struct pokeys_one_shot){
				      .operation = POKEYS_ONE_SHOT_MOVES_CONTROL,
				      .index = (uint8_t)which,
			      });
}

/* One more move into the queue, as soon as there is room. False after an error message. */
static bool queue(struct loop_run *run, const struct move *move)
{
	struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_MOVE,
		.mask = move->motors,
		.index = move->axes,
		.parameter = { (float)move->speed },
	};
	enum pokeys_outcome outcome;

	memcpy(shot.value, move->counts, sizeof(move->counts));
	memcpy(shot.fraction, move->fraction, sizeof(move->fraction));
	if (move == program.move)
		shot.flags = POKEYS_MOVE_BEGINS;
	while (run->state.moves.waiting >= POKEYS_MOVES && !commander_ended())
		if (!turn(run))
			return false;
	if (commander_ended())
		return true;
	outcome = loop_give(run, shot);
	if (outcome == POKEYS_OUTCOME_NONE || outcome == POKEYS_OUTCOME_DONE)
		return outcome == POKEYS_OUTCOME_DONE;
	/* a motor that is off says why */
	if (!turn(run))
		return false;
	program.line = move->line;
	run->told = true;
	loop_end_line(run);
	return moves_wrong(&program, "this move is refused: %s",
			   pokeys_moves_refusal_name(run->state.moves.refused));
}

/* Until they stand, and a while longer. */
static bool settle(struct loop_run *run)
{
	uint64_t end_ms;

	while (run->state.moves.waiting)
		if (!turn(run))
			return false;
	end_ms = commander_ms() + STOP_MS;
	while (!axis_run_stands(run, program.axes)) {
		if (!turn(run))
			return false;
		if (commander_ms() > end_ms)
			return loop_fails(run, "an axis has not come to the end of the path; "
					       "\"pokeysctl events\" may say why");
	}
	end_ms = commander_ms() + SETTLE_MS;
	while (commander_ms() < end_ms)
		if (!turn(run))
			return false;
	return true;
}

static bool travel(struct loop_run *run, size_t *queued)
{
	while (*queued < program.count && !commander_ended()) {
		if (!queue(run, &program.move[*queued]))
			return false;
		*queued += !commander_ended();
		if (!turn(run))
			return false;
	}
	while (run->state.moves.waiting && !commander_ended())
		if (!turn(run))
			return false;
	if (commander_ended() && run->state.moves.waiting &&
	    control(run, POKEYS_MOVES_ABORT) == POKEYS_OUTCOME_NONE)
		return false;
	return settle(run);
}

/* Whatever has happened: what still moves stops on the path, before it is switched off. */
static void slow_down(struct loop_run *run)
{
	const uint64_t end_ms = commander_ms() + STOP_MS;

	if (run->state.moves.waiting && run->state.moves.state != POKEYS_MOVES_ABORTING)
		control(run, POKEYS_MOVES_ABORT);
	while ((run->state.moves.waiting || !axis_run_stands(run, program.axes)) &&
	       commander_ms() < end_ms && loop_look(run))
		for_all(run, keep_on);
}

/* All of them, before it is confirmed of any. */
static bool end_all(struct loop_run *run)
{
	bool well;

	if (program.axes)
		axis_run_switch_off(run);
	for_all(run, switch_off);
	well = for_all(run, servo_run_finish);
	return (!program.axes || axis_run_finish(run)) && well;
}

static bool report(struct loop_run *run)
{
	char name[32];

	print_clean(run->name, sizeof(name), name);
	printf("  %s: at %.4f; following error at most %.4f\n", name,
	       print_rounded(servo_run_of(run)->position, 4), worst[run->index]);
	return true;
}

static void report_axes(const struct loop_run *run)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis *axis = &run->state.engine.axis[i];
		char name[32];

		if (program.axes >> i & 1)
			printf("  %s: at %.4f\n", print_clean(axis->name, sizeof(axis->name), name),
			       print_rounded(axis->position / axis->pulses_per_unit, 4));
	}
}

static bool carry_out(struct loop_run *run)
{
	size_t queued = 0;
	bool ended, well;

	well = begin_all(run) && travel(run, &queued);
	ended = queued < program.count || run->state.moves.end != POKEYS_MOVES_DONE;
	loop_end_line(run);
	if (!well)
		slow_down(run);
	well = end_all(run) && well;
	if (!well)
		return false;
	printf("%s: %s all %zu moves\n", run->device,
	       ended ? "path ended early: did not complete" : "completed", program.count);
	for_all(run, report);
	report_axes(run);
	return !ended;
}

int command_moves(const struct options *options)
{
	struct loop_kind kind = servo_run_kind;
	static struct loop_run run;
	int status = STATUS_FAILED;
	bool well = false;
	char *text;

	if (options->name_count != 2) {
		complain("moves needs a device and a file of moves: pokeysctl moves mill "
			 "square.txt --speed 20 (- reads standard input)");
		return STATUS_USAGE;
	}
	program.speed = options->speed;
	text = moves_read(&program, options->names[1]);
	if (!text)
		return STATUS_FAILED;
	kind.lapsed = "this program was suspended, or pokeysd was away; what moved was switched "
		      "off";
	kind.silent = "the device or pokeysd does not answer any more; the daemon or the device's "
		      "failsafe stops what moves";
	if (loop_open_device(&run, &kind, options, &status))
		well = moves_take(&program, &run, text) && carry_out(&run);
	loop_close(&run);
	free(program.move);
	free(text);
	return well ? STATUS_OK : status;
}
