// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl moves: servo motors go along a path together, without LinuxCNC.
 *
 * The path is a file of straight moves, one in each line. The daemon plans the speeds over the
 * queued moves and computes the trajectory. This program only keeps the queue filled, so it has no
 * deadlines. If it is late, the motors slow down on the path, as they do at its end. The program
 * checks the whole file before any motor moves.
 *
 * The motors are off when the program ends. A signal slows them down on the path first. If the
 * program is killed or hangs, the daemon switches them off after the loss of its commander.
 */
#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/names.h>
#include "tools/argument.h"
#include "tools/pokeysctl.h"
#include "tools/print.h"
#include "tools/servo_run.h"

enum { SETTLE_MS = 300, STOP_MS = 5000, FRACTIONS = 256 };

#define SPEED_MOST 1e6		/* units/s, as max-speed */

struct move {
	/* of the motors in `motors`, in their order: counts, and 256ths of one */
	int32_t counts[POKEYS_SERVOS];
	uint8_t fraction[POKEYS_SERVOS];
	double to[POKEYS_SERVOS];	/* units, by number */
	double speed;			/* units/s */
	unsigned int line;
	uint8_t motors;
};

static struct program {
	const char *name;		/* of the file, as messages have it */
	struct move *move;
	size_t count, room;
	unsigned int line;
	double speed;			/* of the moves that follow; 0: not given */
	uint8_t motors;			/* of all moves */
} program;

static double worst[POKEYS_SERVOS];	/* following errors, units */

/* One line about the file. Returns false. */
__attribute__((format(printf, 1, 2)))
static bool wrong(const char *format, ...)
{
	char text[200];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	complain("%s:%u: %s", program.name, program.line, text);
	return false;
}

/* By its name, or its number; POKEYS_SERVOS after an error message. */
static unsigned int motor_of(struct loop_run *run, const char *word)
{
	char name[32], names[256] = "", number[12];

	for (unsigned int i = 0; i < POKEYS_SERVOS && print_has_servo(&run->state, i); i++) {
		print_clean(run->state.servo[i].name, sizeof(name), name);
		snprintf(number, sizeof(number), "%u", i);
		if (!strcmp(name, word) || !strcmp(number, word))
			return i;
		snprintf(names + strlen(names), sizeof(names) - strlen(names), ", %s", name);
	}
	wrong("\"%s\" is not a servo motor of %s; a line has motors and positions, or speed and a "
	      "number%s%s", argument_written(word), run->device, *names ? "; its motors: " : "",
	      *names ? names + 2 : "");
	return POKEYS_SERVOS;
}

static bool take_number(const char *word, const char *after_what, double *number)
{
	char *after;

	if (!word)
		return wrong("there is not a number after %s", argument_written(after_what));
	*number = strtod(word, &after);
	if (after != word && !*after && isfinite(*number))
		return true;
	return wrong("\"%s\" is not a number", argument_written(word));
}

static bool take_speed(double speed)
{
	if (!((float)speed > 0 && speed <= SPEED_MOST))
		return wrong("speed is a number above 0, up to %.0f units/s", SPEED_MOST);
	program.speed = speed;
	return true;
}

/* The limits come as floats, and the daemon rounds to counts. */
static bool is_beyond(const struct pokeys_servo *servo, double to)
{
	const double least = (double)servo->minimum, most = (double)servo->maximum;
	const double half = 0.5 / fabs(servo->counts_per_unit);

	return to < least - half - fabs(least) * FLT_EPSILON ||
	       to > most + half + fabs(most) * FLT_EPSILON;
}

static bool take_place(struct loop_run *run, struct move *move, unsigned int motor, double to)
{
	const struct pokeys_servo *servo = &run->state.servo[motor];
	const char *name = servo->name;

	if (move->motors >> motor & 1)
		return wrong("%.31s is given twice", name);
	if (fabs(to * servo->counts_per_unit) > INT32_MAX - 1)
		return wrong("%.31s %g is more than the encoder counts", name, to);
	if (servo->homed && is_beyond(servo, to))
		return wrong("%.31s %g is beyond its soft limits, %g to %g", name, to,
			     (double)servo->minimum, (double)servo->maximum);
	move->motors |= (uint8_t)(1u << motor);
	move->to[motor] = to;
	return true;
}

/* The words of a line, in pairs. */
static bool take_words(struct loop_run *run, char *line, struct move *move)
{
	char *rest = NULL;

	for (char *word = strtok_r(line, " \t\r\n", &rest); word;
	     word = strtok_r(NULL, " \t\r\n", &rest)) {
		const bool is_speed = !strcmp(word, "speed");
		const unsigned int motor = is_speed ? 0 : motor_of(run, word);
		double number = 0;

		if (motor == POKEYS_SERVOS ||
		    !take_number(strtok_r(NULL, " \t\r\n", &rest), word, &number) ||
		    !(is_speed ? take_speed(number) : take_place(run, move, motor, number)))
			return false;
	}
	return true;
}

static void keep(struct loop_run *run, struct move move)
{
	unsigned int values = 0;

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++) {
		const double per_unit = run->state.servo[i].counts_per_unit;
		const int64_t parts = llround(move.to[i] * per_unit * FRACTIONS);

		if (!(move.motors >> i & 1))
			continue;
		move.counts[values] = (int32_t)(parts >> 8);
		move.fraction[values++] = (uint8_t)(parts & (FRACTIONS - 1));
	}
	move.speed = program.speed;
	move.line = program.line;
	program.motors |= move.motors;
	program.move[program.count++] = move;
}

static bool take_line(struct loop_run *run, char *line)
{
	struct move move = { .motors = 0 };

	line[strcspn(line, "#;")] = '\0';
	if (!take_words(run, line, &move))
		return false;
	if (!move.motors)
		return true;
	if (program.speed <= 0)
		return wrong("no speed is given; write \"speed 20\" before, or give --speed 20");
	if (program.count == program.room) {
		const size_t room = program.room ? 2 * program.room : 1024;
		struct move *larger = reallocarray(program.move, room, sizeof(*larger));

		if (!larger)
			return wrong("not enough memory for more than %zu moves", program.count);
		program.move = larger;
		program.room = room;
	}
	keep(run, move);
	return true;
}

/* The whole file as text; NULL after an error message. */
static char *read_file(const char *name)
{
	const bool is_input = !strcmp(name, "-");
	FILE *file = is_input ? stdin : fopen(name, "r");
	char *text = NULL;
	bool whole = false;
	size_t size = 0;

	program.name = is_input ? "standard input" : name;
	if (!file) {
		complain("%s: %s", name, strerror(errno));
		return NULL;
	}
	if (getdelim(&text, &size, '\0', file) < 0)
		complain("%s: %s", program.name, ferror(file) ? strerror(errno) : "is empty");
	else if (!feof(file))
		complain("%s: not a text file", program.name);
	else
		whole = true;
	if (!is_input)
		fclose(file);
	if (whole)
		return text;
	free(text);
	return NULL;
}

static bool take(struct loop_run *run, char *text)
{
	char *rest = text;

	for (char *line = strsep(&rest, "\n"); line; line = strsep(&rest, "\n")) {
		program.line++;
		if (!take_line(run, line))
			return false;
	}
	if (program.count)
		return true;
	complain("%s: contains no moves; example of a line: x 10 y 5 speed 20", program.name);
	return false;
}

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

/* All of them, before it is confirmed of any. */
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

/* Look, and see that all of them are enabled. False after an error message. */
static bool turn(struct loop_run *run)
{
	char text[PRINT_SERVO_MAX];

	if (!loop_look(run) || !for_all(run, follow))
		return false;
	loop_show(run, print_moves(&run->state.moves, text), false);
	return true;
}

static enum pokeys_outcome control(struct loop_run *run, enum pokeys_moves_control which)
{
	return loop_give(run, (struct pokeys_one_shot){
		.operation = POKEYS_ONE_SHOT_MOVES_CONTROL, .index = (uint8_t)which,
	});
}

/* One more move into the queue, as soon as there is room. False after an error message. */
static bool queue(struct loop_run *run, const struct move *move)
{
	struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_MOVE, .mask = move->motors,
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
	return wrong("this move is refused: %s",
		     pokeys_moves_refusal_name(run->state.moves.refused));
}

/* Until they stand, and a while longer. */
static bool settle(struct loop_run *run)
{
	uint64_t end_ms;

	while (run->state.moves.waiting)
		if (!turn(run))
			return false;
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
	while (run->state.moves.waiting && commander_ms() < end_ms && loop_look(run))
		for_all(run, keep_on);
}

static bool report(struct loop_run *run)
{
	char name[32];

	print_clean(run->name, sizeof(name), name);
	printf("  %s: at %.4f; following error at most %.4f\n", name,
	       print_rounded(servo_run_of(run)->position, 4), worst[run->index]);
	return true;
}

static bool carry_out(struct loop_run *run)
{
	size_t queued = 0;
	bool ended, well;

	well = for_all(run, begin) && travel(run, &queued);
	ended = queued < program.count || run->state.moves.end != POKEYS_MOVES_DONE;
	loop_end_line(run);
	if (!well)
		slow_down(run);
	for_all(run, switch_off);
	well = for_all(run, servo_run_finish) && well;
	if (!well)
		return false;
	printf("%s: %s all %zu moves\n", run->device,
	       ended ? "path ended early: did not complete" : "completed", program.count);
	for_all(run, report);
	return !ended;
}

int command_moves(const struct options *options)
{
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
	text = read_file(options->names[1]);
	if (!text)
		return STATUS_FAILED;
	if (loop_open_device(&run, &servo_run_kind, options, &status))
		well = take(&run, text) && carry_out(&run);
	loop_close(&run);
	free(program.move);
	free(text);
	return well ? STATUS_OK : status;
}
